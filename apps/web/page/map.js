// The map: a dot for each place, the area in which the picture was taken, an arrow for the heading. y points up.

const svg = (name, attributes) => {
  const element = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  return element;
};
const dotPath = (points) => points.map(({ x, y }) => `M${x} ${-y}h0`).join("");

/** 1, 2 or 5 times a power of ten, at most `length`. */
function roundLength(length) {
  const power = 10 ** Math.floor(Math.log10(length));
  return power * [5, 2, 1].find((factor) => factor * power <= length);
}

export class PlaceMap {
  /** `choose` gets the place that was clicked. */
  constructor(element, caption, choose) {
    this.element = element;
    this.caption = caption;
    this.places = [];
    this.trail = [];
    element.addEventListener("click", (event) => {
      const at = new DOMPoint(event.clientX, event.clientY).matrixTransform(element.getScreenCTM().inverse());
      const distance = (place) => (place.x - at.x) ** 2 + (place.y + at.y) ** 2;
      choose(this.places.reduce((a, b) => (distance(a) <= distance(b) ? a : b)));
    });
  }

  /** Draws the places with a position; `unit`: "m" or "view steps". */
  show(places, unit) {
    this.places = places;
    this.trail = [];
    this.answer = null;
    this.chosen = null;
    const [xs, ys] = [places.map(({ x }) => x), places.map(({ y }) => -y)];
    const [left, top] = [xs.reduce((a, b) => Math.min(a, b)), ys.reduce((a, b) => Math.min(a, b))];
    const width = xs.reduce((a, b) => Math.max(a, b)) - left;
    const height = ys.reduce((a, b) => Math.max(a, b)) - top;
    this.extent = Math.max(width, height, 1e-3);
    const margin = 0.12 * this.extent;
    this.viewWidth = width + 2 * margin;
    this.element.setAttribute("viewBox", [left - margin, top - margin, this.viewWidth, height + 2 * margin].join(" "));
    const length = roundLength(this.extent / 3);
    const bar = { x: left, y: top + height + 0.7 * margin, length };
    this.caption.textContent = `Each dot is a place. The line at the bottom is ${length} ${unit} long.`;
    this.element.replaceChildren(
      svg("path", { class: "dots", d: dotPath(places), "vector-effect": "non-scaling-stroke", "stroke-width": places.length > 400 ? 4 : 7 }),
      svg("path", { class: "scale", d: `M${bar.x} ${bar.y}h${bar.length}` }),
      this.overlay = svg("g", {}));
    this.describe(`Map with ${places.length} places`);
  }

  describe(text) {
    this.element.setAttribute("aria-label", text);
  }

  /** Draws where the picture was taken: {x, y, radius, heading, others}; null: nowhere. */
  mark(answer, follows = false) {
    this.answer = answer;
    if (!follows) this.trail = [];
    if (answer) this.trail = [...this.trail.slice(-40), answer];
    this.draw();
  }

  /** Draws a ring around a place. */
  choose(place) {
    this.chosen = place;
    this.draw();
  }

  draw() {
    if (!this.overlay) return;
    const size = (this.viewWidth * 26) / (this.element.clientWidth || 400);  // of the arrow, 26 pixels
    const parts = [];
    if (this.trail.length > 1) {
      parts.push(svg("polyline", { class: "trail", points: this.trail.map(({ x, y }) => `${x},${-y}`).join(" ") }));
    }
    for (const { x, y } of this.answer?.others ?? []) parts.push(svg("circle", { class: "other", cx: x, cy: -y, r: 0.4 * size }));
    if (this.chosen) parts.push(svg("circle", { class: "chosen", cx: this.chosen.x, cy: -this.chosen.y, r: 0.35 * size }));
    if (this.answer) {
      const { x, y, radius, heading } = this.answer;
      parts.push(svg("circle", { class: "area", cx: x, cy: -y, r: Math.max(radius ?? 0, 0.1 * size) }));
      if (heading === null) {
        parts.push(svg("circle", { class: "here", cx: x, cy: -y, r: 0.3 * size }));
      } else {
        const turned = `translate(${x} ${-y}) rotate(${(-heading * 180) / Math.PI}) scale(${size})`;
        parts.push(svg("path", { class: "here", d: "M.7 0-.4 .42-.2 0-.4-.42Z", transform: turned }));
      }
    }
    this.overlay.replaceChildren(...parts);
  }
}
