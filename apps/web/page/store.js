// Memories kept in this browser (IndexedDB): {name, views, bytes (a Blob)} by id.

const open = () => new Promise((resolve, reject) => {
  const request = indexedDB.open("panonav", 1);
  request.onupgradeneeded = () => request.result.createObjectStore("memories", { keyPath: "id", autoIncrement: true });
  request.onsuccess = () => resolve(request.result);
  request.onerror = () => reject(request.error);
});

async function run(mode, work) {
  const database = await open();
  try {
    return await new Promise((resolve, reject) => {
      const transaction = database.transaction("memories", mode);
      const request = work(transaction.objectStore("memories"));
      transaction.oncomplete = () => resolve(request.result);
      transaction.onabort = () => reject(transaction.error);
    });
  } finally {
    database.close();
  }
}

export const listMemories = () => run("readonly", (store) => store.getAll());
/** Resolves to the id. */
export const keepMemory = (memory) => run("readwrite", (store) => store.add(memory));
export const forgetMemory = (id) => run("readwrite", (store) => store.delete(id));
