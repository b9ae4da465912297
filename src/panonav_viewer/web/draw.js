// A canvas that keeps the size of its element, sharp on every screen, and is drawn at most once a frame.
export class Drawing extends HTMLElement {
  attach(run) {
    this.run = run;
    this.canvas = document.createElement('canvas');
    this.prepend(this.canvas);
    new ResizeObserver(() => this.redraw()).observe(this);
    matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => this.redraw());
    this.attached();
  }
  redraw() {
    if (this.waiting || this.hidden) return;
    this.waiting = true;
    requestAnimationFrame(() => {
      this.waiting = false;
      const ratio = devicePixelRatio || 1, width = this.clientWidth, height = this.clientHeight;
      if (width < 1 || height < 1) return;
      if (this.canvas.width !== Math.round(width * ratio) || this.canvas.height !== Math.round(height * ratio)) {
        this.canvas.width = Math.round(width * ratio);
        this.canvas.height = Math.round(height * ratio);
      }
      const context = this.canvas.getContext('2d');
      context.setTransform(ratio, 0, 0, ratio, 0, 0);
      context.clearRect(0, 0, width, height);
      const style = getComputedStyle(this);
      this.draw(context, width, height, name => style.getPropertyValue('--' + name).trim());
    });
  }
}

export const degrees = radians => radians * 180 / Math.PI;

// Draws a bar of a round number of metres above left. `scale`: pixels per metre.
export function scaleBar(context, scale, width, unit, colour) {
  const length = niceStep(width / scale, 6), px = length * scale;
  context.strokeStyle = context.fillStyle = colour('soft');
  context.lineWidth = 2;
  context.beginPath();
  context.moveTo(10, 12); context.lineTo(10, 18); context.lineTo(10 + px, 18); context.lineTo(10 + px, 12);
  context.stroke();
  context.font = '12px system-ui';
  context.fillText(`${Number(length.toPrecision(3))} ${unit}`, 16, 13);
}

// 0.2, 0.5, 1, 2, 5, ...: about `count` steps in a range.
export function niceStep(range, count) {
  const raw = Math.max(range, 1e-9) / count, power = 10 ** Math.floor(Math.log10(raw));
  return power * [1, 2, 5, 10].find(step => step * power >= raw);
}
