// A canvas that keeps the size of its element, sharp on every screen, and is drawn at most once a frame.
export class Drawing extends HTMLElement {
  attach(run) {
    this.run = run;
    this.canvas = document.createElement('canvas');
    this.prepend(this.canvas);
    new ResizeObserver(() => this.redraw()).observe(this.canvas);
    matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => this.redraw());
    drawings.add(this);
    this.attached();
  }
  redraw() {
    if (this.waiting || this.hidden) return;
    this.waiting = true;
    requestAnimationFrame(() => {
      this.waiting = false;
      this.drawNow();
    });
  }
  drawNow() {
    const ratio = devicePixelRatio || 1, { clientWidth: width, clientHeight: height } = this.canvas;
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
  }
}
const drawings = new Set();

// Paper is white: draws everything in light colours, and at once, because no animation frame comes while a page is printed.
function drawForPaper(isPrinting) {
  document.documentElement.classList.toggle('printing', isPrinting);
  drawings.forEach(drawing => drawing.drawNow());
}
addEventListener('beforeprint', () => drawForPaper(true));
addEventListener('afterprint', () => drawForPaper(false));
matchMedia('print').addEventListener('change', event => drawForPaper(event.matches));

export const degrees = radians => radians * 180 / Math.PI;

// Draws a bar of a round number of metres above left; a text that is wider than the bar stands beside it. `scale`: pixels
// per metre.
export function scaleBar(context, scale, width, unit, colour) {
  const length = niceStep(width / scale, 6), px = length * scale;
  context.font = '12px system-ui';
  const text = `${Number(length.toPrecision(3))} ${unit}`, wide = context.measureText(text).width, fits = wide < px - 12;
  context.fillStyle = colour('ground');  // nothing of the map is seen through it
  context.fillRect(4, 0, fits ? px + 12 : px + wide + 18, 24);
  context.strokeStyle = context.fillStyle = colour('soft');
  context.lineWidth = 2;
  context.beginPath();
  context.moveTo(10, 12); context.lineTo(10, 18); context.lineTo(10 + px, 18); context.lineTo(10 + px, 12);
  context.stroke();
  context.textAlign = 'left';
  context.fillText(text, fits ? 16 : 16 + px, fits ? 13 : 19, Math.max(40, width - px - 24));
}

// 0.2, 0.5, 1, 2, 5, ...: about `count` steps in a range.
export function niceStep(range, count) {
  const raw = Math.max(range, 1e-9) / count, power = 10 ** Math.floor(Math.log10(raw));
  return power * [1, 2, 5, 10].find(step => step * power >= raw);
}
