import { Chart } from 'panonav/chart';

// Shows the route panorama of a run: the matched line, the true position, and the directions in which the scene has
// changed. `content`: as a chart with a picture, and `marks`: [along, true along, [azimuth from, to, ...]] of
// each moment, null where unknown.
class RoutePanel extends Chart {
  connectedCallback() {}
  attach(run) {
    this.content = run.content.route;
    this.setAttribute('role', 'img');
    this.setAttribute('aria-label', this.content.title);
    this.insertAdjacentHTML('beforeend', '<div class="legend"></div><div class="readout"></div>');
    this.key = this.querySelector('.legend');
    this.readout = this.querySelector('.readout');
    super.attach(run);
    run.addEventListener('moment', () => this.redraw());
  }
  over(context, colour) {
    const { left, right } = this.area, { marks } = this.content, keys = [];
    const across = (way, name, dashes) => {
      context.strokeStyle = colour(name);
      context.lineWidth = 2.5;
      context.setLineDash(dashes);
      context.beginPath();
      context.moveTo(left, this.py(way)); context.lineTo(right, this.py(way));
      context.stroke();
      context.setLineDash([]);
    };
    context.fillStyle = colour('orange');
    const shown = marks.slice(0, this.run.index + 1);
    for (const [along, , changed] of shown) {
      if (along === null) continue;
      // Left is positive: a range across the rear has two parts.
      for (let i = 0; i < changed.length; i += 2) {
        const [from, to] = [changed[i], changed[i + 1]];
        for (const [a, b] of to >= from ? [[from, to]] : [[from, 180], [-180, to]]) {
          context.fillRect(this.px(b), this.py(along) - 2, Math.max(2, this.px(a) - this.px(b)), 4);
        }
      }
    }
    if (shown.some(([, , changed]) => changed.length)) keys.push(['scene has changed', 'orange', 'area']);
    const [along, truth] = marks[this.run.index] ?? [null, null];
    if (truth !== null && truth !== undefined) {
      across(truth, 'yellow', [7, 5]);
      keys.push(['true position', 'yellow', 'dashes']);
    }
    if (along !== null) {
      across(along, 'vermilion', []);
      keys.push(['matched line', 'vermilion', 'line']);
    }
    this.readout.textContent = along === null ? 'not on this route'
      : `at ${along.toFixed(2)} ${this.run.unit}` + (truth === null ? '' : `, ${(100 * Math.abs(along - truth)).toFixed(1)} cm error`);
    this.explain(keys);
  }
  draw(...content) {
    const { explain } = this;
    this.explain = keys => { if (keys.length) explain.call(this, keys); };
    super.draw(...content);
  }
}
customElements.define('pn-route', RoutePanel);
