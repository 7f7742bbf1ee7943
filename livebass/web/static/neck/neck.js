// The neck: a cell for each fret of each string, and the body beyond.
import {$, chosenBass, make, noteName} from "../pages/page.js";
import {state} from "../pages/state.js";
import {noteText, spanText} from "./places.js";
import {pictures, see} from "./view.js";

const MIN_FRET = {finger: 30, mouse: 15}; // px
const WIDE = 720; // px of a neck for a mouse
const BODY_PART = 26; // % of the width, if not all frets are shown
const EDGE = 1e-6; // m
const INLAYS = [3, 5, 7, 9, 12, 15, 17, 19, 21, 24]; // frets from the nut

/** @type {{[key: string]: [number, number]}} */
const MOVES = {ArrowLeft: [0, -1], ArrowRight: [0, 1], ArrowUp: [1, 0], ArrowDown: [-1, 0]}; // strings, frets

// The first element of the neck with a selector.
/** @returns {HTMLElement} */
const part = (/** @type {string} */ selector) => /** @type {HTMLElement} */ ($("neck").querySelector(selector));

// How many frets fit, none narrower than a finger: all, with the whole string to scale, or some and less of the rest.
function fitting(/** @type {number} */ width, /** @type {number} */ frets) {
  const mouse = width >= WIDE && !matchMedia("(pointer: coarse)").matches;
  const minimum = mouse ? MIN_FRET.mouse : MIN_FRET.finger;
  if (width * (2 ** (-(frets - 1) / 12) - 2 ** (-frets / 12)) >= minimum) return frets;
  const room = width * (1 - BODY_PART / 100), behind = (/** @type {number} */ count) => 2 ** (-count / 12);
  let count = Math.min(frets - 1, 4);
  while (count < frets - 1 && room * (behind(count) - behind(count + 1)) / (1 - behind(count + 1)) >= minimum) count++;
  return count;
}

// Draws the neck from its first visible fret. A cell's fret counts from the capo, as for the bass; displayed numbers
// count from the nut.
export function showNeck() {
  const bass = chosenBass(), neck = $("neck"), focused = neck.contains(document.activeElement);
  const count = fitting(neck.clientWidth - 64, bass.frets);
  const from = state.from = Math.max(0, Math.min(state.from, bass.frets - count));
  const whole = count === bass.frets, numbers = Array.from({length: count}, (_, k) => from + 1 + k);
  const widths = numbers.map(n => (2 ** (-n / 12) * 100 / 2 ** (-from / 12)).toFixed(2) + "fr");
  const beyond = whole ? `${(100 * 2 ** (-count / 12) / (2 ** (1 / 12) - 1)).toFixed(2)}fr` : `${BODY_PART}%`;
  neck.style.gridTemplateColumns = `3.25rem ${widths.join(" ")} ${beyond}`;
  neck.style.setProperty("--strings", String(bass.strings.length));
  neck.classList.toggle("fretless", bass.fretless);
  neck.classList.toggle("nut", from === 0);
  neck.classList.toggle("broken", from + count < bass.frets);
  neck.classList.toggle("odd", bass.strings.length % 2 === 1);
  const cells = bass.strings.flatMap((_, row) => [0, ...numbers].map(fret => cellOf(bass, row, fret)));
  const inlays = numbers.filter(n => INLAYS.includes(bass.capo + n))
    .flatMap(fret => inlayAt(bass.capo + fret, fret - from + 1));
  neck.replaceChildren(...cells, ...inlays, bodyOf(bass, whole ? bass.strings[0].frets[count - 1] : bass.body));
  see.needed = true;
  part(".open").tabIndex = 0;
  if (focused) part(".open").focus();
  $("window").hidden = whole;
  $("shown").textContent = spanText(bass, from + 1, from + count);
  $("down").disabled = from === 0;
  $("up").disabled = from + count >= bass.frets;
  neck.dataset.count = String(count);
}

/** @param {Bass} bass @param {number} row @param {number} fret */
function cellOf(bass, row, fret) {
  const number = bass.strings.length - 1 - row, string = bass.strings[number], note = string.note + fret;
  const cell = make("button", {type: "button", className: fret ? "fret" : "open", tabIndex: -1});
  cell.setAttribute("aria-label", `${noteText(bass, number, fret)}, ${noteName(note)}`);
  Object.assign(cell.dataset, {note, string: number, fret});
  Object.assign(cell.style, {gridRow: row + 1, gridColumn: fret ? fret - state.from + 1 : 1});
  if (!fret) cell.append(string.name);
  return cell;
}

// The dots in a column of the neck, and their number.
function inlayAt(/** @type {number} */ fret, /** @type {number} */ column) {
  const dot = make("i", {className: fret % 12 ? "inlay" : "inlay two"});
  const number = make("span", {className: "number", textContent: fret, ariaHidden: "true"});
  dot.style.gridColumn = number.style.gridColumn = String(column);
  return [dot, number];
}

// The rest of the strings, from `begin` (m from the nut) to the saddle: pickups, and the right hand's place.
function bodyOf(/** @type {Bass} */ bass, /** @type {number} */ begin) {
  const body = make("div", {className: "body"}), end = bass.strings[0].length;
  body.dataset.begin = String(begin);
  for (const {position, aperture, strings} of bass.pickups) {
    const pickup = make("i", {className: "pickup"}), rows = strings.map(i => bass.strings.length - 1 - i);
    pickup.style.left = `${100 * (end - position - begin) / (end - begin)}%`;
    pickup.style.width = `${100 * aperture / (end - begin)}%`;
    pickup.style.top = `${100 * Math.min(...rows) / bass.strings.length}%`;
    pickup.style.bottom = `${100 * (1 - (Math.max(...rows) + 1) / bass.strings.length)}%`;
    body.append(pickup);
  }
  return body;
}

// Returns a function from a place on a string (m from the nut) to its drawn place (px); undefined: it is not shown.
function placing() {
  const at = $("strings").getBoundingClientRect().left, body = part(".body").getBoundingClientRect();
  /** @type {NodeListOf<HTMLElement>} */
  const cells = $("neck").querySelectorAll('.fret[data-string="0"]');
  const {frets, length} = chosenBass().strings[0], begin = Number(part(".body").dataset.begin);
  const metres = [state.from ? frets[state.from - 1] : 0], pixels = [cells[0].getBoundingClientRect().left - at];
  for (const cell of cells) {
    metres.push(frets[Number(cell.dataset.fret) - 1]);
    pixels.push(cell.getBoundingClientRect().right - at);
  }
  const last = metres.length - 1, broken = begin > metres[last] + EDGE;
  metres.push(begin, length);
  pixels.push(body.left - at, body.right - at);
  return (/** @type {number} */ place) => {
    if (place < metres[0] - EDGE || (broken && place > metres[last] + EDGE && place < begin)) return undefined;
    let k = 1;
    while (k < metres.length - 1 && place > metres[k] + EDGE) k++;
    const part = (place - metres[k - 1]) / (metres[k] - metres[k - 1] || 1);
    return pixels[k - 1] + Math.min(1, Math.max(0, part)) * (pixels[k] - pixels[k - 1]);
  };
}

// Measures the neck's place after it was redrawn.
export function layOut() {
  const strings = chosenBass().strings.length, tall = part(".open").getBoundingClientRect().height;
  pictures.layOut(placing(), i => (strings - 0.5 - i) * tall, $("window").hidden);
  $("strings").style.height = `${tall * strings}px`;
}

function shiftNeck(/** @type {number} */ by) {
  state.from += by * Math.max(1, Number($("neck").dataset.count) - 2);
  showNeck();
  layOut();
}

$("down").onclick = () => shiftNeck(-1);
$("up").onclick = () => shiftNeck(1);

// Arrow keys move over the neck.
$("neck").addEventListener("keydown", e => {
  const {string, fret} = /** @type {HTMLElement} */ (e.target).dataset, move = MOVES[e.key];
  if (!move || fret === undefined) return;
  e.preventDefault();
  const wanted = {string: Number(string) + move[0], fret: Number(fret) + move[1]};
  /** @returns {HTMLElement | null} */
  const there = () => $("neck").querySelector(`button[data-string="${wanted.string}"][data-fret="${wanted.fret}"]`);
  if (!there() && move[1] > 0 && !$("up").disabled) shiftNeck(1);
  else if (state.from > 0 && move[1] < 0 && (!there() || wanted.fret === state.from)) shiftNeck(-1);
  const cell = there();
  if (!cell) return;
  $("neck").querySelectorAll("button").forEach(other => { other.tabIndex = -1; });
  cell.tabIndex = 0;
  cell.focus();
});

new ResizeObserver(() => {
  if ($("neck").clientWidth !== state.width) showNeck();
  layOut();
  state.width = $("neck").clientWidth;
}).observe($("neck"));
