// What a hand can do to a string before it lets go: where it can pull it, how far, and the shape that it then has. No DOM;
// the numbers come from the kernels (`Engine.hold`).
const MM = 1e-3;
const ENDS = 10 * MM; // m from the stop and from the saddle: a finger finds no place there
const PRESSED = 0.8; // part of the way to the frets that a hand pulls a string towards them, as in the kernels
const FINEST = {place: 0.1 * MM, apex: 1e-6}; // m: links and sentences say these numbers whole

/** @typedef {{place: number, apex: number, stop: "" | "hardest" | "frets"}} Grip m from the stop; what holds it back */

const rounded = (/** @type {number} */ x, /** @type {number} */ step) => Math.round(x / step) * step;

export class Held {
  /**
   * `held`: of the worker. `crowns`: [m from the stop, m below the string's rest line] of each obstacle.
   * @param {HeldString} held
   * @param {[number, number][]} crowns
   */
  constructor({length, weights, hardest, farthest}, crowns) {
    this.length = length;
    this.weights = weights;
    this.hardest = hardest;
    this.farthest = farthest;
    this.crowns = crowns;
  }

  // The apex nearest to `apex` that a hand can give the string at a place nearest to `place`.
  /** @returns {Grip} */
  grip(/** @type {number} */ place, /** @type {number} */ apex) {
    place = rounded(this.within(place), FINEST.place);
    const {up, down} = this.limits(place), held = Math.min(up, Math.max(-down, apex));
    const stop = apex > up ? "hardest" : apex < -down ? "frets" : "";
    return {place, apex: (held < 0 ? -1 : 1) * Math.floor(Math.abs(held) / FINEST.apex + 1e-6) * FINEST.apex, stop};
  }

  within(/** @type {number} */ place) { return Math.min(this.length - ENDS, Math.max(ENDS, place)); }

  // How far (m) a hand can pull the string at a place: up with the force of the player's hardest pluck, but never beyond
  // the farthest; down towards the crowns.
  limits(/** @type {number} */ place) {
    const {length, hardest, farthest} = this, give = (/** @type {number} */ x) => x * (length - x);
    const up = hardest ? hardest.apex * give(place) / give(hardest.place) : farthest;
    const part = (/** @type {number} */ x) => x < place ? x / place : (length - x) / (length - place);
    const down = Math.min(farthest, ...this.crowns.map(([x, below]) => below / part(x)));
    return {up: Math.min(farthest, up), down: PRESSED * Math.max(0, down)};
  }

  // The farthest that it can be pulled anywhere.
  get highest() {
    const places = Array.from({length: 99}, (_, k) => (k + 1) / 100 * this.length);
    return Math.max(...places.map(place => this.limits(place).up));
  }

  // Heights (m) over the string's rest line of a string held 1 m at `place`, at places `xs` (m from the stop).
  shape(/** @type {number} */ place, /** @type {number[]} */ xs) {
    const {length, weights} = this, scale = Math.sqrt(2 / length) / (place * (length - place));
    const modes = weights.map((weight, j) => scale * weight * Math.sin((j + 1) * Math.PI * place / length));
    return xs.map(x => {
      let sum = 0;
      for (let j = 0; j < modes.length; j++) sum += modes[j] * Math.sin((j + 1) * Math.PI * x / length);
      return sum;
    });
  }
}

// A pull as a link has it, and back; undefined for a text that names none.
export const pullText = (/** @type {Pull} */ {string, fret, place, apex, angle}) =>
  [string, fret, Math.round(place / FINEST.place), Math.round(apex / FINEST.apex), Math.round(angle * 180 / Math.PI)].join(".");

/** @returns {Pull | undefined} */
export function readPull(/** @type {string} */ text) {
  const [string, fret, place, apex, degrees] = (/^(\d)\.(\d{1,2})\.(\d{1,5})\.(-?\d{1,5})\.(\d{1,2})$/.exec(text) || []).slice(1).map(Number);
  if (degrees === undefined) return undefined;
  return {string, fret, place: place * FINEST.place, apex: apex * FINEST.apex, angle: degrees * Math.PI / 180};
}
