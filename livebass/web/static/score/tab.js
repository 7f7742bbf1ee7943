// Practising a tablature: the neck shows which string and fret each note has, bar by bar, in a loop and at a tempo.
import {layOut, showNeck} from "../neck/neck.js";
import {$, NAMES, PAGE, bassCalled, chooseBass, chosenBass, make, makeButton} from "../pages/page.js";
import {player} from "../audio/player.js";
import {state} from "../pages/state.js";
import {Transport} from "./transport.js";
import {WORDS} from "../words.js";

const LATEST = 100; // looks that wait for the bass
const COLUMNS = 40; // of a bar in the text
const TIE = 1e-6; // frames by which a time may lie below the middle of two frames
// The signs beside a fret, in the text and on the neck
/** @type {Record<string, string>} */
const KINDS = {hammer: "h", pull: "p", slide: "/", slap: "T", pop: "P", tap: "t", pinch: "*"};

/** @type {TabData | undefined} */
let tab;
let shownBar = -1;
/** @type {{mark: HTMLElement, begin: number, end: number}[]} */
let marks = []; // on the neck

const text = make("pre", {tabIndex: 0}), about = make("p");

// True for a file that may be a tablature, by its name.
export const isTab = (/** @type {File} */ file) => WORDS.endings.tab.some((/** @type {string} */ ending) => file.name.toLowerCase().endsWith(ending));

// Has a tablature read by the server of this page, and shows it.
export async function openTab(/** @type {File} */ file) {
  if (!PAGE.opens) throw new Error("this page has its tablature built in; `livebass page` opens others");
  const answer = await fetch(`${PAGE.opens}?name=${encodeURIComponent(file.name)}`, {method: "POST", body: file});
  if (answer.status === 422) throw new Error((await answer.text()).replace(`${file.name}: `, ""));
  if (!answer.ok) throw new Error(`${answer.status} ${answer.statusText}`);
  /** @type {TabData} */
  const found = await answer.json();
  if (found.shown && !bassCalled(found.bass)) {
    PAGE.basses.push(found.shown);
    $("bass").add(new Option(found.shown.title, found.bass));
  }
  chooseBass(found.bass);
  take(found);
}

function take(/** @type {TabData} */ data) {
  tab = data;
  shownBar = -1;
  about.textContent = `${data.title}: ${data.said}.`;
  $("tab").hidden = false;
  transport.open(data.bars, data.end);
  show();
}

// Takes the tablature off the page: a song has come in its place.
export function closeTab() {
  transport.pause(0);
  for (const each of marks) each.mark.remove();
  [tab, marks] = [undefined, []];
  $("tab").hidden = true;
}

// The tablature's events, each at the frame nearest to its time.
function messages() {
  const frame = (/** @type {number} */ time) => Math.floor(time * player.context.sampleRate + 0.5 + TIE);
  return Int32Array.from((tab?.rows || []).flatMap(([time, ...event]) => [frame(time), ...event]));
}

async function ready() {
  for (let k = 0; player.playing !== $("bass").value && k < LATEST; k++) await new Promise(done => setTimeout(done, 50));
}

const play = makeButton("Play", {ariaPressed: "false"}), loop = makeButton("Loop", {ariaPressed: "false"});
const transport = new Transport({messages, ready}, play, loop);

// --- what is seen ---

/** @returns {TabStroke[]} */
function strokesOf(/** @type {number} */ bar) {
  if (!tab || !tab.bars[bar]) return [];
  const begin = tab.bars[bar][0], end = tab.bars[bar + 1]?.[0] ?? tab.end;
  return tab.strokes.filter(([at]) => at >= begin - 1e-3 && at < end - 1e-3);
}

/** @param {TabStroke} stroke */
function written([,, , fret, kind]) {
  return kind === "dead" || kind === "left slap" ? "x" : kind === "harmonic" ? `<${fret}>` : `${KINDS[kind] || ""}${fret}`;
}

// A bar as lines of text, the highest string first, and the column of each time.
function linesOf(/** @type {number} */ bar) {
  const strokes = strokesOf(bar), strings = chosenBass().strings.length, lines = Array.from({length: strings}, () => "");
  const begin = tab?.bars[bar]?.[0] ?? 0, long = (tab?.bars[bar + 1]?.[0] ?? tab?.end ?? 1) - begin;
  /** @type {[number, number][]} */
  const columns = [];
  let column = 1;
  for (const at of new Set(strokes.map(stroke => stroke[0]))) {
    column = Math.max(column, 1 + Math.round(COLUMNS * (at - begin) / long));
    columns.push([at, column]);
    const those = strokes.filter(stroke => stroke[0] === at);
    for (const stroke of those) lines[strings - 1 - stroke[2]] = lines[strings - 1 - stroke[2]].padEnd(column, "-") + written(stroke);
    column += 1 + Math.max(...those.map(stroke => written(stroke).length));
  }
  const width = Math.max(COLUMNS + 1, column);
  return {lines: lines.map(line => `${line.padEnd(width, "-")}|`), columns, width};
}

// Shows the present bar and the next as text, and on the neck the places of the present one.
function show() {
  if (!tab) return;
  const at = transport.now, bar = transport.barAt(at);
  if (bar !== shownBar || !marks.every(({mark}) => mark.isConnected)) {
    shownBar = bar;
    mark(bar);
  }
  const here = linesOf(bar), there = tab.bars[bar + 1] ? linesOf(bar + 1).lines : [], {strings} = chosenBass();
  const rows = here.lines.map((line, k) => `${NAMES[strings[strings.length - 1 - k].note % 12].padEnd(2)}|${line}${there[k] ?? ""}`);
  const number = tab.bars.map(([, n, name]) => `${n}${name ? ` ${name}` : ""}`);
  const heads = `   ${number[bar].padEnd(here.width + 1)}${number[bar + 1] ?? ""}`;
  const column = here.columns.filter(([begin]) => begin <= at + 1e-3).at(-1)?.[1] ?? 0;
  const shown = [heads, ...rows, `${" ".repeat(3 + column)}▲`].join("\n");
  if (text.textContent !== shown) {
    text.textContent = shown;
    text.scrollLeft = (3 + column) * text.scrollWidth / rows[0].length - text.clientWidth / 3; // the place stays in sight
  }
  for (const {mark, begin, end} of marks) mark.classList.toggle("now", transport.rolls && at >= begin && at < end);
}

// Marks the places of a bar on the neck; moves the neck's window to them if they are hidden.
function mark(/** @type {number} */ bar) {
  for (const each of marks) each.mark.remove();
  const strokes = strokesOf(bar), frets = strokes.map(stroke => stroke[3]).filter(fret => fret > 0);
  const count = () => Number($("neck").dataset.count), low = Math.min(...frets), high = Math.max(...frets);
  if (frets.length && (low <= state.from || high > state.from + count())) {
    state.from = Math.max(0, Math.min(low - 1, chosenBass().frets - count()));
    showNeck();
    layOut();
  }
  marks = strokes.flatMap(stroke => {
    const [begin, end, string, fret] = stroke, column = fret ? fret - state.from + 1 : 1;
    if (fret && (column < 2 || column > count() + 1)) return [];
    const made = make("b", {className: "due", textContent: written(stroke), ariaHidden: "true"});
    Object.assign(made.style, {gridRow: chosenBass().strings.length - string, gridColumn: column});
    return [{mark: made, begin, end}];
  });
  $("neck").append(...marks.map(({mark}) => mark));
}

function look() {
  requestAnimationFrame(look);
  if (tab) show();
}

const {back, next, labels} = transport;
$("tab").append(about, text, make("div", {className: "tools"}, back, play, next, loop, ...labels));
if (PAGE.opens) {
  $("song-file").accept += `,${WORDS.endings.tab}`;
  $("song-text").textContent = "Drop a MIDI file or a tablature here.";
}
const built = PAGE.tab;
requestAnimationFrame(() => { // when the neck is there
  if (built) take(built);
  look();
});
