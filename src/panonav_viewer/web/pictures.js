import { degrees } from 'panonav/draw';

// Shows the panorama with its compass, the most similar remembered view in the same orientation, their difference by
// column, and the camera's picture.
class Pictures extends HTMLElement {
  attach(run, address) {
    this.run = run;
    this.address = address;
    this.innerHTML = `
<figure class="panorama"><canvas role="img" aria-label="Panorama"></canvas><figcaption>Panorama, forward in the middle</figcaption></figure>
<figure class="best"><canvas role="img" aria-label="Most similar stored view"></canvas><figcaption></figcaption></figure>
<figure class="difference"><canvas role="img" aria-label="Difference by column"></canvas><figcaption>Difference by column: higher is less similar</figcaption></figure>
<figure class="camera"><img alt="Image of the camera"><figcaption>Camera</figcaption></figure>
<p class="readout"></p>`;
    for (const figure of this.querySelectorAll('figure')) {
      figure.hidden = true;
      const id = `${figure.className}-figure`;
      if (!document.getElementById(id)) figure.id = id;  // of the first run of a page
    }
    run.addEventListener('moment', () => this.show());
    new ResizeObserver(() => this.draw()).observe(this);
  }

  // Loads one set of pictures at a time: a slow connection skips some.
  async show() {
    if (this.hidden || !this.run.moment) return;
    if (this.loading) { this.again = true; return; }
    this.loading = true;
    let index = this.run.index;
    if (this.run.over) while (index > 0 && !this.run.moments[index].data) --index;  // not all have pictures
    const moment = this.run.moments[index];
    const found = await Promise.all(['camera', 'panorama', 'best'].map(which => this.load(moment, which)));
    const readout = this.querySelector('.readout');
    if (!found.some(Boolean) && !this.run.over && moment !== this.run.moments[this.run.last]) {
      readout.textContent = 'Images of earlier moments of a live run are not stored; use --record to store them.';
    } else {
      readout.textContent = '';
      this.images = found;
      this.moment = moment;
      this.draw();
    }
    await new Promise(done => setTimeout(done, 30));  // lets the map move first while the slider moves
    this.loading = false;
    if (this.again) { this.again = false; this.show(); }
  }
  load(moment, which) {
    if (!this.address(moment, which) || !moment.pictures?.includes(which)) return undefined;
    return new Promise(resolve => {
      const image = new Image();
      image.onload = () => resolve(image);
      image.onerror = () => resolve(undefined);
      image.src = this.address(moment, which);
    });
  }

  draw() {
    if (!this.images) return;
    const [camera, panorama, best] = this.images;
    const figure = name => this.querySelector(`figure.${name}`);
    figure('camera').hidden = !camera;
    if (camera) figure('camera').querySelector('img').src = camera.src;
    figure('panorama').hidden = !panorama;
    if (panorama) {
      this.drawPanorama(figure('panorama').querySelector('canvas'), panorama, 0, true);
      const name = this.moment.values?.image;
      figure('panorama').querySelector('figcaption').textContent = `Panorama${name ? ` of the image ${name}` : ''}, forward in the middle`;
    }
    figure('best').hidden = !best;
    const turn = this.moment.turn;
    if (best) {
      this.drawPanorama(figure('best').querySelector('canvas'), best, turn ?? 0, false);
      const name = this.moment.values?.best_match;
      figure('best').querySelector('figcaption').textContent = `Most similar stored view${name ? ` (${name})` : ''}` +
        (turn === undefined ? '' : `, rotated by ${Math.round(degrees(turn))}°`);
    }
    figure('difference').hidden = !(panorama && best && turn !== undefined);
    if (!figure('difference').hidden) this.drawDifference(figure, turn);
  }
  // Draws a panorama whose heading is `turn` further left shifted to the right.
  drawPanorama(canvas, image, turn, compass) {
    const width = Math.max(1, this.clientWidth - 16), ratio = devicePixelRatio || 1;
    const height = Math.max(40, Math.min(width * 0.3, width * image.naturalHeight / image.naturalWidth));
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
    canvas.style.height = `${height}px`;
    const context = canvas.getContext('2d');
    context.scale(ratio, ratio);
    const shift = ((turn / (2 * Math.PI) % 1) + 1) % 1 * width;
    context.drawImage(image, shift, 0, width, height);
    context.drawImage(image, shift - width, 0, width, height);
    if (!compass) return;
    context.font = '12px system-ui';
    context.textAlign = 'center';
    for (const [share, text] of [[0, 'back'], [0.25, 'left'], [0.5, 'forward'], [0.75, 'right']]) {
      context.fillStyle = '#000a';
      context.fillRect(share * width - (share ? 24 : 0), height - 15, share ? 48 : 32, 15);
      context.fillStyle = '#fff';
      context.fillText(text, share * width + (share ? 0 : 16), height - 4);
    }
  }
  drawDifference(figure, turn) {
    const columns = 180, rows = 24;
    const pixels = (image, shift) => {
      const canvas = document.createElement('canvas');
      canvas.width = columns; canvas.height = rows;
      const context = canvas.getContext('2d', { willReadFrequently: true });
      context.drawImage(image, shift, 0, columns, rows);
      context.drawImage(image, shift - columns, 0, columns, rows);
      const { data } = context.getImageData(0, 0, columns, rows);
      const grey = new Float32Array(columns * rows);
      let sum = 0;
      for (let i = 0; i < grey.length; ++i) sum += grey[i] = (data[4 * i] + data[4 * i + 1] + data[4 * i + 2]) / 3;
      return grey.map(value => value - sum / grey.length);  // a different mean brightness does not count
    };
    const canvas = figure('difference').querySelector('canvas'), width = Math.max(1, this.clientWidth - 16), height = 36;
    const a = pixels(this.images[1], 0), b = pixels(this.images[2], ((turn / (2 * Math.PI) % 1) + 1) % 1 * columns);
    canvas.width = width; canvas.height = height; canvas.style.height = `${height}px`;
    const context = canvas.getContext('2d');
    context.fillStyle = getComputedStyle(this).getPropertyValue('--particle');
    for (let c = 0; c < columns; ++c) {
      let difference = 0;
      for (let r = 0; r < rows; ++r) difference += Math.abs(a[r * columns + c] - b[r * columns + c]);
      const tall = Math.min(height, difference / rows / 128 * height);
      context.fillRect(c / columns * width, height - tall, width / columns, tall);
    }
  }
}
customElements.define('pn-pictures', Pictures);
