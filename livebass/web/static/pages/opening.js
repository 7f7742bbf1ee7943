// Notes that are seen and not heard: a hard note on the chosen bass in the page's first seconds, before anybody has touched
// anything, and what somebody plays where no sound comes.
import {doneBy, tell} from "../neck/line.js";
import {$, chosenBass, say} from "./page.js";
import {player} from "../audio/player.js";
import {goTo, move, showSlowly} from "../neck/replay.js";
import {state} from "./state.js";
import {pictures, see} from "../neck/view.js";

const NOTE = {string: 0, fret: 3, velocity: 127};
const STILL = 0.0005; // s after the first hit, of the still
const NO_SOUND = "No sound comes from this browser: it has no sound device, or holds the page's sound back. Strings move without sound.";

// Shows the note; a still of it where motion is not wanted.
export async function openMoving() {
  const bass = chosenBass(), {string, fret, velocity} = NOTE, note = bass.strings[string].note + fret;
  const file = () => player.fileOf(bass.name); // a link's neck that cannot be played has been replaced the second time
  const made = await file().catch(file).then(file => move({performed: {string, note, velocity}}, file)).catch(() => undefined);
  if (!made || player.sounding || state.early.length || see.replay || bass !== chosenBass()) return;
  const {hits} = showSlowly(made);
  state.repeats = true;
  if (!pictures.still.matches) return;
  state.rolling = false;
  goTo((hits[0]?.frame ?? made.frame) - made.first + STILL * player.context.sampleRate);
  tell("This string is computed, not recorded. Press it, or press Replay to see it move.");
}

// The string on which a key without one is shown: the highest that has the note.
function stringOf(/** @type {number} */ note) {
  const {strings, frets} = chosenBass();
  return strings.findLastIndex(string => note >= string.note && note <= string.note + frets);
}

// Shows what a key's note would have been, again and again while the key is held.
function showSilently(/** @type {Awaited<ReturnType<typeof move>>} */ made, /** @type {typeof state.early[number]} */ key) {
  tell(`Without sound, slowly: ${doneBy(showSlowly(made))}.`);
  state.repeats = key.end === undefined;
}

// Shows the last key that was pressed in vain.
async function showUnheard() {
  const key = state.early.at(-1), bass = chosenBass(), string = key?.string ?? (key ? stringOf(key.note) : -1);
  state.early = [];
  if (!player.isMute) say(NO_SOUND, true);
  if (!key || string < 0) return;
  showSilently(await move({performed: {string, note: key.note, velocity: key.velocity}}, await player.fileOf(bass.name)), key);
}

player.on("soundless", () => { showUnheard().catch(error => say(`The note cannot be shown: ${error.message}`)); });
player.on("sounds", () => { if ($("said").textContent === NO_SOUND) say(""); });
