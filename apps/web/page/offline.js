// Service worker: answers from the network, and without it from what was loaded before.

const files = ["./", "index.html", "page.css", "icon.svg", "main.js", "engine.js", "store.js", "map.js", "camera.js", "answer.js",
  "gallery.js", "making.js", "worker.js", "panonav.js", "panonav_web.mjs", "panonav_web.wasm", "memory.json"];
const name = "panonav";

self.addEventListener("install", (event) => {
  event.waitUntil(caches.open(name).then((cache) => cache.addAll(files)).then(() => self.skipWaiting()));
});
self.addEventListener("activate", (event) => event.waitUntil(self.clients.claim()));
self.addEventListener("fetch", (event) => {
  const { request } = event;
  if (request.method !== "GET" || new URL(request.url).origin !== self.location.origin) return;
  event.respondWith((async () => {
    const cache = await caches.open(name);
    try {
      const response = await fetch(request);
      if (response.ok) await cache.put(request, response.clone());
      return response;
    } catch (error) {
      const kept = await cache.match(request, { ignoreSearch: true });
      if (kept) return kept;
      throw error;
    }
  })());
});
