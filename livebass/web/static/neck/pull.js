// Pulls the string itself: in the side view with mouse or finger, or by numbers. The string is drawn as the hand holds it;
// when the hand lets go, the worker makes its motion and sound from just these numbers.
import {doneBy, tell} from "./line.js";
import {$, PAGE, busy, chosenBass, say} from "../pages/page.js";
import {player} from "../audio/player.js";
import {fretText, noteText} from "./places.js";
import {Held} from "./pulled.js";
import {RINGS, backToNow, keepPull, move, showSlowly} from "./replay.js";
import {hear} from "../audio/sounds.js";
import {POINTS, SHOWN} from "./see.js";
import {pictures, see} from "./view.js";
import {workshop} from "../audio/workshop.js";

const MOVED = 3; // px that a pointer moves before it pulls
const MM = 1e-3, DEGREE = Math.PI / 180;
const STOPS = {"": "", hardest: " The player pulls no harder there.", frets: " The frets are near: no farther down.", board: " The board is near: no farther down."};

/** @typedef {{string: number, fret: number, file: ArrayBuffer, held: Held, label: string, name: string}} Taken */
/** @typedef {{x: number, y: number}} Point px in the side view */

/** @type {{pointer?: number, begin?: Point, at?: Point, ended?: boolean, taken?: Taken, grip?: import("./pulled.js").Grip}} */
export const hand = {};
/** @type {{key?: string, promise?: Promise<Taken>}} */
const last = {}; // the string that was taken last

// The string that the side view shows, with what a hand needs to pull it.
/** @returns {Promise<Taken>} */
function take() {
  const bass = chosenBass(), {string, fret = 0} = see.held || see.note;
  const label = player.labelOf(bass.name), key = `${label} ${string} ${fret}`;
  if (last.key === key && last.promise) return last.promise;
  const promise = hold(bass, string, fret);
  Object.assign(last, {key, promise});
  promise.catch(() => { if (last.promise === promise) last.promise = undefined; });
  return promise;
}

/**
 * What a hand needs to pull a string of a bass, stopped at a fret.
 * @param {Bass} bass
 * @param {number} string
 * @param {number} fret
 * @returns {Promise<Taken>}
 */
export async function hold(bass, string, fret) {
  const {name} = bass, note = bass.strings[string].note + fret, label = player.labelOf(name), file = await player.fileOf(name);
  const of = {hold: {string, fret, note}, tier: PAGE.tier, rate: player.context.sampleRate, file: file.slice(0)};
  const found = await workshop.ask(of, [of.file]), {frets, heights, length} = bass.strings[string];
  const stop = stopOf(bass, string, fret), end = see.restOf(heights, fret);
  const rest = (/** @type {number} */ x) => end * (length - x) / (length - stop);
  /** @type {[number, number][]} */
  const crowns = frets.flatMap((x, k) => x > stop + 1e-6 ? [[x - stop, Math.max(rest(x) - heights[k], 0)]] : []);
  return {string, fret, file, label, name, held: new Held(found, crowns)};
}

// The place of a string's stop, m from the nut.
const stopOf = (/** @type {Bass} */ bass, /** @type {number} */ string, /** @type {number} */ fret) =>
  fret ? bass.strings[string].frets[fret - 1] : 0;

const angle = () => +$("pull-angle").value * DEGREE;

// --- the string in the hand ---

// Holds the string as near to `apex` (m) at `place` (m from its stop) as the hand can, draws and says it.
function holdAt(/** @type {Taken} */ taken, /** @type {number} */ place, /** @type {number} */ apex) {
  const {string, fret, held} = taken, bass = chosenBass(), grip = held.grip(place, apex), {length} = held;
  if (see.replay) backToNow();
  if (!see.held) see.grasp(string, fret, held.highest);
  const xs = Array.from({length: POINTS + 1}, (_, k) => length * k / POINTS);
  const end = see.restOf(bass.strings[string].heights, fret), up = Math.cos(angle()) * grip.apex, aside = Math.sin(angle()) * grip.apex;
  const shape = held.shape(grip.place, [...xs, grip.place]), top = /** @type {number} */ (shape.pop());
  const rest = (/** @type {number} */ x) => end * (1 - x / length);
  see.hold({string, fret, length, u: Float32Array.from(xs, (x, k) => rest(x) + up * shape[k]), v: Float32Array.from(shape, x => aside * x),
            place: grip.place, height: rest(grip.place) + up * top});
  Object.assign(hand, {taken, grip});
  showNumbers();
  tell(`${said(pullOf(taken, grip))}.${STOPS[grip.stop === "frets" && bass.fretless ? "board" : grip.stop]}`);
}

// Does so for a pointer in the side view.
function follow(/** @type {Taken} */ taken, /** @type {Point} */ {x, y}) {
  const {string, fret, held} = taken, bass = chosenBass(), end = see.restOf(bass.strings[string].heights, fret);
  if (!see.held) holdAt(taken, held.length / 2, 0); // the picture makes room
  pictures.see.needed = true;
  pictures.draw(player.analyser);
  const {place, height} = pictures.sideAt(x, y), at = held.within(place - stopOf(bass, string, fret));
  const [top] = held.shape(at, [at]);
  holdAt(taken, at, (height - end * (1 - at / held.length)) / (top * Math.cos(angle())));
}

/** @param {Taken} taken @param {import("./pulled.js").Grip} grip @returns {Pull} */
const pullOf = ({string, fret}, {place, apex}) => ({string, fret, place, apex, angle: angle()});

// "E string, fret 3: pulled 4.00 mm, 500 mm from fret 3"
export function said(/** @type {Pull} */ {string, fret, place, apex, angle}) {
  const bass = chosenBass(), {strings, capo, fretless} = bass, end = capo ? "the capo" : "the nut";
  const stop = !fret ? end : fretless ? "the finger" : fretText(bass, string, fret);
  const aside = angle ? `, ${Math.round(angle / DEGREE)}° across` : "", way = apex < 0 ? ` towards the ${fretless ? "board" : "frets"}` : aside;
  return `${fret && fretless ? noteText(bass, string, fret) : `${strings[string].name} string`}: pulled ${Math.abs(apex / MM).toFixed(2)} mm${way}, ${Math.round(place / MM)} mm from ${stop}`;
}

// Lets go of the string that the hand holds.
async function letGo() {
  const {taken, grip} = hand;
  if (!taken || !grip) return;
  const pull = pullOf(taken, grip), sounds = player.sound();
  Object.assign(hand, {taken: undefined, grip: undefined});
  const made = await move({pulled: pull}, taken.file, RINGS);
  if (hand.taken) return; // the hand has it again
  const replay = showSlowly(made), {heights} = chosenBass().strings[pull.string];
  keepPull({name: taken.name, label: taken.label, file: taken.file, heights: {[pull.string]: heights}, pulled: pull}, replay);
  tell(`${said(pull)}: ${doneBy(replay)} in its first ${SHOWN.after} s.`);
  sounds.then(() => { if (see.replay === replay) hear([made.sound]); }, () => {});
}

function drop() {
  Object.assign(hand, {pointer: undefined, taken: undefined, grip: undefined});
  if (see.held) see.drop();
}

const failed = (/** @type {Error} */ error) => {
  drop();
  say(`The string cannot be pulled: ${error.message}`);
};

// --- by mouse and finger ---

const pointOf = (/** @type {PointerEvent} */ e) => {
  const {left, top} = $("side").getBoundingClientRect();
  return {x: e.clientX - left, y: e.clientY - top};
};

// A pointer that moved takes the string, once the worker has it; one that has left meanwhile lets go.
async function grab(/** @type {number} */ pointer) {
  const taken = await take();
  if (hand.pointer !== pointer || !hand.at || !hand.begin) return;
  if (Math.hypot(hand.at.x - hand.begin.x, hand.at.y - hand.begin.y) > MOVED || hand.taken) follow(taken, hand.at);
  if (!hand.ended) return;
  hand.pointer = undefined;
  await letGo();
}

$("side").addEventListener("pointerenter", () => { if (player.ready && !PAGE.watching) take().catch(() => {}); });
$("side").addEventListener("pointerdown", e => {
  if (e.button || hand.pointer !== undefined || !player.ready || PAGE.watching) return;
  $("side").setPointerCapture(e.pointerId);
  const at = pointOf(e);
  Object.assign(hand, {pointer: e.pointerId, begin: at, at, ended: false, taken: undefined, grip: undefined});
  grab(e.pointerId).catch(failed);
});
$("side").addEventListener("pointermove", e => {
  if (e.pointerId !== hand.pointer || hand.ended) return;
  hand.at = pointOf(e);
  grab(e.pointerId).catch(failed);
});
$("side").addEventListener("pointerup", e => {
  if (e.pointerId !== hand.pointer || hand.ended) return;
  Object.assign(hand, {at: pointOf(e), ended: true});
  grab(e.pointerId).catch(failed);
});
$("side").addEventListener("pointercancel", e => { if (e.pointerId === hand.pointer) drop(); });

// --- by numbers ---

function showNumbers() {
  const {taken, grip} = hand;
  if (taken && grip) {
    Object.assign($("pull-place"), {max: Math.floor((taken.held.length / MM) - 10), value: grip.place / MM});
    $("pull-apex").value = String(grip.apex / MM);
  }
  const texts = {place: `${Math.round(+$("pull-place").value)} mm`, angle: +$("pull-angle").value ? `${$("pull-angle").value}° across` : "up",
                 apex: `${(+$("pull-apex").value).toFixed(2).replace("-", "−")} mm`};
  for (const [name, text] of Object.entries(texts)) {
    const slider = $(/** @type {"pull-place"} */ (`pull-${name}`));
    $(/** @type {"pull-place-text"} */ (`pull-${name}-text`)).textContent = slider.ariaValueText = text;
  }
}

async function holdByNumbers() {
  showNumbers();
  const place = +$("pull-place").value * MM, apex = +$("pull-apex").value * MM, taken = await take();
  holdAt(taken, place, apex);
}

for (const id of /** @type {const} */ (["pull-place", "pull-apex", "pull-angle"]))
  $(id).oninput = () => { if (player.ready) holdByNumbers().catch(failed); };
$("pull").onclick = () => {
  const sounds = player.sound(); // browsers want it within the press
  sounds.catch(() => {});
  busy($("pull"), (hand.grip ? Promise.resolve() : holdByNumbers()).then(letGo)).catch(failed);
};
player.on("struck", () => { if (see.held) drop(); });
showNumbers();
