import { Drawing, niceStep } from 'panonav/draw';
import { whenNear } from 'panonav/sight';

// In the order of series. Shapes and dashes differ, too, for colour-blind viewers.
export const seriesColours = ['blue', 'vermilion', 'green', 'purple', 'orange', 'sky'];
export const text = (value, digits = 3) => {
  if (value === null || value === undefined || !Number.isFinite(value)) return 'none';
  if (value !== 0 && (Math.abs(value) < 1e-3 || Math.abs(value) >= 1e6)) return value.toExponential(digits - 1);
  return String(Number(value.toPrecision(Math.max(digits, Math.ceil(Math.log10(Math.abs(value) + 1))))));
};

// Draws data that never change, which a script element within holds as JSON. Below it, `key` explains colours; `readout`
// shows the values under the pointer.
export class Plot extends Drawing {
  connectedCallback() {
    if (this.tabIndex === 0) return;
    this.tabIndex = 0;
    this.setAttribute('role', 'img');
    whenNear(this, () => {
      const script = this.querySelector('script');
      this.content = JSON.parse(script.textContent);
      script.remove();
      this.setAttribute('aria-label', this.content.title ?? '');
      this.key = document.createElement('div');
      this.key.className = 'key';
      this.after(this.key);
      this.insertAdjacentHTML('beforeend', '<div class="readout" aria-live="polite"></div>');
      this.readout = this.querySelector('.readout');
      this.attach();
      this.redraw();
    });
  }
  attached() {}
  // [[name, colour, kind], ...]; kind: dot, ring, line, dashes, cross, area.
  explain(keys) {
    const html = keys.map(() => '<span></span>').join('');
    const json = JSON.stringify(keys);
    if (this.explained === json) return;
    this.explained = json;
    this.key.innerHTML = html;
    keys.forEach(([name, colour, kind], i) => {
      const entry = this.key.children[i];
      entry.textContent = name;
      entry.className = kind;
      entry.style.setProperty('--key', `var(--${colour})`);
    });
  }

  // Axes of a chart in `this.area`; gives how values become pixels.
  axes(context, width, height, colour, [x, y]) {
    const left = 56, right = 14, top = 26, bottom = 38;
    this.area = { left, top, right: width - right, bottom: height - bottom };
    const scale = ({ from, to, log }, low, high) => {
      const value = log ? Math.log10 : v => v, a = value(from), b = value(to);
      return v => low + (value(v) - a) / (b - a || 1) * (high - low);
    };
    const px = scale(x, this.area.left, this.area.right), py = scale(y, this.area.bottom, this.area.top);
    context.font = '12px system-ui';
    context.lineWidth = 1;
    const space = (this.area.right - left) / 70;
    for (const tick of x.names ? x.names.map((_, i) => i) : ticks(x, space)) {
      const at = px(tick);
      context.strokeStyle = colour('line');
      if (!x.names) line(context, at, this.area.top, at, this.area.bottom);
      context.fillStyle = colour('soft');
      context.textAlign = 'center';
      context.fillText(x.names ? x.names[tick] : text(tick), at, this.area.bottom + 16, x.names ? (this.area.right - left) / x.names.length : undefined);
    }
    for (const tick of ticks(y, (this.area.bottom - top) / 34)) {
      const at = py(tick);
      context.strokeStyle = colour('line');
      line(context, left, at, this.area.right, at);
      context.fillStyle = colour('soft');
      context.textAlign = 'right';
      context.fillText(text(tick), left - 6, at + 4);
    }
    context.fillStyle = colour('ink');
    context.textAlign = 'left';
    context.fillText(y.label, 4, 14, width - 8);
    context.textAlign = 'right';
    context.fillText(x.label, this.area.right, height - 6, width - 8);
    context.textAlign = 'left';
    return { px, py };
  }
}

export function line(context, ...coordinates) {
  context.beginPath();
  for (let i = 0; i < coordinates.length; i += 2) context.lineTo(coordinates[i], coordinates[i + 1]);
  context.stroke();
}

export function ticks({ from, to, log, step }, count) {
  const low = Math.min(from, to), high = Math.max(from, to), found = [];
  if (log) {
    const decades = Math.log10(high / low), factors = decades > 2.5 ? [1] : decades > 1 ? [1, 3] : [1, 2, 5];
    for (let power = 10 ** Math.floor(Math.log10(low)); power <= high; power *= 10) {
      for (const factor of factors) {
        const tick = power * factor;
        if (tick >= low * 0.999 && tick <= high * 1.001) found.push(tick);
      }
    }
    return found;
  }
  const apart = step && (high - low) / step <= count ? step : niceStep(high - low, Math.max(1.5, count));
  for (let i = Math.ceil(low / apart - 1e-6); i * apart <= high + 1e-6 * apart; ++i) found.push(i * apart);
  return found;
}

// A mark of a series or a layer.
export function mark(context, kind, x, y, size) {
  context.beginPath();
  if (kind === 'cross') {
    context.moveTo(x - size, y - size); context.lineTo(x + size, y + size);
    context.moveTo(x - size, y + size); context.lineTo(x + size, y - size);
    context.stroke();
  } else if (kind === 'square') {
    context.fillRect(x - size, y - size, 2 * size, 2 * size);
  } else if (kind === 'triangle') {
    context.moveTo(x, y - size); context.lineTo(x + size, y + size); context.lineTo(x - size, y + size);
    context.fill();
  } else {
    context.arc(x, y, size, 0, 2 * Math.PI);
    if (kind === 'ring') context.stroke(); else context.fill();
  }
}
