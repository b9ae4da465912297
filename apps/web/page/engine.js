// Calls of the worker (worker.js): engine.localise({picture, name, fieldOfView}) and so on resolve to its results.

export function startEngine() {
  const worker = new Worker("worker.js", { type: "module" });
  const waiting = new Map();
  let count = 0;
  worker.onmessage = ({ data: { id, result, error } }) => {
    const { resolve, reject } = waiting.get(id);
    waiting.delete(id);
    if (error === undefined) resolve(result);
    else reject(new Error(error));
  };
  worker.onerror = (event) => {
    for (const { reject } of waiting.values()) reject(new Error(event.message || "The page cannot run its program."));
    waiting.clear();
  };
  return new Proxy({}, {
    get: (_, task) => (values = {}, transferred = []) => new Promise((resolve, reject) => {
      waiting.set(++count, { resolve, reject });
      worker.postMessage({ id: count, task, values }, transferred);
    }),
  });
}
