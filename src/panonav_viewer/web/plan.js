import { scaleBar } from 'panonav/draw';
import { Plot, mark, text } from 'panonav/plot';
import { moves, watch, watchTogether } from 'panonav/sight';

// Colours from black over blue and green to yellow: rising in lightness, so that hues need not be distinguished.
const ramp = [[0, 34, 78], [53, 69, 108], [102, 105, 112], [148, 142, 119], [200, 184, 102], [254, 232, 56]];
const shade = share => {
  const at = Math.max(0, Math.min(1, share)) * (ramp.length - 1), i = Math.min(ramp.length - 2, Math.floor(at));
  return ramp[i].map((value, c) => Math.round(value + (ramp[i + 1][c] - value) * (at - i)));
};

// Shows a map from above: { title, unit, backdrop: [layers], frames: [{ title, layers: [{ label, colour, circles, crosses, lines, polygons,
// dots, squares }] }] }, or values on a grid: { title, heat: { columns, rows, first, spacing, values, label, crosses } }.
// Several frames play one after the other.
class Plan extends Plot {
  attached() {
    const { frames = [{ layers: [] }], backdrop = [], shown } = this.content;
    this.frames = frames;
    this.backdrop = backdrop;
    this.index = 0;
    this.box = shown ?? this.bounds();
    const [wide, high] = [this.box[2] - this.box[0], this.box[3] - this.box[1]];
    this.style.aspectRatio = String(Math.max(0.7, Math.min(2.6, (wide + 1e-3) / (high + 1e-3))));
    this.zoom = 1;
    this.shift = [0, 0];
    if (this.content.heat) this.shadeCells();
    this.canvas.addEventListener('pointerdown', event => { if (event.pointerType === 'mouse') this.canvas.setPointerCapture(event.pointerId); });
    this.canvas.addEventListener('pointermove', event => {
      if (event.buttons && event.pointerType === 'mouse') {
        this.shift = [this.shift[0] + event.movementX, this.shift[1] + event.movementY];
        this.redraw();
      }
      this.tell(event.offsetX, event.offsetY);
    });
    this.canvas.addEventListener('pointerleave', () => { this.readout.textContent = ''; });
    this.canvas.addEventListener('wheel', event => {
      if (!event.ctrlKey) return;  // the page scrolls
      event.preventDefault();
      this.zoomBy(Math.exp(-event.deltaY / 300));
    }, { passive: false });
    this.addEventListener('keydown', event => {
      const act = { '+': () => this.zoomBy(1.3), '-': () => this.zoomBy(1 / 1.3), '0': () => { this.shift = [0, 0]; this.zoom = 1; this.redraw(); } }[event.key];
      if (!act) return;
      event.stopPropagation();
      act();
    });
    if (frames.length > 1) this.addControls();
  }
  zoomBy(factor) {
    this.zoom = Math.max(0.3, Math.min(100, this.zoom * factor));
    this.shift = this.shift.map(value => value * factor);
    this.redraw();
  }
  bounds() {
    const box = [Infinity, Infinity, -Infinity, -Infinity], { heat } = this.content;
    const include = flat => {
      for (let i = 0; i < flat.length; i += 2) {
        box[0] = Math.min(box[0], flat[i]); box[1] = Math.min(box[1], flat[i + 1]);
        box[2] = Math.max(box[2], flat[i]); box[3] = Math.max(box[3], flat[i + 1]);
      }
    };
    for (const { layers } of [...this.frames, { layers: this.backdrop }]) {
      for (const layer of layers) {
        for (const name of ['circles', 'crosses', 'dots', 'squares']) include(layer[name] ?? []);
        for (const name of ['lines', 'polygons']) (layer[name] ?? []).forEach(include);
      }
    }
    if (heat) {
      const [x, y] = heat.first, half = heat.spacing / 2;
      include([x - half, y - half, x + (heat.columns - 0.5) * heat.spacing, y + (heat.rows - 0.5) * heat.spacing]);
    }
    return box[0] <= box[2] ? box : [0, 0, 1, 1];
  }
  // --- frames
  addControls() {
    const controls = document.createElement('div');
    controls.className = 'controls';
    controls.innerHTML = '<button type="button">Play</button><input type="range" min="0" value="0" aria-label="Step"><output></output>';
    [this.button, this.slider, this.label] = controls.children;
    this.slider.max = this.frames.length - 1;
    this.button.addEventListener('click', () => { this.held = this.playing; this.play(!this.playing); });
    this.slider.addEventListener('input', () => { this.hold(); this.show(Number(this.slider.value)); });
    this.key.after(controls);
    this.story = this.closest('.story');
    this.show(this.frames.length - 1);  // until it plays, it shows what it leads to
    if (this.story) watchTogether(this.story, this); else watch(this);
  }
  setVisible(visible) { this.play(visible && !this.held && moves() && (Boolean(this.story) || !this.ended)); }
  hold() { this.held = true; this.play(false); }
  play(isPlaying) {
    clearTimeout(this.timer);
    if (isPlaying && this.index >= this.frames.length - 1) this.show(0);
    this.playing = isPlaying;
    this.button.textContent = isPlaying ? 'Pause' : 'Play';
    if (!isPlaying) return;
    const step = () => {
      if (this.index >= this.frames.length - 1) {
        this.ended = true;
        this.play(Boolean(this.story));  // a story begins again
        return;
      }
      this.show(this.index + 1);
      if (this.story && this.index === this.frames.length - 1) {
        this.timer = setTimeout(step, 3000);
        return;
      }
      this.timer = setTimeout(step, Math.max(40, Math.min(400, 6000 / this.frames.length)));
    };
    this.timer = setTimeout(step, 600);
  }
  show(index) {
    this.index = index;
    this.slider.value = index;
    this.label.textContent = this.frames[index].title;
    this.redraw();
  }
  // --- drawing
  px(x) { return this.origin[0] + x * this.scale; }
  py(y) { return this.origin[1] - y * this.scale; }
  draw(context, width, height, colour) {
    const [x0, y0, x1, y1] = this.box, { heat } = this.content, bar = heat ? 64 : 0;
    this.scale = this.zoom * Math.min((width - 28 - bar) / (x1 - x0 || 1), (height - 48) / (y1 - y0 || 1));
    this.origin = [(width - bar) / 2 + this.shift[0] - (x0 + x1) / 2 * this.scale,
      height / 2 + 10 + this.shift[1] + (y0 + y1) / 2 * this.scale];
    const keys = new Map();
    if (heat) this.drawHeat(context, width, height, colour, keys);
    for (const layer of [...this.backdrop, ...this.frames[this.index].layers]) this.drawLayer(context, layer, colour, keys);
    scaleBar(context, this.scale, width, this.content.unit ?? 'm', colour);
    this.explain([...keys].map(([name, [key, kind]]) => [name, key, kind]));
  }
  drawLayer(context, layer, colour, keys) {
    const { label, colour: key, polygons = [], lines = [], circles = [], dots = [], squares = [], crosses = [] } = layer;
    context.fillStyle = context.strokeStyle = colour(key);
    const path = flat => {
      context.beginPath();
      for (let i = 0; i < flat.length; i += 2) context.lineTo(this.px(flat[i]), this.py(flat[i + 1]));
    };
    context.globalAlpha = 0.3;
    for (const flat of polygons) { path(flat); context.fill(); }
    context.globalAlpha = 1;
    context.lineWidth = lines.length > 50 ? 1 : 2;
    for (const flat of lines) { path(flat); context.stroke(); }
    context.lineWidth = 1.5;
    const size = this.clientWidth < 320 ? 0.6 : 1;
    const marks = (flat, kind, large) => {
      for (let i = 0; i < flat.length; i += 2) mark(context, kind, this.px(flat[i]), this.py(flat[i + 1]), size * large);
    };
    marks(dots, 'dot', dots.length > 1000 ? 1.4 : 2.2);
    marks(circles, 'ring', circles.length > 400 ? 2.5 : 4);
    marks(squares, 'square', 5);
    marks(crosses, 'cross', 4);
    const kind = squares.length ? 'square' : crosses.length ? 'cross' : circles.length ? 'ring' : lines.length ? 'line' : dots.length ? 'dot' : 'area';
    if (label && (polygons.length || lines.length || circles.length || dots.length || squares.length || crosses.length)) keys.set(label, [key, kind]);
  }
  shadeCells() {
    const { heat } = this.content, known = heat.values.filter(value => value !== null);
    this.low = Math.min(0, ...known.length ? [known.reduce((a, b) => Math.min(a, b))] : []);
    this.high = known.reduce((a, b) => Math.max(a, b), this.low);
    if (this.high === this.low) this.high = this.low + 1;
    this.cells = document.createElement('canvas');
    this.cells.width = heat.columns; this.cells.height = heat.rows;
    const context = this.cells.getContext('2d'), pixels = context.createImageData(heat.columns, heat.rows);
    heat.values.forEach((value, i) => {
      if (value === null) return;
      const row = heat.rows - 1 - Math.floor(i / heat.columns), at = 4 * (row * heat.columns + i % heat.columns);
      pixels.data.set([...shade((value - this.low) / (this.high - this.low)), 255], at);
    });
    context.putImageData(pixels, 0, 0);
  }
  drawHeat(context, width, height, colour, keys) {
    const { heat } = this.content, { first, spacing, columns, rows } = heat, side = spacing * this.scale;
    context.imageSmoothingEnabled = false;
    context.drawImage(this.cells, this.px(first[0] - spacing / 2), this.py(first[1] + (rows - 0.5) * spacing), columns * side, rows * side);
    context.strokeStyle = '#fff';
    for (const [thick, ink] of [[5, '#000'], [2, '#fff']]) {
      context.lineWidth = thick;
      context.strokeStyle = ink;
      for (let i = 0; i < heat.crosses.length; i += 2) mark(context, 'cross', this.px(heat.crosses[i]), this.py(heat.crosses[i + 1]), 7);
    }
    const top = 34, bottom = height - 16, left = width - 60;
    for (let y = top; y < bottom; ++y) {
      context.fillStyle = `rgb(${shade((bottom - y) / (bottom - top))})`;
      context.fillRect(left, y, 14, 1.5);
    }
    context.font = '12px system-ui';
    context.fillStyle = colour('ink');
    context.textAlign = 'left';
    for (const share of [0, 0.5, 1]) context.fillText(text(this.low + share * (this.high - this.low)), left + 18, bottom - share * (bottom - top) + 4, 42);
    context.textAlign = 'right';
    context.fillText(heat.label, width - 6, 18, width * 0.6);
    context.textAlign = 'left';
  }
  tell(x, y) {
    if (!this.scale) return;
    const at = [(x - this.origin[0]) / this.scale, (this.origin[1] - y) / this.scale], { heat, unit = 'm' } = this.content;
    const place = unit === 'm' ? `x ${at[0].toFixed(2)} m, y ${at[1].toFixed(2)} m` : '';
    if (!heat) { this.readout.textContent = place; return; }
    const column = Math.round((at[0] - heat.first[0]) / heat.spacing), row = Math.round((at[1] - heat.first[1]) / heat.spacing);
    const value = column >= 0 && column < heat.columns && row >= 0 && row < heat.rows ? heat.values[row * heat.columns + column] : null;
    this.readout.textContent = value === null ? place : `${place}: ${text(value)}`;
  }
}
customElements.define('pn-plan', Plan);
