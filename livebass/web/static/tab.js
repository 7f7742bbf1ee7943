// Practising a tablature: the neck shows which string and fret each note has, bar by bar, in a loop and at a tempo.
import {layOut, showNeck} from "./neck.js";
import {$, NAMES, PAGE, bassCalled, chooseBass, chosenBass, make, makeButton, say, isPressed, setPressed} from "./page.js";
import {player} from "./player.js";
import {AUTO, Song} from "./song.js";
import {state} from "./state.js";

const AHEAD = 0.15, LOOK_EVERY = 30; // s of messages sent ahead; ms between looks
const LATEST = 100; // looks that wait for the bass
const COLUMNS = 40; // of a bar in the text
const ENDINGS = ".gp,.gp3,.gp4,.gp5,.gpx,.musicxml,.mxl,.xml";
const CONTROL = 0xB0, NOTE_ON = 0x90, NOTE_OFF = 0x80, ALIKE = 127;
// The signs beside a fret, in the text and on the neck
/** @type {Record<string, string>} */
const KINDS = {hammer: "h", pull: "p", slide: "/", slap: "T", pop: "P", tap: "t", pinch: "*"};

/** @type {TabData | undefined} */
let tab;
/** @type {Song | undefined} */
let song;
/** @type {{frame: number, midi: number[]}[]} */
let messages = [];
/** @type {number | undefined} */
let timer; // while it plays
let sent = 0; // messages
let place = 0, from = 0, tempo = 1; // s of the song at `from` s of the context
let part = {begin: 0, end: 0}; // s, of the loop or the whole
let shownBar = -1;
/** @type {Set<number>} */
const held = new Set(); // notes: status and key
/** @type {{mark: HTMLElement, begin: number, end: number}[]} */
let marks = []; // on the neck

const back = makeButton("‹", {title: "Bar before", ariaLabel: "Bar before"}), next = makeButton("›", {title: "Next bar", ariaLabel: "Next bar"});
const play = makeButton("Play", {ariaPressed: "false"}), loop = makeButton("Loop", {ariaPressed: "false"});
const first = make("input", {type: "number", min: 1, value: 1, ariaLabel: "First bar"});
const last = make("input", {type: "number", min: 1, value: 1, ariaLabel: "Last bar"});
const slow = make("input", {type: "range", min: 25, max: 125, step: 5, value: 100, ariaLabel: "Tempo"});
const text = make("pre", {tabIndex: 0}), about = make("p"), percent = make("output", {textContent: "100 %"});

// True for a file that may be a tablature, by its name.
export const isTab = (/** @type {File} */ file) => ENDINGS.split(",").some(ending => file.name.toLowerCase().endsWith(ending));

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
  pauseTab();
  tab = data;
  song = undefined;
  place = 0;
  shownBar = -1;
  const numbers = data.bars.map(([, number]) => number);
  first.max = last.max = String(Math.max(...numbers));
  first.value = String(numbers[0]);
  last.value = String(Math.max(...numbers));
  about.textContent = `${data.title}: ${data.said}.`;
  $("tab").hidden = false;
  takePart();
  show();
}

// The part between the chosen bars, as they first come; the whole song without a loop.
function takePart() {
  if (!tab) return;
  const {bars, end} = tab, begin = Math.max(0, bars.findIndex(([, number]) => number === Number(first.value)));
  const final = bars.findIndex(([, number], k) => k >= begin && number === Number(last.value));
  const whole = !isPressed(loop);
  part = {begin: whole ? 0 : bars[begin][0], end: whole || final < 0 ? end : bars[final + 1]?.[0] ?? end};
}

const timeOf = (/** @type {number} */ at) => from + (at - place) / tempo; // of the context, s
const placeAt = (/** @type {number} */ time) => place + (time - from) * tempo;
const now = () => timer === undefined ? place : Math.max(place, placeAt(player.context.currentTime));

async function start() {
  if (!tab) return;
  if (state.rolls) $("roll").click(); // a song stops
  setPressed(play, true);
  play.textContent = "Pause";
  await player.sound();
  const rate = player.context.sampleRate;
  if (song?.rate !== rate) song = new Song(Uint8Array.from(atob(tab.midi), c => c.charCodeAt(0)).buffer, rate);
  messages = song.messages(AUTO, chosenBass());
  for (let k = 0; player.playing !== $("bass").value && k < LATEST; k++) await new Promise(done => setTimeout(done, 50));
  if (!isPressed(play) || timer !== undefined) return; // it was stopped, or started again
  if (place < part.begin || place >= part.end - 1e-3) place = part.begin;
  from = player.context.currentTime + 0.1;
  chase(from);
  timer = setInterval(sendOn, LOOK_EVERY);
}

/** @param {number} time @param {number[]} midi */
const send = (time, midi) => player.send(0, midi, undefined, Math.round(time * player.context.sampleRate));

// Sends all controllers as they are at the place, for a bass that may come from another place of the song.
function chase(/** @type {number} */ time) {
  /** @type {Map<number, number[]>} */
  const latest = new Map(), frame = place * (song?.rate || 0);
  sent = messages.findIndex(message => message.frame >= frame);
  if (sent < 0) sent = messages.length;
  for (const {frame: at, midi} of messages) {
    if (at > 0 && at >= frame) break;
    if (midi[0] >= 0xA0) latest.set(midi[0] < 0xC0 ? midi[0] * 128 + midi[1] : midi[0] * 128, midi);
  }
  for (const midi of latest.values()) send(time, midi);
}

function release(/** @type {number} */ time) {
  for (const note of held) send(time, [NOTE_OFF | note >> 7, note & 127, 64]);
  held.clear();
}

// Sends the next moments' messages; goes back at the end of a loop.
function sendOn() {
  const until = player.context.currentTime + AHEAD, rate = song?.rate || 1;
  for (;;) {
    const stop = part.end * rate;
    for (; sent < messages.length && messages[sent].frame < stop && timeOf(messages[sent].frame / rate) <= until; sent++) {
      const {frame, midi} = messages[sent], kind = midi[0] & 0xF0, note = (midi[0] & 15) << 7 | midi[1];
      if (kind === NOTE_ON) held.add(note);
      else if (kind === NOTE_OFF) held.delete(note);
      send(timeOf(frame / rate), midi);
    }
    const end = timeOf(part.end);
    if (end > until) return;
    if (!isPressed(loop)) {
      if (end <= player.context.currentTime) pauseTab(part.begin);
      return;
    }
    release(end);
    [place, from] = [part.begin, end];
    chase(end);
  }
}

// Pauses, here or at a place of the song.
export function pauseTab(at = now()) {
  setPressed(play, false);
  play.textContent = "Play";
  if (timer !== undefined) {
    clearInterval(timer);
    timer = undefined;
    const quiet = player.context.currentTime + AHEAD; // behind all that was sent ahead
    release(quiet);
    place = 0;
    chase(quiet); // the usual playing
    send(quiet, [CONTROL, ALIKE, 0]);
  }
  place = Math.min(at, tab?.end ?? 0);
}

// Goes to a place, and plays on from there if it plays.
function go(/** @type {number} */ at) {
  const rolls = timer !== undefined;
  pauseTab(at);
  if (rolls) start().catch(error => say(error.message));
}

function step(/** @type {number} */ by) {
  const at = tab?.bars[Math.max(0, barAt(now()) + by)]?.[0];
  if (at !== undefined) go(at);
}

// The number of the bar at a place, as the bars are played, from 0.
function barAt(/** @type {number} */ at) {
  if (!tab) return -1;
  const found = tab.bars.findIndex(([begin]) => begin > at + 1e-6);
  return (found < 0 ? tab.bars.length : found) - 1;
}

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
  const at = now(), bar = barAt(at);
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
  if (text.textContent !== shown) text.textContent = shown;
  for (const {mark, begin, end} of marks) mark.classList.toggle("now", timer !== undefined && at >= begin && at < end);
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

// --- its controls ---

play.onclick = () => {
  if (isPressed(play)) pauseTab();
  else start().catch(error => { pauseTab(); say(error.message); });
};
loop.onclick = () => {
  setPressed(loop, !isPressed(loop));
  change(takePart);
};
first.onchange = last.onchange = () => {
  setPressed(loop, true);
  change(takePart);
};
slow.oninput = () => change(() => {
  tempo = Number(slow.value) / 100;
  percent.textContent = `${slow.value} %`;
});
back.onclick = () => step(-1);
next.onclick = () => step(1);

// Makes a change of part or tempo from the present place on.
function change(/** @type {() => void} */ make) {
  const at = now();
  if (timer !== undefined) [place, from] = [at, player.context.currentTime];
  make();
  if (at < part.begin || at > part.end) go(part.begin);
}

const labelled = (/** @type {string} */ name, /** @type {Node[]} */ ...inputs) => make("label", {}, `${name} `, ...inputs);
$("tab").append(about, text, make("div", {className: "tools"}, back, play, next, loop,
  labelled("Bars", first), labelled("to", last), labelled("Tempo", slow, percent)));
if (PAGE.opens) {
  $("song-file").accept += `,${ENDINGS}`;
  $("song-text").textContent = "Drop a MIDI file or a tablature here.";
}
player.on("ends", () => pauseTab());
const built = PAGE.tab;
requestAnimationFrame(() => { // when the neck is there
  if (built) take(built);
  look();
});
