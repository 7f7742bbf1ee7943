// The paper's cases: plucks of its string without the player model, shown slowly, with sound if wanted.
import {$, PAGE, chooseBass, makeButton, say} from "./page.js";
import {player} from "../audio/player.js";
import {tell} from "../neck/line.js";
import {move, showSlowly} from "../neck/replay.js";
import {hearBy} from "../audio/sounds.js";

export const paperBass = () => PAGE.basses.find(({cases}) => cases.length);

// Shows a case on the bass with its bench settings; returns its sound.
export async function showCase(/** @type {Case} */ {apex, place, width, tier, says}) {
  const {name} = /** @type {Bass} */ (paperBass());
  chooseBass(name);
  const made = await move({pluck: {apex, place, width}, tier}, await player.fileOf(name));
  showSlowly(made);
  tell(says);
  return made.sound;
}

async function hearCase(/** @type {Case} */ one) {
  await player.sound();
  return [await showCase(one)];
}

const failed = (/** @type {Error} */ error) => say(`The case cannot be shown: ${error.message}`);

// The case that a link names, by its text from the # on; null: none.
const linkedCase = (/** @type {string} */ hash) => new URLSearchParams(hash.slice(1)).get("case");

// Chooses the paper's bass if a link names a case.
export function chooseLinked(/** @type {string} */ hash) {
  const bass = paperBass();
  if (bass && linkedCase(hash) !== null) chooseBass(bass.name);
}

// Shows the case that a link names, and returns whether it names one; it is silent until somebody asks for sound.
export function showLinked(/** @type {string} */ hash) {
  const symbol = linkedCase(hash);
  if (symbol === null) return false;
  const one = paperBass()?.cases.find(one => one.symbol === symbol);
  if (one) showCase(one).catch(failed);
  else say(`The link names no case of this page: case=${symbol.slice(0, 20)}.`);
  return true;
}

for (const one of paperBass()?.cases || []) {
  const button = makeButton(one.title, {id: `case-${one.symbol}`, ariaPressed: "false"});
  button.onclick = () => hearBy(button, () => hearCase(one)).catch(failed);
  $("cases").append(button);
}
$("cases").hidden = !paperBass();
addEventListener("hashchange", () => { if (player.ready) showLinked(location.hash); });
