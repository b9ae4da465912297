// The work on pictures, beside the page: messages {id, task, arguments} are answered by {id, result} or {id, error},
// one after the other; {id, progress} come before.

import { loadPanonav } from "./panonav.js";

const loading = loadPanonav();
loading.catch(() => {});  // is reported with the first task
let memory = null;
let description = null;  // describes the open memory
let maker = null;

/** Pixels of a file or of a picture of the camera. */
async function decode(source, name) {
  const bitmap = source instanceof ImageBitmap ? source : await createImageBitmap(source, { colorSpaceConversion: "none" })
    .catch(() => { throw new Error(`${name} is not a picture that this browser reads. Choose a JPEG or PNG`); });
  const context = new OffscreenCanvas(bitmap.width, bitmap.height).getContext("2d", { willReadFrequently: true });
  context.drawImage(bitmap, 0, 0);
  bitmap.close();
  return context.getImageData(0, 0, context.canvas.width, context.canvas.height);
}

async function encodeThumbnail(grey, width, height) {
  const pixels = new ImageData(width, height);
  for (let i = 0; i < grey.length; ++i) {
    pixels.data.fill(grey[i], 4 * i, 4 * i + 3);
    pixels.data[4 * i + 3] = 255;
  }
  const canvas = new OffscreenCanvas(width, height);
  canvas.getContext("2d").putImageData(pixels, 0, 0);
  const file = await canvas.convertToBlob({ type: "image/jpeg", quality: 0.9 });
  return new Uint8Array(await file.arrayBuffer());
}

/** Degrees between the edges of a narrow picture, and how they are known; 0: it shows all azimuths. */
async function findFieldOfView(picture, { width, height }, stated) {
  if (stated) return { degrees: stated, origin: "stated" };
  if (description.kind === "mirror" || width >= 1.9 * height) return { degrees: 0, origin: "shape" };
  const head = 131072;  // bytes; the data stand before the picture
  const degrees = picture instanceof Blob
    ? (await loading).findFieldOfView(new Uint8Array(await picture.slice(0, head).arrayBuffer()), width, height) : 0;
  const usualPhone = 65;
  return degrees > 0 ? { degrees, origin: "file" } : { degrees: usualPhone, origin: "guess" };
}

const tasks = {
  async open({ bytes }) {
    const panonav = await loading;
    const opened = panonav.open(new Uint8Array(await new Response(bytes).arrayBuffer()));
    memory?.close();
    memory = opened;
    description = JSON.parse(memory.describe());
    return description;
  },
  /** `fieldOfView`: degrees between the edges of a narrow picture, where they are known. */
  async localise({ picture, name, fieldOfView }) {
    const begin = performance.now();
    const pixels = await decode(picture, name);
    const decoded = performance.now();
    const shown = await findFieldOfView(picture, pixels, fieldOfView);
    if (shown.degrees > 0 && !description.takes_narrow_pictures) {
      throw new Error(`${name} does not show all directions. This memory takes 360° pictures alone, which are twice as wide as high`);
    }
    const answer = JSON.parse(memory.localise(pixels, name, shown.degrees));
    return { answer, shown, decode_ms: decoded - begin, localise_ms: performance.now() - decoded };
  },
  thumbnail({ view }) {
    return memory.thumbnail(view);
  },
  async begin() {
    maker?.discard();
    maker = (await loading).make(encodeThumbnail);
  },
  async add({ file, name }) {
    await maker.add(await decode(file, name), name);
  },
  async finish() {
    const finished = maker;
    maker = null;
    return finished.finish();
  },
  discard() {
    maker?.discard();
    maker = null;
  },
};

let last = Promise.resolve();
self.onmessage = ({ data: { id, task, values } }) => {
  last = last.then(async () => {
    try {
      self.postMessage({ id, result: await tasks[task](values) });
    } catch (error) {
      self.postMessage({ id, error: String(error?.message ?? error) });
    }
  });
};
