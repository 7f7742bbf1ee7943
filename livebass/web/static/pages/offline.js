// A service worker: keeps the files of an export for use without a network. The export writes their names here: those
// that the page needs, and those that it may need, which are kept one by one once the page has rested (main.js).
const KEPT = `livebass ${registration.scope} `, NAME = KEPT + "DIGEST", FILES = ["FILES"], LATER = ["LATER"];

addEventListener("install", e => e.waitUntil(caches.open(NAME).then(kept => kept.addAll(FILES)).then(() => skipWaiting())));
addEventListener("message", e => e.waitUntil(keepOthers()));

async function keepOthers() {
  const kept = await caches.open(NAME);
  for (const file of LATER) if (!await kept.match(file)) await kept.add(file);
}

addEventListener("activate", e => e.waitUntil(caches.keys().then(names =>
  Promise.all(names.filter(name => name.startsWith(KEPT) && name !== NAME).map(name => caches.delete(name))))));

// The page itself comes from the network where there is one, so that a newer export is seen; its files bear its digest.
addEventListener("fetch", e => {
  const {request} = e;
  if (request.mode === "navigate") e.respondWith(fetch(request).catch(() => caches.match("./")));
  else e.respondWith(caches.match(request).then(kept => kept || fetchAndKeep(request)));
});

// What is fetched is kept.
async function fetchAndKeep(/** @type {Request} */ request) {
  const answer = await fetch(request);
  if (answer.ok && request.method === "GET") await caches.open(NAME).then(kept => kept.put(request, answer.clone()));
  return answer;
}
