// The page: asks the worker where pictures were taken, shows the answers, and keeps memories in this browser.

import { explain, percent, shortName } from "./answer.js";
import { Camera } from "./camera.js";
import { startEngine } from "./engine.js";
import { Gallery } from "./gallery.js";
import { makeMemory, picturesOf, readChoice, readDrop } from "./making.js";
import { PlaceMap } from "./map.js";
import { forgetMemory, keepMemory, listMemories } from "./store.js";

const find = (id) => document.getElementById(id);
const make = (tag, properties = {}, ...children) => {
  const element = Object.assign(document.createElement(tag), properties);
  element.append(...children);
  return element;
};
/** Shows a text that screen readers read out; `isShown`: it is on the page already, so that it is only read out. */
function say(text, isShown = false) {
  find("status").className = isShown ? "spoken" : "";
  find("status").textContent = text;
}

const engine = startEngine();
const camera = new Camera(find("video"), find("devices"), find("devices-label"));
const map = new PlaceMap(find("map"), find("map-caption"), (place) => choosePlace(place));
const gallery = new Gallery(find("gallery"), find("more"), (place) => pictureOf(place), (place) => choosePlace(place));

let shown = null;     // the memory that is open: {name, bytes, views, id, description, pictures}
let own = null;       // the memory that came with the page
let isBusy = false;   // a picture is being compared, or a memory made
let isStopped = false;
let isLive = false;
const addresses = new Map();  // of thumbnails, by the id of their view

// ---- memories

/** Names of views on floors begin with the floor: "second/view_3.png". */
const floorOf = (place) => (place.name.includes("/") ? place.name.slice(0, place.name.indexOf("/")) : "");

/** Address of the picture that came with the page; of the memory's small one where there is none, or no network. */
async function pictureOf(place) {
  if (addresses.has(place.id)) return addresses.get(place.id);
  const file = shown.pictures?.includes(place.id) ? await fetch(`pictures/${place.id}.jpg`).catch(() => null) : null;
  const bytes = file?.ok ? await file.blob() : await engine.thumbnail({ view: place.id });
  if (!addresses.has(place.id)) addresses.set(place.id, bytes && URL.createObjectURL(new Blob([bytes])));
  return addresses.get(place.id);
}

async function openMemory(memory) {
  const description = await engine.open({ bytes: memory.bytes });
  for (const address of addresses.values()) if (address) URL.revokeObjectURL(address);
  addresses.clear();
  stopLive();
  shown = { ...memory, description, views: description.views.length };
  find("subtitle").textContent = `${shown.name}: ${shown.views} places`;
  find("ask").hidden = false;
  find("angle-label").hidden = !description.takes_narrow_pictures;
  find("source-picture").textContent = description.takes_narrow_pictures ? "a photo or 360° picture" : "a 360° picture";
  find("answer").hidden = true;
  showPlaces();
  await listKept();
}

function showPlaces() {
  const { views, unit } = shown.description;
  const floors = [...new Set(views.filter(({ x }) => x !== undefined).map(floorOf))].sort();
  find("places").hidden = false;
  find("floors").hidden = floors.length < 2;
  find("floor").replaceChildren(...floors.map((floor) => new Option(floor || "no name", floor)));
  gallery.show(views);
  showFloor(floors[0] ?? "");
}

function showFloor(floor) {
  const placed = shown.description.views.filter((place) => place.x !== undefined && floorOf(place) === floor);
  find("map-figure").hidden = placed.length === 0;
  find("floor").value = floor;
  if (placed.length > 0) map.show(placed, shown.description.unit);
}

function choosePlace(place) {
  gallery.mark(place);
  if (place.x === undefined) return say(shortName(place.name));
  if (find("floor").value !== floorOf(place)) showFloor(floorOf(place));
  map.choose(place);
  say(`${shortName(place.name)}: x ${place.x.toFixed(2)}, y ${place.y.toFixed(2)} ${shown.description.unit}`);
}

function download(memory) {
  const link = make("a", { href: URL.createObjectURL(memory.bytes), download: `${memory.name}.panonav` });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
}

async function listKept() {
  let kept = [];
  try {
    kept = await listMemories();
  } catch {
    say("This browser keeps nothing for this page. Download a memory before you close it.");
  }
  const all = [...(own ? [own] : []), ...(shown && !shown.id && shown !== own && shown.bytes !== own?.bytes ? [shown] : []), ...kept];
  find("memories").hidden = all.length === 0;
  find("memory-list").replaceChildren(...all.map((memory) => {
    const isShown = memory.id ? memory.id === shown?.id : memory.bytes === shown?.bytes;
    const button = (text, work) => make("button", { type: "button", onclick: () => guard(work) }, text);
    const item = make("li", {},
      make("span", {}, make("strong", {}, memory.name), `: ${memory.views} places, ${(memory.bytes.size / 1e6).toFixed(1)} MB`, isShown ? " (open)" : ""));
    if (!isShown) item.append(button("Open", () => openMemory(memory)));
    item.append(button("Download", () => download(memory)));
    if (memory.id) item.append(button("Delete", () => deleteMemory(memory)));
    for (const each of item.querySelectorAll("button")) each.setAttribute("aria-label", `${each.textContent} ${memory.name}`);
    return item;
  }));
}

async function deleteMemory(memory) {
  if (!confirm(`Delete the memory "${memory.name}" from this browser? It cannot be restored.`)) return;
  await forgetMemory(memory.id);
  if (memory.id === shown?.id) shown = { ...shown, id: undefined };
  await listKept();
  say(`${memory.name} is deleted from this browser.`);
}

/** Opens a memory and keeps it. */
async function takeMemory(memory) {
  await openMemory(memory);
  try {
    const id = await keepMemory({ name: memory.name, views: shown.views, bytes: memory.bytes });
    shown = { ...shown, id };
    navigator.storage?.persist?.();
  } catch {
    say("This browser cannot keep the memory. Download it before you close the page.");
  }
  await listKept();
}

async function makeFrom({ files, folder }) {
  const pictures = picturesOf(files);
  if (pictures.length < 2) throw new Error("There are fewer than two pictures. Choose a folder of 360° pictures (JPEG or PNG).");
  const name = folder ?? "my places";
  isStopped = false;
  find("make-details").open = true;
  find("making").hidden = false;
  say(`Making a memory of ${pictures.length} pictures.`);
  try {
    const show = (count, total) => {
      Object.assign(find("made"), { max: total + 1, value: count });
      find("made-text").textContent = count < total ? `(${count} of ${total} pictures)` : "(learning from the pictures)";
    };
    const made = await makeMemory(engine, pictures, show, () => isStopped);
    if (!made) return say("Stopped. Nothing was kept.");
    await takeMemory({ name, bytes: made.bytes });
    const skipped = made.skipped.length === 0 ? "" : ` ${made.skipped.length} pictures cannot be used. The first: ${made.skipped[0]}`;
    find("make-details").open = false;
    say(`The memory "${name}" has ${shown.views} places and is kept in this browser.${skipped}`);
    find("where").focus();
  } finally {
    find("making").hidden = true;
  }
}

// ---- answers

function compass(heading) {
  const span = document.createElement("span");
  const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
  svg.setAttribute("viewBox", "-10 -10 20 20");
  svg.setAttribute("class", "compass");
  svg.setAttribute("aria-hidden", "true");
  const circle = document.createElementNS(svg.namespaceURI, "circle");
  circle.setAttribute("r", "9");
  const arrow = document.createElementNS(svg.namespaceURI, "path");
  arrow.setAttribute("d", "M8 0-5 5-2 0-5-5Z");
  arrow.setAttribute("transform", `rotate(${(-heading * 180) / Math.PI})`);
  svg.append(circle, arrow);
  span.append(svg);
  return span;
}

/** On a map 0 points right; relative to a picture, straight on is up. */
const toArrow = (explained, heading) => (explained.mark ? heading : heading + Math.PI / 2);

/** The angle of view in words; nothing of pictures that show all directions. */
function describeView({ degrees, origin }) {
  if (degrees === 0) return [];
  const reason = { stated: "as you say", file: "as its file says", guess: "as most phones do; set the angle of view if it is another" }[origin];
  return [["Your picture", `shows ${Math.round(degrees)}°, ${reason}`]];
}

/** Angle of view that the visitor states; undefined: it is found. */
const statedView = () => find("angle").valueAsNumber || undefined;

async function showAnswer({ answer, shown: seen }, picture, isLiveAnswer = false) {
  const explained = explain(answer, shown.description.unit, shown.views);
  const section = find("answer");
  section.className = explained.state;
  section.hidden = false;
  find("answer-title").textContent = explained.title;
  const facts = make("dl", { className: "facts" });
  for (const [name, text, share, heading] of [...explained.facts, ...describeView(seen)]) {
    const value = make("dd", {}, text);
    if (share !== undefined) value.append(make("meter", { min: 0, max: 1, value: share, ariaHidden: "true" }));
    if (heading !== undefined) value.prepend(compass(toArrow(explained, heading)));
    facts.append(make("dt", {}, name), value);
  }
  const place = shown.description.views.find(({ name }) => name === explained.place);
  const pair = make("div", { className: "pair" });
  const addPicture = (address, caption) => {
    if (address) pair.append(make("figure", {}, make("img", { src: address, alt: "" }), make("figcaption", {}, caption)));
  };
  if (place) addPicture(await pictureOf(place), `Picture of the place: ${shortName(place.name)}`);
  if (picture) addPicture(picture, "Your picture");
  find("answer-body").replaceChildren(facts, ...(explained.text ? [make("p", {}, explained.text)] : []), pair);
  if (place) {
    if (place.x !== undefined && find("floor").value !== floorOf(place)) showFloor(floorOf(place));
  }
  gallery.mark(isLiveAnswer ? null : place);
  map.choose(null);
  map.mark(explained.mark, isLiveAnswer);
  map.describe(explained.sentence);
  return explained;
}

let queryAddress = null;
async function askWithFile(file) {
  const answer = await engine.localise({ picture: file, name: file.name, fieldOfView: statedView() });
  if (queryAddress) URL.revokeObjectURL(queryAddress);
  queryAddress = URL.createObjectURL(file);
  const explained = await showAnswer(answer, queryAddress);
  say(explained.sentence, true);
  find("answer").scrollIntoView({ block: "nearest" });
}

async function askWithCamera(isLiveAnswer) {
  const picture = await camera.takePicture();
  const answer = await engine.localise({ picture, name: "camera", fieldOfView: statedView() }, [picture]);
  return showAnswer(answer, null, isLiveAnswer);
}

function stopLive() {
  isLive = false;
  find("live").checked = false;
  showButton();
}

/** Answers until it is stopped; a screen reader hears of new places only, at most every four seconds. */
async function followCamera() {
  isLive = true;
  showButton();
  const times = [];
  let said = "";
  let saidAt = -Infinity;
  try {
    while (isLive) {
      const explained = await askWithCamera(true);
      const now = performance.now();
      times.push(now);
      while (times.length > 2 && now - times[0] > 3000) times.shift();
      if (explained.title !== said && now - saidAt > 4000) {
        say(explained.sentence, true);
        [said, saidAt] = [explained.title, now];
      }
      const rate = times.length > 1 ? (1000 * (times.length - 1)) / (now - times[0]) : 0;
      find("ask-hint").textContent = `${rate.toFixed(1)} answers a second`;
      find("ask-hint").dataset.rate = rate.toFixed(2);
      await new Promise((resolve) => setTimeout(resolve, 0));
    }
  } finally {
    stopLive();
  }
}

function showFault(error) {
  const section = find("answer");
  section.className = "error";
  section.hidden = false;
  find("answer-title").textContent = "This does not work";
  const text = error.message.replace(/\.?$/, ".");
  find("answer-body").replaceChildren(make("p", {}, text));
  say(text, true);
  map.mark(null);
}

/** Does one thing at a time, and shows what went wrong. */
async function guard(work) {
  if (isBusy) return;
  isBusy = true;
  document.body.setAttribute("aria-busy", "true");
  try {
    await work();
  } catch (error) {
    showFault(error);
  } finally {
    isBusy = false;
    document.body.removeAttribute("aria-busy");
  }
}

// ---- controls

const usesCamera = () => document.querySelector("input[name=source]:checked").value === "camera";

function showButton() {
  find("where").textContent = isLive ? "Stop" : "Where am I?";
  if (!isLive) {
    find("ask-hint").textContent = !usesCamera() ? "Or drop a picture anywhere on this page."
      : shown?.description.takes_narrow_pictures ? "Hold it upright, with the horizon level."
        : "The camera must see all directions (a 360° camera).";
  }
}

find("where").addEventListener("click", () => {
  if (isLive) return stopLive();
  if (!usesCamera()) return find("query").click();
  return guard(async () => {
    if (find("live").checked) return followCamera();
    say((await askWithCamera(false)).sentence, true);
  });
});
for (const radio of document.querySelectorAll("input[name=source]")) {
  radio.addEventListener("change", () => {
    stopLive();
    find("camera").hidden = !usesCamera();
    if (!usesCamera()) return camera.stop();
    return guard(() => camera.start());
  });
}
find("live").addEventListener("change", () => { if (!find("live").checked) stopLive(); });
find("floor").addEventListener("change", () => showFloor(find("floor").value));

/** Gives the files of an input to `work`; the same files can be chosen again. */
function onChoice(id, work) {
  find(id).addEventListener("change", () => guard(async () => {
    const input = find(id);
    if (input.files.length === 0) return;
    const choice = readChoice(input);
    input.value = "";
    await work(choice);
  }));
}
const openFile = ({ file, name }) => takeMemory({ name: name.replace(/\.panonav$/, ""), bytes: file });
onChoice("query", ({ files }) => { say("Comparing the picture."); return askWithFile(files[0].file); });
onChoice("folder", makeFrom);
onChoice("pictures", makeFrom);
onChoice("memory", ({ files }) => openFile(files[0]));
for (const [button, input] of [["choose-folder", "folder"], ["choose-pictures", "pictures"], ["choose-memory", "memory"]]) {
  find(button).addEventListener("click", () => find(input).click());
}
find("cancel").addEventListener("click", () => { isStopped = true; });

document.addEventListener("dragover", (event) => { event.preventDefault(); document.body.classList.add("dragging"); });
document.addEventListener("dragleave", (event) => { if (!event.relatedTarget) document.body.classList.remove("dragging"); });
document.addEventListener("drop", (event) => {
  event.preventDefault();
  document.body.classList.remove("dragging");
  const reading = readDrop(event.dataTransfer);  // the items are gone after this event
  guard(async () => {
    const dropped = await reading;
    const { files } = dropped;
    if (files.length === 1 && files[0].name.endsWith(".panonav")) return openFile(files[0]);
    if (shown && !dropped.folder && files.length === 1) return askWithFile(files[0].file);
    return makeFrom(dropped);
  });
});

// ---- start

async function fetchMemory({ name, file, bytes, pictures }) {
  const response = await fetch(file);
  if (!response.ok) throw new Error(`${file} cannot be loaded (${response.status}).`);
  const parts = [];
  let loaded = 0;
  const reader = response.body.getReader();
  for (;;) {
    const { done, value } = await reader.read();
    if (done) break;
    parts.push(value);
    loaded += value.length;
    if (bytes > 2e6) say(`Loading ${name}: ${percent(loaded / bytes)}`);
  }
  return { name, bytes: new Blob(parts), pictures };
}

/** Pictures that come with the page, for visitors who have none. */
function showExamples(files) {
  find("examples").hidden = files.length === 0;
  find("example-list").replaceChildren(...files.map((file, i) => {
    const ask = async () => {
      const picture = await (await fetch(file)).blob();
      await askWithFile(new File([picture], file.replace(/^.*\//, "")));
    };
    return make("li", {}, make("button", { type: "button", onclick: () => guard(ask) },
      make("img", { src: file, alt: `Example ${i + 1}` })));
  }));
}

async function start() {
  find("loading").hidden = true;
  find("left").hidden = find("rest").hidden = false;
  const stored = await (await fetch("memory.json")).json();
  const startsEmpty = !stored.file || location.hash === "#new";
  find("make-details").open = startsEmpty;
  if (startsEmpty) {
    find("subtitle").textContent = "Make a memory of places from 360° pictures; then ask where a picture was taken.";
    await listKept();
  }
  if (stored.file && !startsEmpty) {
    own = await fetchMemory(stored);
    await openMemory(own);
    own.views = shown.views;
    showExamples(stored.examples ?? []);
    await listKept();
    say("");
  }
  document.body.dataset.ready = "true";
  keepPage(stored).catch(() => {});  // then it needs the network, as where the browser forbids it
}

/** Keeps what was loaded, so that the page works without a network (offline.js). */
async function keepPage({ file, examples = [] }) {
  if (!("serviceWorker" in navigator)) return;
  await navigator.serviceWorker.register("offline.js");
  const cache = await caches.open("panonav");
  if (own) await cache.put(file, new Response(own.bytes));
  await cache.addAll(examples);
}

guard(start);
