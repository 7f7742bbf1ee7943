// The computer's keys: letters play a piano, digits choose strokes and ways.
import {$, NAMES, make, noteName, say} from "../pages/page.js";
import {force, press, release} from "./hands.js";
import {state} from "../pages/state.js";
import {STROKES, WAYS, hold, letGoOf, pluckWith} from "./techniques.js";

// The keys in the shape of a piano, from E up by semitones
const CODES = "KeyA KeyS KeyE KeyD KeyR KeyF KeyT KeyG KeyH KeyU KeyJ KeyI KeyK KeyL KeyP Semicolon".split(" ");
/** @type {Record<string, "octave-down" | "octave-up">} */
const OCTAVES = {KeyZ: "octave-down", KeyX: "octave-up"};
const DIGITS = [1, 2, 3, 4, 5, 6, 7, 8, 9, 0].map(n => `Digit${n}`);
const LOWEST = 4, HIGHEST = 76; // range of the keys' first note

// --- their letters ---

// The letters printed on the player's keyboard, by code: Chromium tells them all; elsewhere each is learned when first
// pressed, and until then is a US keyboard's.
/** @type {Map<string, string>} */
const letters = new Map();
const letterOf = (/** @type {string} */ code) => letters.get(code) || (code === "Semicolon" ? ";" : code.slice(3));

// Learns a key's letter; true if it is new. Names of keys, such as "Dead", do not count.
function learn(/** @type {string} */ code, /** @type {string | undefined} */ text) {
  const letter = text?.toUpperCase();
  if (letter?.length !== 1 || letter === letterOf(code)) return false;
  letters.set(code, letter);
  return true;
}

navigator.keyboard?.getLayoutMap?.().then(map => {
  for (const code of [...CODES, ...Object.keys(OCTAVES)]) learn(code, map.get(code));
  showKeys();
}, () => {});

// --- the piano ---

function makePiano() {
  let white = 0;
  for (const [k, code] of CODES.entries()) {
    const black = NAMES[(state.octave + k) % 12].length > 1;
    const key = make("button", {type: "button", className: black ? "black" : "white"}, make("b"), make("small"));
    key.dataset.key = code;
    key.style.setProperty("--at", String(black ? white : white++));
    $("piano").append(key);
  }
}

// Writes notes and letters on the keys.
function showKeys() {
  $("piano").querySelectorAll("button").forEach((key, k) => {
    const note = state.octave + k, letter = letterOf(CODES[k]), [first, last] = key.children;
    key.dataset.note = String(note);
    first.textContent = letter;
    last.textContent = ["C", "E"].includes(NAMES[note % 12]) ? noteName(note) : "";
    key.setAttribute("aria-label", `${noteName(note)}, key ${letter}`);
  });
  for (const [code, id] of Object.entries(OCTAVES)) {
    /** @type {Element} */ ($(id).lastElementChild).textContent = letterOf(code);
    $(id).setAttribute("aria-label", `Octave ${id.slice(7)}, key ${letterOf(code)}`);
  }
}

function shiftOctave(/** @type {number} */ by) {
  if (state.octave + by < LOWEST || state.octave + by > HIGHEST) return;
  state.octave += by;
  showKeys();
  say(`Keys from ${noteName(state.octave)}.`);
}

$("octave-down").onclick = () => shiftOctave(-12);
$("octave-up").onclick = () => shiftOctave(12);
addEventListener("keydown", e => {
  if (e.repeat || e.ctrlKey || e.metaKey || e.altKey) return;
  const number = DIGITS.indexOf(e.code);
  if (number >= 0) {
    e.preventDefault();
    if (number < STROKES.length) pluckWith(STROKES[number]);
    else hold(WAYS[number - STROKES.length], e.code);
    return;
  }
  const k = CODES.indexOf(e.code);
  if (k < 0 && !OCTAVES[e.code]) return;
  e.preventDefault(); // else letters would choose from the list of basses
  if (!e.shiftKey && learn(e.code, e.key)) showKeys();
  if (k >= 0) press(e.code, state.octave + k, force(), e.timeStamp, $("piano").querySelectorAll("button")[k]);
  else $(OCTAVES[e.code]).click();
});
addEventListener("keyup", e => {
  release(e.code, e.timeStamp);
  letGoOf(e.code);
});
makePiano();
showKeys();
