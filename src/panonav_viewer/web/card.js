import { degrees } from 'panonav/draw';

// Shows the remembered view that is nearest to a place on the map, with picture, pose and neighbours, and sends a goal or
// the robot's pose to the run.
class Card extends HTMLElement {
  attach(run, choose) {
    this.run = run;
    this.choose = choose;  // another reference
    this.innerHTML = `
<button type="button" class="close" aria-label="Close">&times;</button>
<div aria-live="polite"><h2></h2><p class="where"></p><img alt=""></div>
<p class="near"></p>
<form><label>Heading <input type="number" min="-360" max="360" step="any" placeholder="any"> degrees</label>
<button type="submit"></button> <output></output></form>`;
    this.hidden = true;
    this.querySelector('.close').addEventListener('click', () => this.choose(undefined));
    this.querySelector('img').addEventListener('error', event => { event.target.hidden = true; });
    this.addEventListener('keydown', event => {
      event.stopPropagation();  // arrows and digits are for the form
      if (event.key === 'Escape') this.choose(undefined);
    });
    this.querySelector('form').addEventListener('submit', event => {
      event.preventDefault();
      this.tell();
    });
  }

  // `at`: the clicked position; otherwise that of the view.
  show(reference, at) {
    this.hidden = reference === undefined;
    if (this.hidden) return;
    const { references, names, headings } = this.run.retained, place = [references[2 * reference], references[2 * reference + 1]];
    const heading = headings?.[reference], away = at ? Math.hypot(at[0] - place[0], at[1] - place[1]) : 0;
    const { unit } = this.run, describe = ([x, y]) => `x ${x.toFixed(2)} ${unit}, y ${y.toFixed(2)} ${unit}`;
    this.at = at ?? place;
    this.querySelector('h2').textContent = (at ? `Nearest view, ${away.toFixed(2)} ${unit} away: ` : '') +
      (names?.[reference] ?? `stored view ${reference}`);
    this.querySelector('.where').textContent = describe(place) +
      (typeof heading === 'number' ? `, heading ${degrees(heading).toFixed(0)}°` : '');
    const image = this.querySelector('img');
    image.hidden = !this.run.views;
    if (this.run.views) {
      image.src = this.run.views + reference;
      image.alt = `Image of ${names?.[reference] ?? 'the view'}`;
    }
    this.showNeighbours(reference);
    const form = this.querySelector('form'), { takes } = this.run;
    form.hidden = !takes || this.run.ended;
    form.querySelector('label').hidden = takes !== 'pose';
    form.querySelector('input').value = typeof heading === 'number' ? degrees(heading).toFixed(0) : '';
    form.querySelector('button').textContent = takes === 'pose' ? 'The robot is here' : 'Send the robot to this view';
    form.querySelector('output').textContent = '';
    this.place = place;
  }
  // Lists the views connected by edges; where there are none the four nearest views.
  showNeighbours(reference) {
    const { references, edges = [], names } = this.run.retained, [x, y] = [references[2 * reference], references[2 * reference + 1]];
    const number = new Map();
    for (let i = 0; i < references.length; i += 2) number.set(`${references[i]} ${references[i + 1]}`, i / 2);
    let near = new Set();
    for (let i = 0; i < edges.length; i += 5) {
      const [a, b] = [`${edges[i]} ${edges[i + 1]}`, `${edges[i + 2]} ${edges[i + 3]}`];
      if (a === `${x} ${y}`) near.add(number.get(b));
      if (b === `${x} ${y}`) near.add(number.get(a));
    }
    const connected = near.size > 0;
    if (!connected) {
      const away = i => Math.hypot(references[2 * i] - x, references[2 * i + 1] - y);
      near = new Set([...number.values()].filter(i => i !== reference).sort((i, j) => away(i) - away(j)).slice(0, 4));
    }
    this.querySelector('.near').replaceChildren(connected ? 'Connected to ' : 'Next to ', ...[...near].filter(i => i !== undefined).slice(0, 8).map(i => {
      const button = document.createElement('button');
      button.type = 'button';
      button.textContent = names?.[i] ?? i;
      button.addEventListener('click', () => this.choose(i));
      return button;
    }));
  }
  async tell() {
    const { takes } = this.run, typed = this.querySelector('input').value;
    const wish = takes === 'pose' ? [...this.at, typed === '' ? null : Number(typed) % 360 * Math.PI / 180] : this.place;
    const answer = await fetch('control', { method: 'POST', body: JSON.stringify({ [takes]: wish }) }).catch(() => undefined);
    this.querySelector('output').textContent = answer?.ok ? 'Sent to the run.' : 'The run rejected this request.';
  }
}
customElements.define('pn-card', Card);
