// Memories in a page:
//   const panonav = await loadPanonav();
//   const memory = panonav.open(bytes);                    // of a .panonav file
//   const answer = memory.localise(imageData, "view.jpg"); // what `panonav localise --json` prints
//   const other = memory.localise(photo, "photo.jpg", 67); // a phone's camera sees 67 degrees
//   const maker = panonav.make(encode);                    // of 360 degree pictures, 2 : 1
//   await maker.add(imageData, "one.jpg");
//   const bytes = await maker.finish();                    // a .panonav file
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
  /** Calls `work` with the address of `count` words, and returns its result and the words. */
  const withWords = (count, work) => {
    const at = wasm._malloc(4 * count);
    try {
      return [work(at), ...wasm.HEAPU32.slice(at >> 2, (at >> 2) + count)];
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
        /** `fieldOfView`: degrees between the left and the right edge of a narrow picture; 0: it shows all azimuths. */
        localise: (picture, name, fieldOfView = 0) =>
          takeText(withPicture(picture, name, (...sent) => {
            const error = sent.pop();
            return wasm._panonav_localise(memory, ...sent, fieldOfView, error);
          })),
        /** JSON: kind of the pictures, unit of positions, views. */
        describe: () => takeText(call((error) => wasm._panonav_describe(memory, error))),
        /** The bytes of an image file, or null. */
        thumbnail(view) {
          const [at, size] = withWords(1, (word) => call((error) => wasm._panonav_thumbnail(memory, view, word, error)));
          if (at === 0) return null;
          const copy = wasm.HEAPU8.slice(at, at + size);
          wasm._free(at);
          return copy;
        },
        close() {
          wasm._panonav_close(memory);
          wasm.FS.unlink(path);
        },
      };
    },
    /** Degrees between the edges of a picture of this size, from the first bytes of its JPEG file; 0: not stated. */
    findFieldOfView(bytes, width, height) {
      const at = wasm._malloc(bytes.length);
      wasm.HEAPU8.set(bytes, at);
      try {
        return wasm._panonav_field_of_view(at, bytes.length, width, height);
      } finally {
        wasm._free(at);
      }
    },
    /** `encode` gets grey pixels, width and height of a thumbnail, and resolves to the bytes of its image file. */
    make(encode) {
      const path = newPath();
      const maker = withText(path, (at) => wasm._panonav_make(at));
      const storeWaiting = async (isLast) => {
        for (;;) {
          const [isEncoded, at, width, height] = withWords(3, (words) =>
            call((error) => wasm._panonav_encode_next(maker, isLast ? 1 : 0, words, error)));
          if (isEncoded === 0) return;
          const file = await encode(wasm.HEAPU8.slice(at, at + width * height), width, height);
          const copy = wasm._malloc(file.length);
          wasm.HEAPU8.set(file, copy);
          try {
            call((error) => wasm._panonav_store(maker, copy, file.length, error));
          } finally {
            wasm._free(copy);
          }
        }
      };
      return {
        async add(picture, name) {
          withPicture(picture, name, (...sent) => wasm._panonav_add(maker, ...sent));
          await storeWaiting(false);
        },
        async finish() {
          await storeWaiting(true);
          call((error) => wasm._panonav_finish(maker, error));
          const bytes = wasm.FS.readFile(path);
          wasm.FS.unlink(path);
          return bytes;
        },
        discard: () => wasm._panonav_discard(maker),
      };
    },
  };
}
