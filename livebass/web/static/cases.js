// The paper's cases: plucks of its string without the player model, shown slowly, with sound if wanted.
import {$, PAGE, chooseBass, makeButton, say} from "./page.js";
import {player} from "./player.js";
import {tell} from "./line.js";
import {move, showSlowly} from "./replay.js";
import {hear} from "./sounds.js";

export const paperBass = () => PAGE.basses.find(({cases}) => cases.length);

// Shows a case on the bass with its bench settings.
export async function showCase(/** @type {Case} */ {apex, place, width, tier, says}, heard = true) {
  const {name} = /** @type {Bass} */ (paperBass());
  chooseBass(name);
  if (heard) await player.sound();
  const made = await move({pluck: {apex, place, width}, tier}, await player.fileOf(name));
  showSlowly(made);
  tell(says);
  if (heard) hear([made.sound]);
}

const failed = (/** @type {Error} */ error) => say(`The case cannot be shown: ${error.message}`);

// Shows the case in the page's address, if there is one, and returns whether there is; it is silent until somebody asks
// for sound.
export function showLinked() {
  const symbol = new URLSearchParams(location.hash.slice(1)).get("case");
  if (symbol === null) return false;
  const one = paperBass()?.cases.find(one => one.symbol === symbol);
  if (one) showCase(one, false).catch(failed);
  else say(`The link names no case of this page: case=${symbol.slice(0, 20)}.`);
  return true;
}

for (const one of paperBass()?.cases || [])
  $("cases").append(makeButton(one.title, {id: `case-${one.symbol}`, onclick: () => showCase(one).catch(failed)}));
$("cases").hidden = !paperBass();
addEventListener("hashchange", () => { if (player.ready) showLinked(); });
