// Holds the run. Panels read it and listen to its events:
//   'moment'   another moment is shown
//   'retained'  references, edges, plan, directions or goal are new
//   'grown'    moments were added
//   'selected'   a moment was selected: the run is paused
const maxMoments = 5000;  // of a live run, without their pictures

export class Run extends EventTarget {
  constructor() {
    super();
    this.moments = [];
    this.retained = {};
    this.index = -1;
    this.following = true;  // the newest moment is shown
    this.ended = false;
  }

  get moment() { return this.moments[this.index]; }
  get last() { return this.moments.length - 1; }
  // Unit of lengths: view steps if a map of images has no known length.
  get unit() { return this.retained.unit ?? 'm'; }
  dispatch(name) { this.dispatchEvent(new Event(name)); }

  // Adds the moments before the viewer connected: [[t, x, y, heading, probability, sure, state, true x, true y], ...].
  takePast(past) {
    this.moments = past.map(([t, x, y, heading, probability, sure, state, trueX, trueY]) =>
      ({ t, pose: x === null ? undefined : [x, y, heading], truth: trueX === null ? undefined : [trueX, trueY, null], probability: probability ?? undefined, sure, state, past: true }));
    this.index = this.last;
    this.dispatch('grown');
    if (this.moment) this.dispatch('moment');
  }
  add(moment) {
    const newest = this.moments[this.last];
    if (newest?.past && newest.t === moment.t) this.moments.pop();
    this.moments.push(moment);
    if (this.moments.length > maxMoments) {
      const gone = this.moments.length - maxMoments;
      this.moments.splice(0, gone);
      this.index -= gone;
    }
    this.dispatch('grown');
    if (this.following || this.index < 0) this.show(this.last);
  }
  retain(retained) {
    Object.assign(this.retained, retained);
    this.dispatch('retained');
  }
  show(index) {
    this.index = Math.max(0, Math.min(this.last, index));
    this.dispatch('moment');
  }
  // Shows the moment at a time.
  seek(t) {
    let low = 0, high = this.last;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.moments[middle].t < t) low = middle + 1; else high = middle;
    }
    this.dispatch('selected');
    this.show(low);
  }
}

// Receives server-sent events; the browser reconnects by itself, and the server then sends everything again.
export function follow(run, address, connected) {
  const events = new EventSource(address);
  events.addEventListener('open', () => connected(true));
  events.addEventListener('error', () => { if (!run.ended) connected(false); });
  events.addEventListener('past', event => run.takePast(JSON.parse(event.data)));
  events.addEventListener('retained', event => run.retain(JSON.parse(event.data)));
  events.addEventListener('moment', event => run.add(JSON.parse(event.data)));
  events.addEventListener('ended', () => { run.ended = true; events.close(); run.dispatch('moment'); });
}

// True if the pose is the true one, as of a simulated robot that estimates none.
export function isTruth({ pose, truth }) {
  return Boolean(pose && truth && pose.every((value, i) => value === truth[i]));
}

// Returns the points of `name` for a line that is interrupted where a robot was carried: where it was faster than three
// times the 90th percentile.
export function steady(moments, name) {
  const speeds = moments.map((moment, i) => {
    const before = moments[i - 1], [from, to] = [before?.[name], moment[name]];
    return from && to ? Math.hypot(to[0] - from[0], to[1] - from[1]) / Math.max(1e-3, moment.t - before.t) : 0;
  });
  const moving = speeds.filter(speed => speed > 0).sort((a, b) => a - b);
  const limit = 3 * moving[Math.floor(0.9 * (moving.length - 1))];
  return moments.flatMap((moment, i) => speeds[i] > limit ? [undefined, moment[name]] : [moment[name]]);
}

export function stateClass(moment) {
  if (moment.sure) return 'good';
  return ['ambiguous', 'position known, heading not'].includes(moment.state) || moment.state === 'between places' ? 'doubt' : 'bad';
}
