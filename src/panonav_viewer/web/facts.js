import { degrees } from 'panonav/draw';
import { isTruth } from 'panonav/store';

// Values have the names of the recording, as inside or along_m. People read what they are, with their unit.
const meanings = {
  along: 'distance along the route', best_match: 'most similar view', changed: 'sectors in which the scene has changed', closures: 'loop closures',
  correction: 'correction of the odometry', correlation: 'correlation with the stored line', delay: 'delay of the answer', dropped: 'images without an answer',
  inside: 'probability that the robot is in the mapped area', known_probability: 'probability that the place is known',
  lateral: 'offset from the route, left positive', modes: 'possible positions', nearest: 'nearest view', origin: 'position was', particles: 'particles',
};
const units = { ms: ' ms', s: ' s', rad: ' rad', deg: '°' };
// entered_area: entered area
const toPlainWords = text => text.replace(/\b[a-z]+(?:_[a-z]+)+\b/g, name => name.replaceAll('_', ' '));
function toReadable(name, value, length) {
  const [, stem, unit] = name.match(/^(.+)_(m|ms|s|rad|deg)$/) ?? [undefined, name, undefined];
  return [meanings[stem] ?? stem.replaceAll('_', ' '), unit ? value + (unit === 'm' ? ` ${length}` : units[unit]) : name === 'event' ? toPlainWords(value) : value];
}

// Lists the figures of the moment as text, also for screen readers; below them the time of each stage, and the events so
// far: changes of state and decisions, each a button that seeks its moment.
class Facts extends HTMLElement {
  attach(run) {
    this.run = run;
    this.innerHTML = '<table><caption class="unseen">The moment in figures</caption><tbody></tbody></table>' +
      '<div hidden><h2>Milliseconds per stage</h2><table class="stages"><caption class="unseen">Milliseconds per stage</caption>' +
      '<thead class="unseen"><tr><th>stage</th><th>share</th><th>now</th><th>median</th></tr></thead><tbody></tbody></table></div>' +
      '<h2>Events</h2><ol></ol>';
    run.addEventListener('moment', () => this.show());
    run.addEventListener('grown', () => this.list());
  }
  list() {
    const { moments } = this.run, happened = [];
    moments.forEach((moment, i) => {
      const { event } = moment.values ?? {}, changed = moment.state && moment.state !== moments[i - 1]?.state;
      if (event || changed) happened.push([i, moment.t, [changed && moment.state, event && toPlainWords(event)].filter(Boolean).join(': ')]);
    });
    const newest = happened.slice(-50).reverse(), json = JSON.stringify(newest.map(([, ...rest]) => rest));
    if (json === this.json) return;
    this.json = json;
    this.querySelector('ol').replaceChildren(...newest.map(([number, t, text]) => {
      const item = document.createElement('li'), button = document.createElement('button');
      button.type = 'button';
      button.textContent = this.run.counted ? `image ${number + 1}: ${text}` : `${(t - moments[0].t).toFixed(1)} s  ${text}`;
      button.addEventListener('click', () => this.run.seek(t));
      item.append(button);
      return item;
    }));
  }
  show() {
    const moment = this.run.moment;
    if (!moment || this.hidden) return;
    const rows = [];
    const length = this.run.unit, pose = ([x, y, heading]) => `${x.toFixed(2)} ${length}, ${y.toFixed(2)} ${length}` +
      (heading === null ? '' : `, ${degrees(heading).toFixed(1)}°`);
    const estimated = moment.pose && !isTruth(moment);
    if (estimated) rows.push(['estimate', pose(moment.pose)]);
    if (moment.truth) rows.push(['ground truth', pose(moment.truth)]);
    if (estimated && moment.truth) {
      rows.push(['error', `${Math.hypot(moment.pose[0] - moment.truth[0], moment.pose[1] - moment.truth[1]).toFixed(3)} ${length}`]);
    }
    if (moment.odometry) rows.push(['odometry', pose(moment.odometry)]);
    if (moment.tilt) rows.push(['roll, pitch', moment.tilt.map(value => `${degrees(value).toFixed(1)}°`).join(', ')]);
    for (const [name, value] of Object.entries(moment.values ?? {})) rows.push(toReadable(name, value, length));
    this.showStages(moment);
    const body = this.querySelector('tbody');
    body.replaceChildren(...rows.map(([name, value]) => {
      const row = document.createElement('tr'), head = document.createElement('th'), cell = document.createElement('td');
      head.scope = 'row';
      head.textContent = name;
      cell.textContent = value;
      row.append(head, cell);
      return row;
    }));
  }
  // Shows the stages of the moment and their medians over the last 50 moments.
  showStages({ stages }) {
    const table = this.querySelector('.stages');
    table.parentElement.hidden = !stages;
    if (!stages) return;
    const last = this.run.moments.slice(Math.max(0, this.run.index - 49), this.run.index + 1);
    const rows = Object.entries(stages).map(([name, ms]) => {
      const all = last.map(moment => moment.stages?.[name]).filter(value => value !== undefined).sort((a, b) => a - b);
      return [name, ms, all[Math.floor(all.length / 2)]];
    });
    const longest = Math.max(...rows.map(([, , median]) => median), 1e-6);
    table.tBodies[0].replaceChildren(...rows.map(([name, ms, median]) => {
      const row = document.createElement('tr');
      row.innerHTML = '<th scope="row"></th><td class="bar" aria-hidden="true"><i></i></td><td></td><td></td>';
      row.cells[0].textContent = name;
      row.querySelector('i').style.width = `${100 * median / longest}%`;
      row.cells[2].textContent = ms.toFixed(2);
      row.cells[3].textContent = `median ${median.toFixed(2)}`;
      return row;
    }));
  }
}
customElements.define('pn-facts', Facts);
