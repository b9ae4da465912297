import { Plot, line, mark, seriesColours, text } from 'panonav/plot';

const dashes = [[], [6, 3], [2, 3], [9, 3, 2, 3], [4, 4], [1, 4]];
const shapes = ['dot', 'square', 'triangle', 'cross', 'ring', 'dot'];

// Curves over one axis, or a picture over two: { title, x_label, y_label, series: [{ label, style, x, y, low, high }],
// log_x, log_y, x_range, y_range, names } or { ..., image, x_range, y_range, x_tick, y_tick }.
export class Chart extends Plot {
  attached() {
    if (this.content.image) {
      this.image = new Image();
      this.image.onload = () => this.redraw();
      this.image.src = this.content.image;
    } else {
      this.offerNumbers();
    }
    this.canvas.addEventListener('pointermove', event => this.tell(event.offsetX, event.offsetY));
    this.canvas.addEventListener('pointerleave', () => { this.readout.textContent = ''; this.at = undefined; this.redraw(); });
    this.addEventListener('keydown', event => {
      const by = { ArrowLeft: -1, ArrowRight: 1 }[event.key], all = this.content.series?.[0]?.x.length;
      if (!by || !all) return;
      event.stopPropagation();
      event.preventDefault();
      this.at = Math.max(0, Math.min(all - 1, (this.at ?? -by) + by));
      this.read();
    });
  }
  // The numbers as text, for screen readers and for copying.
  offerNumbers() {
    const details = document.createElement('details');
    details.innerHTML = '<summary>Numbers</summary>';
    details.addEventListener('toggle', () => {
      if (details.children.length > 1) return;
      const table = document.createElement('table'), row = (cells, tag) => {
        const made = document.createElement('tr');
        for (const cell of cells) made.append(Object.assign(document.createElement(tag), { textContent: cell }));
        table.append(made);
      };
      row(['', this.content.x_label, this.content.y_label], 'th');
      for (const { label, x, y } of this.content.series) {
        x.forEach((value, i) => row([label, this.content.names?.[value] ?? text(value, 6), text(y[i], 6)], 'td'));
      }
      const box = document.createElement('div');
      box.className = 'wide';
      box.append(table);
      details.append(box);
    }, { once: true });
    this.key.after(details);
  }
  range(which) {
    const { series, names } = this.content, fixed = this.content[`${which}_range`], log = this.content[`log_${which}`];
    const label = this.content[`${which}_label`], step = this.content[`${which}_tick`];
    if (which === 'x' && names) return { from: -0.6, to: names.length - 0.4, names, label };
    if (fixed) return { from: fixed[0], to: fixed[1], log, label, step };
    let low = Infinity, high = -Infinity;
    for (const one of series) {
      for (const values of [one[which], ...(which === 'y' ? [one.low, one.high] : [])]) {
        for (const value of values ?? []) {
          if (value === null || log && value <= 0) continue;
          low = Math.min(low, value); high = Math.max(high, value);
        }
      }
    }
    if (low > high) [low, high] = log ? [1, 10] : [0, 1];
    if (log) return { from: low / 1.2, to: high * 1.2, log, label };
    if (which === 'y') {
      if (low > 0 && low < 0.6 * high || series.some(({ style }) => style === 'bars')) low = Math.min(low, 0);
      const more = (high - low || Math.abs(high) || 1) * 0.06;
      return { from: low === 0 ? 0 : low - more, to: high + more, label };
    }
    return { from: low, to: high === low ? low + 1 : high, label };
  }
  draw(context, width, height, colour) {
    this.axis = [this.range('x'), this.range('y')];
    const { px, py } = this.axes(context, width, height, colour, this.axis), { left, right, top, bottom } = this.area;
    this.px = px; this.py = py;
    context.save();
    context.beginPath();
    context.rect(left - 6, top - 6, right - left + 12, bottom - top + 12);
    context.clip();
    if (this.image?.complete && this.image.naturalWidth) {
      context.imageSmoothingEnabled = false;
      context.drawImage(this.image, left, top, right - left, bottom - top);
    }
    this.content.series?.forEach((series, i) => this.drawSeries(context, series, i, colour));
    this.over?.(context, colour);
    context.restore();
    this.explain((this.content.series ?? []).map(({ label, style, x }, i) => [label, seriesColours[i % 6],
      style === 'points' ? shapes[i % 6] : style === 'bars' ? 'area' : 'line', x.length])
      .filter(([label, , , count]) => label && count).map(([label, key, kind]) => [label, key, kind]));
  }
  drawSeries(context, { style, x, y, low, high }, i, colour) {
    const { px, py } = this, [, { log }] = this.axis, shape = shapes[i % 6];
    const canDraw = value => value !== null && (!log || value > 0);
    let offset = 0;  // of bars of several series
    context.strokeStyle = context.fillStyle = colour(seriesColours[i % 6]);
    context.lineWidth = 2;
    if (style === 'bars') {
      const count = this.content.series.length, wide = (px(1) - px(0)) * 0.8 / count;
      offset = (i - (count - 1) / 2) * wide;
      x.forEach((value, n) => {
        if (!canDraw(y[n])) return;
        const at = px(value) + offset, base = py(log ? this.axis[1].from : 0);
        context.fillRect(at - wide * 0.45, Math.min(base, py(y[n])), wide * 0.9, Math.abs(base - py(y[n])));
      });
    } else if (style !== 'points') {
      context.setLineDash(dashes[i % 6]);
      context.beginPath();
      let going = false;
      x.forEach((value, n) => {
        if (!canDraw(y[n])) { going = false; return; }
        if (going) context.lineTo(px(value), py(y[n])); else context.moveTo(px(value), py(y[n]));
        going = true;
      });
      context.stroke();
      context.setLineDash([]);
    }
    if (style === 'points' || style === 'lines_and_points' && x.length < 80) {
      context.lineWidth = 1.5;
      x.forEach((value, n) => { if (canDraw(y[n])) mark(context, shape, px(value), py(y[n]), x.length > 300 ? 2 : 3); });
    }
    if (!low?.length) return;
    context.lineWidth = 1;
    context.strokeStyle = colour(style === 'bars' ? 'ink' : seriesColours[i % 6]);
    x.forEach((value, n) => { if (canDraw(low[n]) && canDraw(high[n])) line(context, px(value) + offset, py(low[n]), px(value) + offset, py(high[n])); });
  }
  // The values next to the pointer.
  tell(x, y) {
    if (!this.px) return;
    const { left, right, top, bottom } = this.area;
    if (this.content.image) {
      const [across, up] = this.axis, share = (from, to, s) => from + (to - from) * s;
      const inside = x >= left && x <= right && y >= top && y <= bottom;
      this.readout.textContent = inside ? `${text(share(across.from, across.to, (x - left) / (right - left)))}; ` +
        text(share(up.from, up.to, (bottom - y) / (bottom - top))) : '';
      return;
    }
    const all = this.content.series[0]?.x ?? [];
    let best = Infinity;
    all.forEach((value, i) => {
      const apart = Math.abs(this.px(value) - x);
      if (apart < best) { best = apart; this.at = i; }
    });
    this.read();
  }
  read() {
    const { series, names } = this.content, at = series[0].x[this.at];
    if (at === undefined) return;
    const values = series.map(({ label, x, y }) => [label, y[x.indexOf(at)]]).filter(([, value]) => value !== undefined);
    this.readout.textContent = `${names?.[at] ?? text(at, 4)}: ${values.map(([label, value]) => `${label} ${text(value)}`.trim()).join(', ')}`;
  }
}
customElements.define('pn-chart', Chart);
