// The sentence under the neck: what the page is, what the last note did, what a replay shows.
import {$, chosenBass, noteName} from "../pages/page.js";
import {player} from "../audio/player.js";
import {fretText, hitText, noteText} from "./places.js";
import {FULL_SPEED} from "./see.js";
import {see} from "./view.js";

export const tell = (/** @type {string} */ text) => { $("seen").textContent = text; };

export const contactsOf = (/** @type {number} */ count) => count === 1 ? "1 contact" : `${count} contacts`;

// What a string does that frets out: "it lies on fret 20, with 12 contacts". On a board these are beyond its place.
function lies(/** @type {number} */ string, /** @type {number} */ on, /** @type {number} */ count) {
  const bass = chosenBass(), beyond = bass.fretless ? " beyond" : "";
  return `it lies on ${fretText(bass, string, on)}${count ? `, with ${contactsOf(count)}${beyond}` : ""}`;
}

// What is left of such a note: ", and dies away at D♯4". On a board it rings on.
function left(/** @type {number} */ string, /** @type {number} */ on) {
  const {fretless, strings} = chosenBass();
  return fretless ? "" : `, and dies away at ${noteName(strings[string].note + on)}`;
}

// What the note of a replay does: "12 contacts", or what `lies` says.
export function doneBy(/** @type {Replay} */ replay) {
  const on = see.liesOn(replay), {length} = replay.hits;
  return on ? lies(replay.string, on, length) : contactsOf(length);
}

// The higher fret that a note's string lies on at rest; undefined: it lies on its own.
function liesOn(/** @type {SeenNote} */ {string, fret = 0, of = 0}) {
  return (player.basses.get(of)?.rests ?? chosenBass().strings.map(({rests}) => rests))[string]?.[fret];
}

// Tells what a note did: "E string, fret 3: 7 contacts; it hits fret 4 hardest."
export function tellNote(/** @type {SeenNote} */ note) {
  const {string, fret = 0, contacts} = note, bass = chosenBass(), on = liesOn(note), where = noteText(bass, string, fret);
  if (on) return tell(`${where} frets out: ${lies(string, on, contacts.length)}${left(string, on)}. Raise the action to free it.`);
  if (!contacts.length) return tell(`${where}: it touches nothing. Press lower on the string to play harder.`);
  const hardest = contacts.reduce((a, b) => a.speed >= b.speed ? a : b);
  return tell(`${where}: ${contactsOf(contacts.length)}; it hits ${hitText(bass, hardest.fret)} hardest.`);
}

player.on("reported", tellNote);
player.on("kept", note => { // a fret that a string lies on flashes like one that is hit
  const {string} = note, on = liesOn(note), {fretless, strings} = chosenBass();
  if (on) see.light({string, fret: fretless ? strings[string].frets[on - 1] : on, speed: FULL_SPEED}, 1, performance.now());
});
