import { Drawing } from 'panonav/draw';
import { stateClass } from 'panonav/store';

// Shows the state over time as a band of colour and height, its probability as a line.
class Timeline extends Drawing {
  attached() {
    this.setAttribute('role', 'img');
    this.setAttribute('aria-label', 'State and probability over time');
    this.insertAdjacentHTML('beforeend', '<div class="readout"></div>');
    this.readout = this.querySelector('.readout');
    this.run.addEventListener('moment', () => this.redraw());
    this.run.addEventListener('grown', () => this.redraw());
    const seek = event => {
      if (!event.buttons || this.run.last < 1) return;
      const [from, to] = this.span();
      this.run.seek(from + (event.offsetX - 34) / (this.clientWidth - 44) * (to - from));
    };
    this.canvas.addEventListener('pointerdown', seek);
    this.canvas.addEventListener('pointermove', seek);
  }
  span() { return [this.run.moments[0].t, Math.max(this.run.moments[this.run.last].t, this.run.moments[0].t + 1e-6)]; }

  // Draws once what does not change from moment to moment.
  drawRun(width, height, colour) {
    const { moments } = this.run, ratio = devicePixelRatio || 1;
    const drawn = [width, height, ratio, moments.length, moments[0].t, colour('ground')].join();
    if (this.drawn === drawn) return;
    this.drawn = drawn;
    this.still ??= document.createElement('canvas');
    this.still.width = this.canvas.width;
    this.still.height = this.canvas.height;
    const context = this.still.getContext('2d'), [from, to] = this.span();
    context.scale(ratio, ratio);
    const x = t => 34 + (t - from) / (to - from) * (width - 44), top = 10, bottom = height - 26;
    const y = probability => bottom - probability * (bottom - top);
    context.font = '11px system-ui';
    context.fillStyle = colour('soft');
    context.strokeStyle = colour('line');
    context.lineWidth = 1;
    this.hasProbability = moments.some(({ probability }) => probability !== undefined);
    this.classList.toggle('band', !this.hasProbability);  // of states alone, which needs less height
    for (const probability of this.hasProbability ? [0, 0.5, 1] : []) {
      context.fillText(probability.toFixed(1), 8, y(probability) + 4);
      context.beginPath();
      context.moveTo(34, y(probability)); context.lineTo(width - 10, y(probability));
      context.stroke();
    }
    // The height shows the state, too, for colour-blind viewers.
    const heights = { good: 12, doubt: 8, bad: 4 };
    moments.forEach((moment, i) => {
      if (!moment.state) return;
      const kind = stateClass(moment), left = x(moment.t), right = i < this.run.last ? x(moments[i + 1].t) : left + 2;
      context.fillStyle = colour(kind);
      const start = Math.floor(left);  // no gaps between neighbours
      context.fillRect(start, height - 8 - heights[kind], Math.max(1, Math.ceil(right) - start), heights[kind]);
    });
    context.strokeStyle = colour('estimate');
    context.lineWidth = 1.5;
    context.beginPath();
    let drawing = false;
    for (const { t, probability } of moments) {
      if (probability === undefined) { drawing = false; continue; }
      if (drawing) context.lineTo(x(t), y(probability)); else context.moveTo(x(t), y(probability));
      drawing = true;
    }
    context.stroke();
  }
  draw(context, width, height, colour) {
    const { moments, moment } = this.run;
    if (!moments.length) return;
    this.drawRun(width, height, colour);
    context.drawImage(this.still, 0, 0, width, height);
    if (!moment) return;
    const [from, to] = this.span(), at = 34 + (moment.t - from) / (to - from) * (width - 44);
    context.strokeStyle = colour('ink');
    context.lineWidth = 1.5;
    context.beginPath();
    context.moveTo(at, 4); context.lineTo(at, height - 6);
    context.stroke();
    this.readout.textContent = moment.probability === undefined ? this.hasProbability ? 'probability of the state' : moment.state ?? ''
      : `probability ${moment.probability.toFixed(2)}`;
  }
}
customElements.define('pn-timeline', Timeline);
