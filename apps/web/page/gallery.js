// The places as a list of pictures; more are shown at a press of a button, since a memory may have thousands.

import { shortName } from "./answer.js";

const count_at_once = 12;

export class Gallery {
  /** `picture` resolves a place to the address of its picture or null; `choose` gets the pressed place. */
  constructor(list, more, picture, choose) {
    Object.assign(this, { list, more, picture, choose });
    more.addEventListener("click", () => this.showMore(true));
  }

  show(places) {
    this.places = places;
    this.count = 0;  // of places in order; the marked one stands before them
    this.marked = null;
    this.list.replaceChildren();
    this.showMore(false);
  }

  showMore(movesFocus) {
    const items = this.places.slice(this.count, this.count + count_at_once).map((place) => this.makeItem(place));
    this.list.append(...items);
    this.count += items.length;
    const left = this.places.length - this.count;
    this.more.hidden = left === 0;
    this.more.textContent = `Show more places (${left} left)`;
    if (movesFocus) items[0]?.firstChild.focus();
  }

  makeItem(place) {
    const item = document.createElement("li");
    const button = document.createElement("button");
    button.type = "button";
    button.append(shortName(place.name));
    button.addEventListener("click", () => this.choose(place));
    item.append(button);
    this.picture(place).then((address) => {
      if (!address) return;
      const image = document.createElement("img");
      image.alt = "";
      image.src = address;
      button.prepend(image);
    });
    return item;
  }

  /** Shows this place before all others; null: no place. */
  mark(place) {
    if (place === this.marked) return;
    if (this.marked) this.list.firstChild.remove();
    this.marked = place ?? null;
    if (!place) return;
    const item = this.makeItem(place);
    item.setAttribute("aria-current", "true");
    this.list.prepend(item);
  }
}
