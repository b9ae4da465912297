// A memory from pictures: which files of a drop or choice they are, and the work of the engine.

const is_picture = (name) => /\.(png|jpe?g)$/i.test(name);
const compare = (a, b) => (a.name < b.name ? -1 : a.name > b.name ? 1 : 0);

/** The files of a dropped folder with their paths, in no order. */
async function readEntry(entry, path, files) {
  if (entry.isFile) {
    const file = await new Promise((resolve, reject) => entry.file(resolve, reject));
    files.push({ file, name: path + entry.name });
    return;
  }
  const reader = entry.createReader();
  for (;;) {  // a reader lists about a hundred entries at once
    const entries = await new Promise((resolve, reject) => reader.readEntries(resolve, reject));
    if (entries.length === 0) return;
    for (const inner of entries) await readEntry(inner, `${path}${entry.name}/`, files);
  }
}

/** Returns what was dropped: {files: [{file, name}], folder: its name or null}. Names begin below the folder. */
export async function readDrop(transfer) {
  const entries = [...transfer.items].map((item) => item.webkitGetAsEntry?.()).filter(Boolean);
  const files = [];
  for (const entry of entries) {
    const inner = [];
    await readEntry(entry, "", inner);
    const only = entries.length === 1 && entry.isDirectory;
    files.push(...inner.map(({ file, name }) => ({ file, name: only ? name.slice(entry.name.length + 1) : name })));
  }
  return { files, folder: entries.find((entry) => entry.isDirectory)?.name ?? null };
}

/** Returns the same for the files of an <input>. */
export function readChoice(input) {
  const files = [...input.files].map((file) => {
    const path = file.webkitRelativePath;
    return { file, name: path ? path.slice(path.indexOf("/") + 1) : file.name };
  });
  const path = input.files[0]?.webkitRelativePath;
  return { files, folder: path ? path.slice(0, path.indexOf("/")) : null };
}

export const picturesOf = (files) => files.filter(({ name }) => is_picture(name)).sort(compare);

/**
 * Makes a memory: resolves to {bytes, skipped}; null if `is_stopped()` became true. Pictures that cannot be read are
 * skipped; throws an Error if none can be.
 */
export async function makeMemory(engine, pictures, show, is_stopped) {
  const skipped = [];
  await engine.begin();
  for (let i = 0; i < pictures.length; ++i) {
    show(i, pictures.length);
    try {
      await engine.add(pictures[i]);
    } catch (error) {
      skipped.push(`${pictures[i].name}: ${error.message}`);
    }
    if (is_stopped()) {
      await engine.discard();
      return null;
    }
  }
  show(pictures.length, pictures.length);
  if (skipped.length === pictures.length) {
    await engine.discard();
    throw new Error(`No picture can be used. ${skipped[0]}`);
  }
  return { bytes: new Blob([await engine.finish()]), skipped };
}
