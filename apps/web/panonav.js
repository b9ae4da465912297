// Memories in a page:
//   const panonav = await loadPanonav();
//   const memory = panonav.open(bytes);                    // of a .panonav file
//   const answer = memory.localise(imageData, "view.jpg"); // what `panonav localise --json` prints
//   const maker = panonav.make();                          // of 360 degree pictures, 2 : 1
//   maker.add(imageData, "one.jpg");
//   const bytes = maker.finish();                          // a .panonav file
// Errors are thrown with the library's message. Pictures are what a canvas's getImageData returns.

import makePanonav from "./panonav_web.mjs";

/** `settings.wasmBinary`: the bytes of panonav_web.wasm, where it is not fetched from beside this file. */
export async function loadPanonav(settings = {}) {
  const wasm = await makePanonav(settings);
  let files = 0;

  const takeText = (at) => {
    const text = wasm.UTF8ToString(at);
    wasm._free(at);
    return text;
  };
  const copyText = (text) => {
    const bytes = wasm.lengthBytesUTF8(text) + 1;
    const at = wasm._malloc(bytes);
    wasm.stringToUTF8(text, at, bytes);
    return at;
  };
  /** Calls `work` with the address for an error, and throws the error that it stored there. */
  const call = (work) => {
    const error = wasm._malloc(4);
    wasm.HEAPU32[error >> 2] = 0;
    try {
      const result = work(error);
      const fault = wasm.HEAPU32[error >> 2];
      if (fault !== 0) throw new Error(takeText(fault));
      return result;
    } finally {
      wasm._free(error);
    }
  };
  const withText = (text, work) => {
    const at = copyText(text);
    try {
      return work(at);
    } finally {
      wasm._free(at);
    }
  };
  const withPicture = (picture, name, work) => {
    const at = wasm._malloc(picture.data.length);
    try {
      wasm.HEAPU8.set(picture.data, at);
      return withText(name, (text) => call((error) => work(at, picture.width, picture.height, text, error)));
    } finally {
      wasm._free(at);
    }
  };
  const newPath = () => `/${++files}.panonav`;

  return {
    open(bytes) {
      const path = newPath();
      wasm.FS.writeFile(path, bytes);
      const memory = withText(path, (at) => call((error) => wasm._panonav_open(at, error)));
      return {
        localise: (picture, name) =>
          takeText(withPicture(picture, name, (...sent) => wasm._panonav_localise(memory, ...sent))),
        close() {
          wasm._panonav_close(memory);
          wasm.FS.unlink(path);
        },
      };
    },
    make() {
      const path = newPath();
      const maker = withText(path, (at) => wasm._panonav_make(at));
      return {
        add: (picture, name) => withPicture(picture, name, (...sent) => wasm._panonav_add(maker, ...sent)),
        finish() {
          call((error) => wasm._panonav_finish(maker, error));
          const bytes = wasm.FS.readFile(path);
          wasm.FS.unlink(path);
          return bytes;
        },
      };
    },
  };
}
