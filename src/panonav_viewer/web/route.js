import { Chart } from 'panonav/chart';

// The route panorama of a run: which line the robot is at, where it truly was, and in which directions the scene is
// not as remembered. `given`: as a chart with a picture, and `marks`: [along, true along, [azimuth from, to, ...]] of
// each moment, null for what is not known.
class RoutePanel extends Chart {
  connectedCallback() {}
  attach(run) {
    this.given = run.given.route;
    this.setAttribute('role', 'img');
    this.setAttribute('aria-label', this.given.title);
    this.insertAdjacentHTML('beforeend', '<div class="legend"></div><div class="said"></div>');
    this.key = this.querySelector('.legend');
    this.said = this.querySelector('.said');
    super.attach(run);
    run.addEventListener('moment', () => this.redraw());
  }
  over(context, colour) {
    const { left, right } = this.area, { marks } = this.given, keys = [];
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
      // Left is positive: a range that passes straight behind has two parts.
      for (let i = 0; i < changed.length; i += 2) {
        const [from, to] = [changed[i], changed[i + 1]];
        for (const [a, b] of to >= from ? [[from, to]] : [[from, 180], [-180, to]]) {
          context.fillRect(this.px(b), this.py(along) - 2, Math.max(2, this.px(a) - this.px(b)), 4);
        }
      }
    }
    if (shown.some(([, , changed]) => changed.length)) keys.push(['not as remembered', 'orange', 'area']);
    const [along, truth] = marks[this.run.index] ?? [null, null];
    if (truth !== null && truth !== undefined) {
      across(truth, 'yellow', [7, 5]);
      keys.push(['true place', 'yellow', 'dashes']);
    }
    if (along !== null) {
      across(along, 'vermilion', []);
      keys.push(['matched line', 'vermilion', 'line']);
    }
    this.said.textContent = along === null ? 'not on this route'
      : `at ${along.toFixed(2)} m` + (truth === null ? '' : `, ${(100 * Math.abs(along - truth)).toFixed(1)} cm off`);
    this.explain(keys);
  }
  draw(...given) {
    const { explain } = this;
    this.explain = keys => { if (keys.length) explain.call(this, keys); };
    super.draw(...given);
  }
}
customElements.define('pn-route', RoutePanel);
