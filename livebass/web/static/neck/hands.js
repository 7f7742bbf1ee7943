// Playing by hand: keys, places on the neck, and strings that two hands hold and pluck.
import {$, chosenBass, isPressed, setPressed} from "../pages/page.js";
import {moveControl} from "../bench/controls.js";
import {tell} from "./line.js";
import {player} from "../audio/player.js";
import {state} from "../pages/state.js";
import {LONG_PRESS, WAYS, isOn, letGoOfAll, numberOf} from "./techniques.js";

const MAX_LATE = 2000; // ms: keys pressed earlier than this before the sound runs are forgotten
const HARD = 127; // velocity of the first notes: they hit frets, until somebody has played a soft and a hard one
const SOFTER = 1 / 3; // of a string's lane, from the top: there it is played softly, and below hard
export const tries = {untried: new Set(["soft", "hard"])};
export const SHORTEST = 100; // ms that a note lasts, however short the tap: less, and the string hardly moves
const SOON = 30; // ms after the sound runs, when the others are played
const IN_TIME = {late: 0, frameAt: (/** @type {number} */ time) => player.frameAt(time)}; // the usual clock

/** @type {Map<string, PressedKey>} */
export const held = new Map(); // pressed keys

const noteOn = (/** @type {PressedKey} */ {note, velocity}) => [0x90, note, velocity];
const noteOff = (/** @type {PressedKey} */ {note}) => [0x80, note, 0];

// The velocity of keys.
export const force = () => tries.untried.size ? Math.max(+$("force").value, HARD) : +$("force").value;

/**
 * Presses a key identified by `id`, at `time` (ms). A finger that began early stays as late, with its own clock.
 * @param {string} id
 * @param {number} note
 * @param {number} force
 * @param {number} time
 * @param {HTMLElement | null} [cell]
 * @param {Clock} clock
 */
export function press(id, note, force, time, cell, clock = IN_TIME) {
  if (held.has(id) || note < 0 || note > 127) return;
  end(tapOf(note), time); // the first end of a note ends them all
  const velocity = Math.min(127, Math.max(1, Math.round(force)));
  const string = cell?.dataset.string === undefined ? undefined : +cell.dataset.string;
  /** @type {PressedKey} */
  const key = {note, velocity, string, cell, clock, begin: time, end: undefined};
  held.set(id, key);
  cell?.classList.add("down");
  if (player.sounding) {
    sendLate(key.clock, time, noteOn(key), string);
  } else if (player.loading) {
    state.early.push(key);
    player.sound().catch(() => { state.early = []; }); // reported where it happened
  }
}

function lift(/** @type {PressedKey} */ key, /** @type {number} */ time) {
  key.end = time;
  key.cell?.classList.remove("down");
  if (player.sounding) sendLate(key.clock, time, noteOff(key));
  else state.repeats = false; // its silent motion ends
}

/**
 * Sends a message by a key's clock: waiting in the audio thread, it would hold up later notes.
 * @param {Clock} clock
 * @param {number} time
 * @param {number[]} midi
 * @param {number} [string]
 */
function sendLate({late, frameAt}, time, midi, string) {
  const wait = time + late - performance.now(), go = () => player.send(time, midi, string, frameAt(time));
  if (late && wait > 0) setTimeout(go, wait);
  else go();
}

// Ends the note of a pressed key.
function end(/** @type {string} */ id, time = performance.now()) {
  const key = held.get(id);
  held.delete(id);
  if (key) lift(key, time);
}

const tapOf = (/** @type {number} */ note) => `tap${note}`; // id of a note whose key was only tapped

// Lets go of a key. After a tap its note lasts a little longer.
export function release(/** @type {string} */ id, time = performance.now()) {
  const key = held.get(id);
  if (!key || time >= key.begin + SHORTEST) {
    end(id, time);
    return;
  }
  const tap = tapOf(key.note), last = key.begin + SHORTEST;
  held.delete(id);
  held.set(tap, key);
  setTimeout(() => { if (held.get(tap) === key) end(tap, last); }, last - time);
}

// Plays the keys that were pressed while the sound started: from now on, with their original spacing and lengths.
function playEarly() {
  const oldest = performance.now() - MAX_LATE, keys = state.early.filter(({end = Infinity}) => end > oldest);
  state.early = [];
  if (!keys.length) return;
  const {currentTime, sampleRate} = player.context, first = currentTime + SOON / 1000;
  const begin = Math.max(oldest, keys[0].begin);
  const frameAt = (/** @type {number} */ time) => Math.round(sampleRate * (first + Math.max(0, time - begin) / 1000));
  const clock = {late: performance.now() - begin, frameAt};
  const messages = keys.flatMap(key => {
    key.clock = clock;
    const on = {time: key.begin, midi: noteOn(key), string: key.string};
    return key.end === undefined ? [on] : [on, {time: key.end, midi: noteOff(key), string: undefined}];
  });
  messages.sort((a, b) => a.time - b.time || b.midi[0] - a.midi[0]); // at equal times, new notes first
  for (const {time, midi, string} of messages) sendLate(clock, time, midi, string);
}

export function letGo() {
  for (const id of [...held.keys()]) end(id);
  letGoOfAll();
}

// --- two hands: fingers on the frets hold strings down, a finger over the body plucks them ---

const PLUCK_SPEED = 30; // lanes a second, of the hardest pluck
const AGAIN = 40; // ms after which a finger can pluck a string again
/** @type {Map<number, {string: number, fret: number}>} */
const fingers = new Map(); // each finger on a fret, by its pointer
/** @type {Map<number, RightFinger>} */
const rights = new Map(); // fingers over the body, by pointer

const hasTwoHands = () => isPressed($("hands"));
const plucked = (/** @type {number} */ string) => `string${string}`; // id of the right hand's sounding note
/** @param {number} string @param {number} fret @returns {HTMLElement | null} */
const cellOf = (string, fret) => $("neck").querySelector(`button[data-string="${string}"][data-fret="${fret}"]`);
const cellThere = (/** @type {number} */ string, /** @type {number} */ fret) => cellOf(string, fret) || cellOf(string, 0);
/** @returns {HTMLElement} */
const part = (/** @type {string} */ name) => /** @type {HTMLElement} */ ($("neck").querySelector(name));

// The fret at which the left hand holds a string: its highest; 0: open.
const heldFret = (/** @type {number} */ string) =>
  Math.max(0, ...[...fingers.values()].filter(finger => finger.string === string).map(finger => finger.fret));

// Plucks a string where the left hand holds it.
function pluck(/** @type {number} */ string, /** @type {number} */ force, /** @type {number} */ time) {
  const fret = heldFret(string);
  end(plucked(string), time);
  press(plucked(string), chosenBass().strings[string].note + fret, force, time, cellThere(string, fret));
}

// A left-hand finger came, moved or left: the sounding note continues at the present fret, hammered on or pulled off.
// An open string rings on if it was open before; it ends when a finger lets go of it.
function follow(/** @type {number} */ string, /** @type {number} */ time, lifted = false) {
  const key = held.get(plucked(string)), fret = heldFret(string);
  if (!key) return;
  const note = chosenBass().strings[string].note + fret;
  if (note === key.note) return;
  if (lifted && !fret) {
    end(plucked(string), time);
    return;
  }
  const legato = WAYS.find(way => way.symbol === "legato"), number = legato && numberOf(legato);
  const switches = legato && number !== undefined && !isOn(legato);
  held.delete(plucked(string));
  if (switches) player.changeBy([0xb0, number, 127]);
  press(plucked(string), note, key.velocity, time, cellThere(string, fret), key.clock);
  lift(key, time);
  if (switches) player.changeBy([0xb0, number, 0]);
}

function putFinger(/** @type {number} */ id, /** @type {HTMLElement | undefined} */ cell, /** @type {number} */ time) {
  const before = fingers.get(id), now = cell && {string: Number(cell.dataset.string), fret: Number(cell.dataset.fret)};
  if (before && now && before.string === now.string && before.fret === now.fret) return;
  if (now) fingers.set(id, now);
  else fingers.delete(id);
  if (before && (!now || now.string !== before.string)) follow(before.string, time, true);
  if (now) follow(now.string, time);
  showFingers();
}

function showFingers() {
  $("neck").querySelectorAll(".held").forEach(cell => cell.classList.remove("held"));
  for (const {string, fret} of fingers.values()) if (fret) cellOf(string, fret)?.classList.add("held");
}

// The right hand: a finger that comes down on a sounding string stops it. A finger that crosses a string plucks it
// there: the faster, the harder. A tap also plucks it: the lower on the string, the harder.

// The string at `y`, px from the top of the neck, and how far down in its lane, 0 to 1.
function laneAt(/** @type {number} */ y) {
  const {height} = part(".open").getBoundingClientRect(), count = chosenBass().strings.length;
  const row = Math.min(count - 1, Math.max(0, Math.floor(y / height)));
  return {string: count - 1 - row, down: y / height - row};
}

// Sets the pluck's place to the finger's place on the body.
function pluckAt(/** @type {number} */ x) {
  const body = part(".body"), {left, right} = body.getBoundingClientRect(), begin = Number(body.dataset.begin);
  const {pluck: [nearest, defaultValue, farthest], strings: [{length}]} = chosenBass();
  const aside = (begin + (length - begin) * (x - left) / (right - left)) / length - defaultValue;
  const towards = aside * (farthest - defaultValue) > 0 ? defaultValue - farthest : nearest - defaultValue;
  const value = towards && aside / towards;
  moveControl("pluck_position", Math.min(1, Math.max(-1, value)));
}

const heightOf = (/** @type {PointerEvent} */ e) => e.clientY - $("neck").getBoundingClientRect().top;

function rightDown(/** @type {PointerEvent} */ e) {
  const y = heightOf(e), {string} = laneAt(y);
  end(plucked(string), e.timeStamp);
  rights.set(e.pointerId, {y, time: e.timeStamp, began: e.timeStamp, crossed: false, plucked: []});
}

function rightMoves(/** @type {PointerEvent} */ e, /** @type {RightFinger} */ finger) {
  const y = heightOf(e), tall = part(".open").getBoundingClientRect().height, count = chosenBass().strings.length;
  for (let string = 0; string < count; string++) {
    const middle = (count - 0.5 - string) * tall;
    const across = (finger.y - middle) * (y - middle) < 0;
    // screens predict a finger's place, and take it back
    if (!across || e.timeStamp - finger.plucked[string] < AGAIN) continue;
    finger.plucked[string] = e.timeStamp;
    const speed = Math.abs(y - finger.y) / tall / Math.max(1e-3, (e.timeStamp - finger.time) / 1000);
    pluckAt(e.clientX);
    pluck(string, 30 + 97 * Math.min(1, speed / PLUCK_SPEED), e.timeStamp);
    finger.crossed = true;
  }
  Object.assign(finger, {y, time: e.timeStamp});
}

function rightUp(/** @type {PointerEvent} */ e, /** @type {RightFinger} */ finger) {
  rights.delete(e.pointerId);
  if (finger.crossed || e.timeStamp - finger.began > LONG_PRESS) return;
  const {string, down} = laneAt(finger.y);
  pluckAt(e.clientX);
  pluck(string, forceOf(down), e.timeStamp);
}

// Releases a touch from the element where it began: a finger may slide on.
function loosen(/** @type {PointerEvent} */ e) {
  const target = /** @type {Element} */ (e.target);
  if (target.hasPointerCapture?.(e.pointerId)) target.releasePointerCapture(e.pointerId);
}

$("neck").addEventListener("pointerdown", e => {
  if (e.button || !/** @type {Element} */ (e.target).closest(".body")) return;
  loosen(e);
  rightDown(e);
});
addEventListener("pointermove", e => {
  const finger = rights.get(e.pointerId), moves = finger && e.getCoalescedEvents?.();
  if (finger) for (const one of moves?.length ? moves : [e]) rightMoves(one, finger);
});
$("hands").onclick = () => {
  const on = !hasTwoHands();
  letGo();
  fingers.clear();
  showFingers();
  setPressed($("hands"), on);
  tell(on ? "Hold strings down on the frets, and pluck them over the body: across, or by a tap."
    : "Press low on a string to play it hard.");
};

// --- neck and piano ---

$("force").oninput = () => {
  tries.untried.clear();
  $("force-text").textContent = $("force").value;
};

// The force at a part of a string or key, 0 to 1 from its top: lower is harder.
function forceOf(/** @type {number} */ down) {
  const first = tries.untried.size > 0 && down > SOFTER;
  if (down <= SOFTER) tries.untried.delete("soft");
  else if (down >= 1 - SOFTER) tries.untried.delete("hard");
  return first ? HARD : 30 + 97 * down;
}

function forceAt(/** @type {HTMLElement} */ cell, /** @type {number} */ y) {
  const {top, height} = cell.getBoundingClientRect();
  return forceOf(Math.min(1, Math.max(0, (y - top) / height)));
}

// The cell under a finger: browsers may assign a touch near an edge to the wrong side.
/** @returns {HTMLElement | null | undefined} */
const cellAt = (/** @type {PointerEvent} */ {clientX, clientY}) =>
  document.elementFromPoint(clientX, clientY)?.closest("[data-note]");

for (const place of [$("neck"), $("piano")]) {
  place.addEventListener("pointerdown", e => {
    const cell = cellAt(e);
    if (!cell || e.button) return;
    loosen(e);
    if (hasTwoHands() && cell.dataset.string !== undefined) putFinger(e.pointerId, cell, e.timeStamp);
    else press("pointer" + e.pointerId, Number(cell.dataset.note), forceAt(cell, e.clientY), e.timeStamp, cell);
  });
  place.addEventListener("pointermove", e => {
    const id = "pointer" + e.pointerId, key = held.get(id), cell = cellAt(e);
    if (fingers.has(e.pointerId)) {
      if (cell?.dataset.string !== undefined) putFinger(e.pointerId, cell, e.timeStamp);
      return;
    }
    if (!key || !cell || cell === key.cell) return;
    // along a string the new note begins before the old one ends: it slides or is hammered on
    const along = cell.dataset.string === key.cell?.dataset.string;
    held.delete(id);
    if (!along) lift(key, e.timeStamp);
    press(id, Number(cell.dataset.note), forceAt(cell, e.clientY), e.timeStamp, cell, key.clock);
    if (along) lift(key, e.timeStamp);
  });
  place.addEventListener("pointerup", e => { // browsers allow sound when a finger leaves, not when it comes down
    if (player.loading && held.has("pointer" + e.pointerId) && !player.sounding) player.sound().catch(() => {});
  });
  // Space and Enter play a focused place
  place.addEventListener("keydown", e => {
    /** @type {HTMLElement | null} */
    const cell = /** @type {Element} */ (e.target).closest("[data-note]");
    if (!cell || ![" ", "Enter"].includes(e.key)) return;
    e.preventDefault();
    if (!e.repeat) press("focus", Number(cell.dataset.note), force(), e.timeStamp, cell);
  });
  place.addEventListener("keyup", e => { if ([" ", "Enter"].includes(e.key)) release("focus", e.timeStamp); });
  place.addEventListener("focusout", () => release("focus"));
  place.addEventListener("contextmenu", e => e.preventDefault());
}
for (const kind of /** @type {const} */ (["pointerup", "pointercancel"]))
  addEventListener(kind, e => {
    const finger = rights.get(e.pointerId);
    if (finger) rightUp(e, finger);
    if (fingers.has(e.pointerId)) putFinger(e.pointerId, undefined, e.timeStamp);
    release("pointer" + e.pointerId, e.timeStamp);
  });
addEventListener("blur", letGo);
player.on("sounds", playEarly);
player.on("ends", letGo);
