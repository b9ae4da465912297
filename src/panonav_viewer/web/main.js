import { Run, follow, stateClass } from 'panonav/store';
import { inSight, moves, watch } from 'panonav/sight';
import 'panonav/map';
import 'panonav/pictures';
import 'panonav/facts';
import 'panonav/timeline';
import 'panonav/route';
import 'panonav/chart';
import 'panonav/plan';

const skeleton = `
<div class="head controls"><output class="state" role="status" aria-live="polite">waiting for the first image</output>
<span class="clock"></span><nav class="panels" aria-label="Panels"></nav></div>
<div class="shown"></div>
<div class="foot controls"><button class="play" type="button" aria-keyshortcuts="Space">Pause</button>
<button class="back" type="button" aria-label="Previous image" aria-keyshortcuts="ArrowLeft">&#9664;</button>
<button class="forth" type="button" aria-label="Next image" aria-keyshortcuts="ArrowRight">&#9654;</button>
<input class="slider" type="range" min="0" max="0" value="0" aria-label="Image of the run">
<label>Speed <select class="speed"><option>0.5</option><option selected>1</option><option>2</option><option>5</option><option>20</option></select></label>
<span class="hint">Space: pause. Arrows: one image. Home, End: first, last. Digits: panels. Plus, minus, 0: zoom of the map; on it, arrows and Enter: views.</span></div>`;
const panels = { map: 'Map', pictures: 'Images', facts: 'Facts', route: 'Route', timeline: 'Timeline' };

const hasPlaces = ({ references, plan, edges }, moments) =>
  Boolean(references || plan || edges || moments.some(({ pose, truth, particles }) => pose || truth || particles));

// Returns the names of the panels that have something to show.
function choosePanels({ live, moments = [], retained = {}, route }) {
  if (live) return ['map', 'pictures', 'facts', 'timeline'];
  const has = {
    map: hasPlaces(retained, moments),
    pictures: moments.some(({ data }) => data && Object.keys(data).length),
    facts: true,
    route,
    timeline: moments.length > 1 && moments.some(({ state, probability }) => state || probability !== undefined),
  };
  return Object.keys(panels).filter(name => has[name]);
}

// Shows a run with its panels and controls. A script element within holds { live: address of events, replay: true if the
// run can be controlled } or, for a run that is over, { moments, retained, route }.
class RunPlayer extends HTMLElement {
  connectedCallback() {
    if (this.run) return;
    const script = this.querySelector('script'), content = JSON.parse(script.textContent), run = this.run = new Run();
    script.remove();
    this.content = run.content = content;
    this.live = Boolean(content.live);
    run.takes = content.takes;
    run.views = this.live ? 'view/' : undefined;  // address of pictures of references
    const title = this.getAttribute('data-title');
    this.insertAdjacentHTML('beforeend', skeleton);
    if (title) this.querySelector('.head').prepend(Object.assign(document.createElement('h1'), { textContent: title }));
    const address = this.live ? (moment, which) => `picture/${moment.n}/${which}` : (moment, which) => moment.data?.[which];
    choosePanels(content).forEach((name, i) => this.addPanel(name, i, address));
    // Ids by which links and scripts find the first run of a page.
    if (document.querySelector('pn-run') === this) {
      for (const name of ['state', 'clock', 'panels', 'play', 'slider', 'speed']) this.find(name).id = name;
    }
    this.find('play').addEventListener('click', () => { this.held = this.playing; this.play(!this.playing); });
    this.find('back').addEventListener('click', () => this.step(-1));
    this.find('forth').addEventListener('click', () => this.step(1));
    this.find('slider').addEventListener('input', () => { this.hold(); run.show(Number(this.find('slider').value)); });
    this.find('speed').closest('label').hidden = this.live && !content.replay;
    this.find('speed').addEventListener('change', () => this.control({ speed: this.speed }));
    for (const event of ['moment', 'grown']) run.addEventListener(event, () => this.tell());
    run.addEventListener('selected', () => this.hold());
    if (!this.classList.contains('whole')) {  // the page scrolls when the pointer is above the map
      this.addEventListener('wheel', event => { if (!event.ctrlKey) event.stopPropagation(); }, { capture: true });
    }
    if (this.live) {
      this.playing = this.connected = true;
      for (const event of ['grown', 'retained']) run.addEventListener(event, () => this.showMapIfKnown());
      this.showMapIfKnown();
      follow(run, content.live, now => { this.connected = now; this.tell(); });
    } else {
      run.over = true;
      run.moments = content.moments;
      let changes = {};
      for (const moment of run.moments) moment.changes = changes = moment.changes ? { ...changes, ...moment.changes } : changes;
      run.addEventListener('moment', () => Object.assign(run.retained, run.moment.changes));
      run.counted = run.moments.every(({ t }, i) => t === i);  // images without stamps are numbered
      run.retain(content.retained);
      run.dispatch('grown');
      run.show(content.unordered ? 0 : run.last);  // until it plays, it shows what it leads to
      this.play(false);
      if (run.last > 0) watch(this);
      else this.find('foot').hidden = true;
    }
  }
  find(name) { return this.querySelector(`.${name}`); }
  get speed() { return Number(this.find('speed').value); }
  addPanel(name, i, address) {
    const panel = document.createElement(`pn-${name}`), button = document.createElement('button'), shown = this.find('shown');
    shown.append(panel);
    shown.classList.add(`has-${name}`);
    panel.attach(this.run, address);
    button.type = 'button';
    button.textContent = panels[name];
    button.setAttribute('aria-pressed', 'true');
    button.setAttribute('aria-keyshortcuts', String(i + 1));
    button.addEventListener('click', () => {
      panel.hidden = !panel.hidden;
      button.setAttribute('aria-pressed', String(!panel.hidden));
      shown.classList.toggle(`has-${name}`, !panel.hidden);
      this.run.dispatch('moment');
    });
    this.find('panels').append(button);
  }

  // Shows the map of a live run when the first position is known: a memory may have none.
  showMapIfKnown() {
    const panel = this.querySelector('pn-map'), isKnown = hasPlaces(this.run.retained, this.run.moments), button = this.find('panels').firstChild;
    if (button.hidden === !isKnown) return;
    panel.hidden = button.hidden = !isKnown;
    this.find('shown').classList.toggle('has-map', isKnown);
    panel.redraw();
  }

  setVisible(visible) {
    if (visible && !this.held && moves() && !this.ended) this.play(true);
    else if (!visible) this.play(false);
  }
  hold() {
    if (this.live && this.held) return;
    this.held = true;
    this.play(false);
  }
  play(isPlaying) {
    const { run } = this;
    this.playing = isPlaying;
    this.find('play').textContent = isPlaying ? 'Pause' : 'Play';
    clearTimeout(this.timer);
    if (this.live) {
      this.held = !isPlaying;
      run.following = isPlaying;
      this.control({ play: isPlaying });
      if (isPlaying) run.show(run.last);
      this.tell();
    } else if (isPlaying) {
      if (run.index >= run.last) run.show(0);
      this.advance();
    }
  }
  advance() {
    const { run } = this;
    if (run.index >= run.last) { this.ended = true; this.play(false); return; }
    const wait = (run.moments[run.index + 1].t - run.moment.t) / this.speed;
    this.timer = setTimeout(() => { run.show(run.index + 1); this.advance(); }, 1000 * Math.max(1 / 60, Math.min(2, wait)));
  }
  control(command) {
    if (this.content.replay && !this.run.ended) fetch('control', { method: 'POST', body: JSON.stringify(command) }).catch(() => {});
  }
  step(by) {
    const { run } = this;
    this.hold();
    if (by === 1 && run.index === run.last) {  // past the newest moment
      run.following = true;
      this.control({ step: 1 });
    }
    run.show(run.index + by);
  }
  act(key, target) {
    const { run } = this, map = this.querySelector('pn-map');
    return {
      ArrowLeft: () => this.step(-1), ArrowRight: () => this.step(1), Home: () => this.step(-run.moments.length), End: () => this.step(run.moments.length),
      '+': map && (() => map.zoomBy(1.3)), '-': map && (() => map.zoomBy(1 / 1.3)), '0': map && (() => map.reset()),
      ' ': target.matches('button, summary') ? undefined : () => this.find('play').click(),
    }[key] ?? (/^[1-9]$/.test(key) ? () => this.find('panels').children[key - 1]?.matches(':not([hidden])') && this.find('panels').children[key - 1].click() : undefined);
  }
  tell() {
    const { run, content } = this, { moment } = run, state = this.find('state'), slider = this.find('slider');
    slider.max = Math.max(0, run.last);
    slider.value = Math.max(0, run.index);
    if (!moment) return;
    state.classList.remove('good', 'doubt', 'bad');
    state.classList.add(stateClass(moment));
    state.hidden = !this.live && !moment.state;
    const text = (moment.state || 'no state') + (moment.probability === undefined ? ''
      : `, ${moment.state === 'unknown place' ? 'known with ' : ''}${(100 * moment.probability).toFixed(0)} %`);
    if (state.textContent !== text) state.textContent = text;
    this.find('clock').textContent = (run.counted ? '' : `${(moment.t - run.moments[0].t).toFixed(1)} s, `) +
      (!this.live ? `image ${run.index + 1} of ${run.moments.length}` : run.ended ? 'the run has ended'
        : !this.connected ? 'connection lost, reconnecting' : !this.playing ? 'paused' : content.replay ? 'replay' : 'live');
  }
}
customElements.define('pn-run', RunPlayer);

// Sends keys to the run in the visible part.
document.addEventListener('keydown', event => {
  if (event.ctrlKey || event.altKey || event.metaKey || event.target.matches('select, input') || event.shiftKey && event.key !== '+') return;
  const seen = inSight(), player = seen?.localName === 'pn-run' ? seen : document.querySelector('pn-run.whole');
  const act = player?.act(event.key, event.target);
  if (!act) return;
  event.preventDefault();
  act();
});
