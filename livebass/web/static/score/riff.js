// A riff in a link: the last notes that somebody played, with their times, lengths and stroke.
import {$, make, say} from "../pages/page.js";
import {player} from "../audio/player.js";
import {tell} from "../neck/line.js";
import {state} from "../pages/state.js";
import {STROKES, pluckWith} from "../neck/techniques.js";
import {Transport} from "./transport.js";

const MAXIMUM = 16; // notes
const PAUSE = 3000; // ms after which a new riff begins
const LONGEST = 60000; // ms
const NOTE = /^(\d{1,5})\.(\d{1,3})\.(\d{1,3})\.(\d{1,5})$/; // begin (ms), key, velocity, length (ms)
/** @typedef {{time: number, key: number, velocity: number, length?: number}} RiffNote */
/** @type {RiffNote[]} */
let played = [];
/** @type {number[][]} */
let offered = [];

function keep(/** @type {number[]} */ [status, key, velocity], /** @type {number} */ time) {
  const on = (status & 0xf0) === 0x90 && velocity > 0, off = (status & 0xe0) === 0x80 && !on;
  if (off) {
    const note = played.find(note => note.key === key && note.length === undefined);
    if (note) note.length = time - note.time;
  } else if (on && key >= 20) { // lower keys switch techniques
    const last = played.at(-1);
    if (last && time - last.time > PAUSE) played = [];
    played = [...played, {time, key, velocity}].slice(-MAXIMUM);
  }
}

// The part of a link for the last notes; empty if there are none.
export function riffParts() {
  if (!played.length) return {};
  const [{time: first}] = played, whole = (/** @type {number} */ ms) => Math.round(Math.min(ms, LONGEST));
  const riff = played.map(({time, key, velocity, length = 500}) =>
    [whole(time - first), key, velocity, whole(length)].join(".")).join("_");
  return {riff, ...state.stroke && {stroke: state.stroke.symbol}};
}

// The notes of a link; throws an Error, one line, for others.
export function readRiff(/** @type {string} */ text) {
  const notes = text.split("_").map(one => (NOTE.exec(one) || []).slice(1).map(Number));
  const isWrong = (/** @type {number[]} */ [begin, key, velocity, length]) =>
    length === undefined || key > 127 || velocity > 127 || begin > LONGEST || length > LONGEST;
  if (notes.length > MAXIMUM || notes.some(isWrong))
    throw new Error(`the link's riff cannot be read: ${text.slice(0, 30)}`);
  return notes;
}

// The messages of a riff for the context, [frame, status, data, data] each.
function messages() {
  const frames = (/** @type {number} */ ms) => Math.round(ms / 1000 * player.context.sampleRate);
  return Int32Array.from(offered.flatMap(([begin, key, velocity, length]) =>
    [[frames(begin), 0x90, key, velocity], [frames(begin + length), 0x80, key, 0]]).sort((a, b) => a[0] - b[0]).flat());
}

const transport = new Transport({messages, quiet: () => player.change({panic: true})}, $("riff"), make("button"));

// Offers the riff of an address, by its text from the # on.
export function offerRiff(/** @type {string} */ hash) {
  const requested = new URLSearchParams(hash.slice(1)), text = requested.get("riff"), stroke = requested.get("stroke");
  $("riff").hidden = text === null;
  if (text === null) return;
  try {
    offered = readRiff(text);
    transport.open([], Math.max(...offered.map(([begin, , , length]) => begin + length)) / 1000);
    const found = STROKES.find(({symbol}) => symbol === stroke);
    if (found) pluckWith(found);
    if (!requested.has("moment") && !requested.has("pulled")) tell("A friend's notes on this bass: play the riff, or press a string.");
  } catch (error) {
    $("riff").hidden = true;
    say(`${/** @type {Error} */ (error).message}.`);
  }
}

player.on("sent", keep);
