// A service worker: keeps the files of an export for use without a network. The export writes their names here.
const KEPT = `livebass ${registration.scope} `, NAME = KEPT + "DIGEST", FILES = ["FILES"];

addEventListener("install", e => e.waitUntil(caches.open(NAME).then(kept => kept.addAll(FILES)).then(() => skipWaiting())));
addEventListener("activate", e => e.waitUntil(caches.keys().then(names =>
  Promise.all(names.filter(name => name.startsWith(KEPT) && name !== NAME).map(name => caches.delete(name))))));

// The page itself comes from the network where there is one, so that a newer export is seen; its files bear its digest.
addEventListener("fetch", e => {
  const {request} = e;
  if (request.mode === "navigate") e.respondWith(fetch(request).catch(() => caches.match("./")));
  else e.respondWith(caches.match(request).then(kept => kept || fetch(request)));
});
