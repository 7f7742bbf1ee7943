// Runs before the page is drawn, so that nothing moves later: the room for what the page's address shows.
(() => {
  const [basses] = /** @type {[string, number, boolean][][]} */ (/** @type {any} */ (["BASSES"])); // name, strings, has the paper's cases
  const {body} = document, requested = new URLSearchParams(location.hash.slice(1)), like = requested.get("like");
  const shown = basses.find(([name, , cases]) => requested.has("case") ? cases : name === like) ?? basses[0];
  if (shown) body.style.setProperty("--strings", String(shown[1]));
  body.classList.toggle("embed", new URLSearchParams(location.search).has("embed"));
  body.classList.toggle("in-story", requested.has("story"));
})();
