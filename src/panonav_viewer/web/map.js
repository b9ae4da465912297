import { Drawing, scaleBar } from 'panonav/draw';
import 'panonav/card';
import { isTruth, steady } from 'panonav/store';

// Edges in the order of LinkKind.
const edgeColours = ['reference', 'estimate', 'plan', 'doubt'];
// Colours from the least to the most similar view: viridis, whose lightness rises steadily, so that everybody sees its order.
const scale = ['#440154', '#482475', '#414487', '#355f8d', '#2a788e', '#21918c', '#22a884', '#44bf70', '#7ad151', '#bddf26', '#fde725'];
const areaColours = ['#0072b2', '#e69f00', '#009e73', '#cc79a7', '#56b4e9', '#d55e00'];

class MapPanel extends Drawing {
  attached() {
    this.tabIndex = 0;
    this.setAttribute('role', 'group');
    this.setAttribute('aria-label', 'Map');
    this.canvas.setAttribute('role', 'img');
    this.insertAdjacentHTML('beforeend',
      '<div class="legend"></div><div class="readout" aria-live="polite"></div><pn-card></pn-card>');
    this.card = this.querySelector('pn-card');
    this.card.attach(this.run, reference => { this.choose(reference); this.focus(); });
    this.legend = this.querySelector('.legend');
    this.readout = this.querySelector('.readout');
    this.zoom = 1;
    this.shift = [0, 0];  // px
    this.run.addEventListener('moment', () => this.redraw());
    this.run.addEventListener('retained', () => this.redraw());
    this.pointers = new Map();
    this.canvas.addEventListener('pointerdown', event => this.press(event));
    this.canvas.addEventListener('pointermove', event => this.drag(event));
    for (const end of ['pointerup', 'pointercancel']) this.canvas.addEventListener(end, event => this.release(event));
    this.canvas.addEventListener('wheel', event => {
      event.preventDefault();
      this.zoomBy(Math.exp(-event.deltaY / 400), event.offsetX, event.offsetY);
    }, { passive: false });
    // Arrows move the map with Shift. Without it they choose views if the map was reached by keyboard; after a click they
    // still step through the run.
    this.addEventListener('pointerdown', () => { this.byPointer = true; });
    this.addEventListener('focusout', () => { this.byPointer = false; });
    this.addEventListener('keydown', event => {
      const moves = { ArrowUp: [0, 40], ArrowDown: [0, -40], ArrowLeft: [40, 0], ArrowRight: [-40, 0] }, move = moves[event.key];
      if (event.key === 'Escape' && this.selected !== undefined) {
        this.choose(undefined);
      } else if (event.key === 'Enter' && this.selected !== undefined) {
        (this.card.querySelector('form:not([hidden]) button') ?? this.card.querySelector('.near button'))?.focus();
      } else if (move && event.shiftKey) {
        this.shift = this.shift.map((value, i) => value + move[i]);
        this.redraw();
      } else if (move && !this.byPointer && this.scale) {
        this.chooseTowards(-Math.sign(move[0]), -Math.sign(move[1]));
      } else {
        return;
      }
      event.preventDefault();
      event.stopPropagation();
    });
  }

  press(event) {
    this.canvas.setPointerCapture(event.pointerId);
    this.pointers.set(event.pointerId, [event.offsetX, event.offsetY]);
    this.moved = 0;
  }
  drag(event) {
    const before = this.pointers.get(event.pointerId);
    if (!before) return;
    const now = [event.offsetX, event.offsetY];
    const others = [...this.pointers].filter(([id]) => id !== event.pointerId).map(([, at]) => at);
    if (others.length === 1) {
      const [other] = others, apart = at => Math.hypot(at[0] - other[0], at[1] - other[1]);
      this.zoomBy(apart(now) / Math.max(1, apart(before)), other[0], other[1]);
    } else {
      this.shift = this.shift.map((value, i) => value + now[i] - before[i]);
      this.moved += Math.hypot(now[0] - before[0], now[1] - before[1]);
    }
    this.pointers.set(event.pointerId, now);
    this.redraw();
  }
  release(event) {
    if (this.pointers.delete(event.pointerId) && event.type === 'pointerup' && this.moved < 5) {
      this.select(event.offsetX, event.offsetY);
    }
  }
  zoomBy(factor, x = this.canvas.clientWidth / 2, y = this.canvas.clientHeight / 2) {
    const zoom = Math.max(0.2, Math.min(200, this.zoom * factor));
    factor = zoom / this.zoom;
    const centre = [this.canvas.clientWidth / 2, this.canvas.clientHeight / 2];
    this.shift = [x, y].map((at, i) => at - centre[i] - (at - centre[i] - this.shift[i]) * factor);
    this.zoom = zoom;
    this.redraw();
  }
  reset() {
    this.zoom = 1;
    this.shift = [0, 0];
    this.redraw();
  }
  // Chooses a view by its index among the references; `at`: the clicked position.
  choose(reference, at) {
    const { references = [], names } = this.run.retained;
    this.selected = reference;
    this.clicked = reference === undefined ? undefined : at;
    if (reference !== undefined) {
      this.readout.textContent = `stored view ${reference}${names ? `, ${names[reference]}` : ''}: ` +
        `x ${references[2 * reference].toFixed(2)} ${this.run.unit}, y ${references[2 * reference + 1].toFixed(2)} ${this.run.unit}`;
    } else {
      this.readout.textContent = '';
    }
    this.card.show(reference, at);
    this.card.classList.toggle('left', reference !== undefined && this.scale && this.px(references[2 * reference]) > this.clientWidth / 2);
    this.redraw();
  }
  // Chooses the next view in a direction of the screen; at first that nearest to the robot, or in the middle.
  chooseTowards(right, down) {
    const all = this.run.retained.references ?? [], { pose } = this.run.moment ?? {};
    const from = this.selected !== undefined ? [this.px(all[2 * this.selected]), this.py(all[2 * this.selected + 1])]
      : pose ? [this.px(pose[0]), this.py(pose[1])] : [this.canvas.clientWidth / 2, this.canvas.clientHeight / 2];
    let best, minCost = Infinity;
    for (let i = 0; i < all.length; i += 2) {
      const x = this.px(all[i]) - from[0], y = this.py(all[i + 1]) - from[1], along = x * right + y * down, aside = Math.abs(x * down) + Math.abs(y * right);
      if (i / 2 === this.selected || this.selected !== undefined && along < 1) continue;
      const cost = this.selected === undefined ? Math.hypot(x, y) : along + 2 * aside;
      if (cost < minCost) { minCost = cost; best = i / 2; }
    }
    if (best !== undefined) this.choose(best);
  }
  // Chooses the reference nearest to a click.
  select(x, y) {
    const all = this.run.retained.references ?? [];
    let best = Infinity, nearest;
    for (let i = 0; i < all.length; i += 2) {
      const apart = Math.hypot(this.px(all[i]) - x, this.py(all[i + 1]) - y);
      if (apart < best) { best = apart; nearest = i / 2; }
    }
    this.choose(nearest, best > 12 ? this.at(x, y) : undefined);
    if (nearest !== undefined) return;
    const [at_x, at_y] = this.at(x, y);
    this.readout.textContent = `x ${at_x.toFixed(2)} ${this.run.unit}, y ${at_y.toFixed(2)} ${this.run.unit}`;
  }

  // Returns the bounds of the whole run, so that the map does not jump.
  bounds() {
    const box = [Infinity, Infinity, -Infinity, -Infinity];
    const include = (x, y) => {
      box[0] = Math.min(box[0], x); box[1] = Math.min(box[1], y);
      box[2] = Math.max(box[2], x); box[3] = Math.max(box[3], y);
    };
    const { references = [], edges = [], goal, plan = [], walls = [] } = this.run.retained;
    for (let i = 0; i < references.length; i += 2) include(references[i], references[i + 1]);
    for (let i = 0; i < edges.length; i += 5) { include(edges[i], edges[i + 1]); include(edges[i + 2], edges[i + 3]); }
    for (let i = 0; i < plan.length; i += 3) include(plan[i], plan[i + 1]);
    if (goal) include(goal[0], goal[1]);
    for (const moment of this.run.moments) {
      if (moment.pose) include(moment.pose[0], moment.pose[1]);
      if (moment.truth) include(moment.truth[0], moment.truth[1]);
    }
    if (!(box[0] <= box[2])) return undefined;
    const [west, south, east, north] = box, around = Math.max(1.5, 0.4 * (east - west), 0.4 * (north - south));  // metres whose walls are included
    for (const wall of walls) {
      for (let i = 0; i < wall.length; i += 2) {
        if (wall[i] > west - around && wall[i] < east + around && wall[i + 1] > south - around && wall[i + 1] < north + around) include(wall[i], wall[i + 1]);
      }
    }
    return box;
  }
  px(x) { return this.origin[0] + x * this.scale; }
  py(y) { return this.origin[1] - y * this.scale; }
  at(px, py) { return [(px - this.origin[0]) / this.scale, (this.origin[1] - py) / this.scale]; }

  draw(context, width, height, colour) {
    const box = this.bounds();
    const moment = this.run.moment;
    if (!box) {
      this.legend.textContent = moment ? 'No positions yet.' : '';
      return;
    }
    const margin = 0.5, edge = 24;  // in units of the map, and in pixels for the robot and its arrow
    this.scale = this.zoom * Math.min((width - 2 * edge) / (box[2] - box[0] + 2 * margin),
      (height - 2 * edge) / (box[3] - box[1] + 2 * margin));
    this.longest = 2 * Math.max(width, height);  // a longer radius means that nothing is known in its direction
    this.origin = [width / 2 + this.shift[0] - (box[0] + box[2]) / 2 * this.scale,
      height / 2 + this.shift[1] + (box[1] + box[3]) / 2 * this.scale];
    const keys = new Map();
    const { references = [], edges = [], plan = [], directions = [], goal, walls = [], regions = [] } = this.run.retained;

    this.drawRegions(context, regions, keys, colour);
    this.drawWalls(context, walls, keys, colour);
    for (let i = 0; i < edges.length; i += 5) {
      const key = edgeColours[edges[i + 4]] ?? 'reference';
      keys.set(edges[i + 4] === 2 ? 'loop closures' : 'edges', [key, 0]);
      context.strokeStyle = colour(key);
      context.globalAlpha = 0.5;
      context.lineWidth = 1;
      this.line(context, [[edges[i], edges[i + 1]], [edges[i + 2], edges[i + 3]]]);
    }
    context.globalAlpha = 1;
    if (references.length) {
      keys.set('stored views', ['reference', '50%']);
      context.fillStyle = colour('reference');
      const radius = Math.max(1, Math.min(3, this.scale / 15));
      for (let i = 0; i < references.length; i += 2) this.dot(context, references[i], references[i + 1], radius);
      this.drawSimilarity(context, references, moment?.compared ?? [], radius, keys, colour);
    }
    if (this.selected !== undefined && this.selected * 2 < references.length) {
      context.strokeStyle = colour('ink');
      context.lineWidth = 2;
      this.ring(context, references[2 * this.selected], references[2 * this.selected + 1], 7);
      if (this.clicked) {
        const [x, y] = this.clicked;
        context.setLineDash([2, 3]);
        this.line(context, [this.clicked, [references[2 * this.selected], references[2 * this.selected + 1]]]);
        context.setLineDash([]);
        context.fillStyle = colour('ink');
        this.dot(context, x, y, 3);
      }
    }
    if (directions.length) keys.set('direction at each view', ['plan', 0]);
    context.strokeStyle = colour('plan');
    context.lineWidth = 1;
    for (let i = 0; i < directions.length; i += 3) this.pointer(context, directions.slice(i, i + 3), 7);
    if (plan.length) {
      keys.set(goal ? 'plan' : 'route', ['plan', 0]);
      context.lineWidth = 3;
      const way = [];
      for (let i = 0; i < plan.length; i += 3) way.push([plan[i], plan[i + 1]]);
      this.line(context, way);
    }
    if (goal) {
      keys.set('goal', ['plan', '50%']);
      context.lineWidth = 3;
      this.ring(context, goal[0], goal[1], 8);
    }

    const shown = this.run.content?.unordered ? [] : this.run.moments.slice(0, this.run.index + 1);
    const exact = moment && isTruth(moment);
    if (!exact && shown.some(({ truth }) => truth)) {
      keys.set('ground truth', ['truth', 0]);
      context.strokeStyle = colour('truth');
      context.lineWidth = 1.5;
      context.setLineDash([5, 3]);
      this.line(context, steady(shown, 'truth'));
      context.setLineDash([]);
    }
    if (shown.some(({ pose }) => pose)) {
      const bound = !moment?.covariance ? 'estimate and path' : this.radii(moment.covariance)[0] > this.longest
        ? 'estimate and path; 95 % between the dashed lines, nothing known across the route' : 'estimate, path and 95 % ellipse';
      keys.set(exact ? 'true path' : bound, ['estimate', 0]);
      context.strokeStyle = colour('estimate');
      context.lineWidth = 2;
      this.line(context, steady(shown, 'pose'));
    }
    const particles = moment?.particles ?? [];
    if (particles.length) keys.set('particles', ['particle', '50%']);
    context.fillStyle = colour('particle');
    context.globalAlpha = 0.6;
    for (let i = 0; i < particles.length; i += 3) this.dot(context, particles[i], particles[i + 1], 1.8);
    context.globalAlpha = 1;
    if (moment?.truth && !exact) {
      context.strokeStyle = colour('truth');
      context.lineWidth = 2;
      this.ring(context, moment.truth[0], moment.truth[1], 6);
      if (moment.truth[2] !== null) this.pointer(context, moment.truth, 16);
    }
    this.drawModes(context, moment?.modes ?? [], keys, colour);
    if (moment?.pose) {
      context.strokeStyle = colour('estimate');
      context.fillStyle = colour('estimate');
      context.lineWidth = 2;
      if (moment.covariance && !moment.modes) this.ellipse(context, moment.pose, moment.covariance);
      this.dot(context, moment.pose[0], moment.pose[1], 5);
      this.pointer(context, moment.pose, 20);
      if (moment.homing) this.drawHoming(context, moment, keys, colour);
    }
    scaleBar(context, this.scale, width, this.run.unit, colour);
    this.tell(keys, moment, references);
  }
  tell(keys, moment, references) {
    const legend = [...keys].map(([name, [key, round]]) =>
      `<span style="--key:${key.startsWith('linear') ? key : `var(--${key})`};--round:${round}"${key.startsWith('linear') ? ' class="scale"' : ''}>${name}</span>`).join('');
    if (this.shownLegend !== legend) this.legend.innerHTML = this.shownLegend = legend;
    const { unit } = this.run, at = ([x, y]) => `x ${x.toFixed(1)} ${unit}, y ${y.toFixed(1)} ${unit}`;
    const text = ['Map of the run', references.length && `${references.length / 2} stored views`,
      moment?.compared && `most similar view ${this.nameOf(moment.compared[0])}`, moment?.pose && `robot at ${at(moment.pose)}`,
      moment?.modes?.length > 1 && `or at ${moment.modes.slice(1, 4).map(([weight, x, y]) => `${at([x, y])} with ${Math.round(100 * weight)} %`).join('; ')}`,
      this.run.retained.goal && `goal at ${at(this.run.retained.goal)}`].filter(Boolean).join(', ');
    if (this.canvas.getAttribute('aria-label') !== text) this.canvas.setAttribute('aria-label', text);
  }
  nameOf(reference) { return this.run.retained.names?.[reference] ?? reference; }

  drawRegions(context, regions, keys, colour) {
    if (!regions.length) return;
    const areas = new Map();  // number: its cells
    for (const [area, ...outline] of regions) areas.set(area, [...(areas.get(area) ?? []), outline]);
    keys.set(areas.size > 1 ? 'areas of the memory' : 'area of the memory', ['area', 0]);
    context.globalAlpha = 0.13;
    for (const [area, cells] of areas) {
      context.fillStyle = areaColours[area % areaColours.length];
      context.beginPath();
      for (const cell of cells) this.outline(context, cell);
      context.fill();
    }
    context.globalAlpha = 1;
    if (areas.size < 2) return;
    context.fillStyle = colour('soft');
    context.font = 'bold 13px system-ui';
    for (const [area, cells] of areas) {  // colours come again, numbers do not
      const mean = at => cells.reduce((sum, cell) => sum + cell[at], 0) / cells.length;
      context.fillText(String(area), this.px(mean(0)), this.py(mean(1)));
    }
  }
  drawWalls(context, walls, keys, colour) {
    if (!walls.length) return;
    keys.set('walls and objects', ['wall', 0]);
    context.strokeStyle = context.fillStyle = colour('wall');
    context.lineWidth = 1.5;
    context.beginPath();
    for (const wall of walls) this.outline(context, wall);
    context.stroke();
    context.globalAlpha = 0.35;
    context.beginPath();
    for (const wall of walls) if (wall.length > 6 && wall[0] === wall.at(-2) && wall[1] === wall.at(-1)) this.outline(context, wall);
    context.fill('nonzero');
    context.globalAlpha = 1;
  }
  // Draws the compared views by colour and size, from the least to the most similar.
  drawSimilarity(context, references, compared, radius, keys, colour) {
    if (compared.length < 4) return;
    keys.set('similarity: low &ndash; high', [`linear-gradient(90deg,${scale})`, 0]);
    const best = compared[1], range = Math.max(1, compared.at(-1) - best);
    context.lineWidth = 0.7;
    context.strokeStyle = colour('soft');
    for (let i = compared.length - 2; i >= 0; i -= 2) {
      const similarity = 1 - (compared[i + 1] - best) / range, at = 2 * compared[i];
      if (at >= references.length) continue;
      context.fillStyle = scale[Math.round(similarity * (scale.length - 1))];
      this.dot(context, references[at], references[at + 1], radius * (1 + 1.2 * similarity));
      context.stroke();
    }
  }
  drawModes(context, modes, keys, colour) {
    if (!modes.length) return;
    if (modes.length > 1) keys.set('other possible poses, with weights', ['mode', '50%']);
    context.font = '12px system-ui';
    const written = [];  // places of weights; the largest comes first, and none is written over another
    modes.forEach(([weight, x, y, heading, ...covariance], i) => {
      context.strokeStyle = context.fillStyle = colour(i ? 'mode' : 'estimate');
      context.lineWidth = 1 + 2 * weight;
      this.ellipse(context, [x, y], covariance);
      if (modes.length < 2) return;
      this.pointer(context, [x, y, heading], 14);
      const text = `${Math.round(100 * weight)} %`, { width } = context.measureText(text);
      const at = [Math.max(2, Math.min(this.canvas.clientWidth - width - 2, this.px(x) + 8)), Math.max(32, this.py(y) - 8)];
      if (written.some(([left, right, base]) => at[0] < right + 4 && left < at[0] + width + 4 && Math.abs(base - at[1]) < 13)) return;
      written.push([at[0], at[0] + width, at[1]]);
      context.fillText(text, ...at);
    });
  }
  drawHoming(context, { pose, homing: [direction, sure] }, keys, colour) {
    const probability = sure ?? 0;
    keys.set(`home vector, probability ${probability.toFixed(2)}`, ['particle', 0]);
    context.strokeStyle = context.fillStyle = colour('particle');
    context.lineWidth = 1 + 4 * probability;
    const heading = pose[2] + direction, length = 26 + 34 * probability;
    this.pointer(context, [pose[0], pose[1], heading], length);
    context.beginPath();
    const [x, y] = [this.px(pose[0]) + length * Math.cos(heading), this.py(pose[1]) - length * Math.sin(heading)];
    for (const [along, aside] of [[9, 0], [-3, 6], [-3, -6]]) {
      context.lineTo(x + along * Math.cos(heading) - aside * Math.sin(heading), y - along * Math.sin(heading) - aside * Math.cos(heading));
    }
    context.fill();
  }
  outline(context, points) {
    for (let i = 0; i < points.length; i += 2) {
      if (i) context.lineTo(this.px(points[i]), this.py(points[i + 1])); else context.moveTo(this.px(points[i]), this.py(points[i + 1]));
    }
  }

  dot(context, x, y, radius) {
    context.beginPath();
    context.arc(this.px(x), this.py(y), radius, 0, 2 * Math.PI);
    context.fill();
  }
  ring(context, x, y, radius) {
    context.beginPath();
    context.arc(this.px(x), this.py(y), radius, 0, 2 * Math.PI);
    context.stroke();
  }
  pointer(context, [x, y, heading], length) {
    context.beginPath();
    context.moveTo(this.px(x), this.py(y));
    context.lineTo(this.px(x) + length * Math.cos(heading), this.py(y) - length * Math.sin(heading));
    context.stroke();
  }
  line(context, points) {  // missing points interrupt it
    context.beginPath();
    let drawing = false;
    for (const point of points) {
      if (!point) { drawing = false; continue; }
      if (drawing) context.lineTo(this.px(point[0]), this.py(point[1]));
      else context.moveTo(this.px(point[0]), this.py(point[1]));
      drawing = true;
    }
    context.stroke();
  }
  // Returns the radii in pixels, the longer one first. 95 % of a normal distribution: 2.4477 standard deviations.
  radii([xx, xy, yy]) {
    const middle = (xx + yy) / 2, half = Math.hypot((xx - yy) / 2, xy);
    return [middle + half, middle - half].map(value => 2.4477 * Math.sqrt(Math.max(0, value)) * this.scale);
  }
  ellipse(context, [x, y], covariance) {
    const [xx, xy, yy] = covariance, [longer, shorter] = this.radii(covariance);
    context.setLineDash(longer > this.longest ? [6, 4] : []);
    context.beginPath();
    context.ellipse(this.px(x), this.py(y), longer, shorter, -Math.atan2(2 * xy, xx - yy) / 2, 0, 2 * Math.PI);
    context.stroke();
    context.setLineDash([]);
  }
}
customElements.define('pn-map', MapPanel);
