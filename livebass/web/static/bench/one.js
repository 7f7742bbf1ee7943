// On phones one slider of the bench stays in sight under neck and side view: the last one that moved, or one chosen from a
// list. When it is let go, the last pluck is played again on the changed bass.
import {PHONE, bench, building, shown} from "./benchview.js";
import {$, say} from "../pages/page.js";
import {player} from "../audio/player.js";
import {kept, playSame} from "../neck/replay.js";

const FIRST = "action";
const phone = matchMedia(PHONE), place = document.createComment("the slider that is in sight");
const chosen = {symbol: FIRST};

// Puts the chosen slider's row beside the bench while that is folded, and back otherwise.
function putRow() {
  const row = $("one-row").firstElementChild, list = $("one"), b = bench();
  if (row && place.parentNode) place.replaceWith(row);
  $("one-row").replaceChildren();
  const isShown = phone.matches && !document.body.classList.contains("embed") && b && !$("bench-fold").open;
  $("one-bar").hidden = !isShown;
  if (!isShown) return;
  if (!b.controls.has(chosen.symbol)) chosen.symbol = b.controls.has(FIRST) ? FIRST : b.controls.keys().next().value;
  list.replaceChildren(...[...b.controls.values()].map(({name, symbol}) => new Option(name, symbol)));
  list.value = chosen.symbol;
  const wanted = $(`bench-${chosen.symbol}`)?.parentElement;
  if (!wanted) return;
  wanted.replaceWith(place);
  $("one-row").append(wanted);
}

function choose(/** @type {string} */ symbol) {
  if (chosen.symbol === symbol) return;
  chosen.symbol = symbol;
  putRow();
}

// Plays the last pluck on the changed bass, once that is made.
async function playChanged() {
  while (building.now || building.wanted) await new Promise(done => setTimeout(done, 20));
  if (player.sounding && kept.note && kept.note.label !== player.labelOf(kept.note.name)) await playSame();
}

$("one").onchange = () => choose($("one").value);
$("bench").addEventListener("input", e => {
  const {symbol} = /** @type {HTMLElement} */ (e.target).dataset;
  if (symbol && $("bench-fold").open) chosen.symbol = symbol;
});
$("bench").addEventListener("change", e => {
  const {symbol} = /** @type {HTMLElement} */ (e.target).dataset;
  if (symbol && phone.matches) playChanged().catch((/** @type {Error} */ error) => say(`The note cannot be repeated: ${error.message}`));
});
$("bench-fold").addEventListener("toggle", putRow);
phone.addEventListener("change", putRow);
shown.also = putRow;
putRow();
