// The page: starts the audio thread, hands it what is played on keys, neck and MIDI, and shows what it tells.
"use strict";

const $ = id => document.getElementById(id);
const PAGE = JSON.parse($("page").textContent);
// The keys in the shape of a piano, from E up by semitones
const CODES = "KeyA KeyS KeyE KeyD KeyR KeyF KeyT KeyG KeyH KeyU KeyJ KeyI KeyK KeyL KeyP Semicolon".split(" ");
const OCTAVES = {KeyZ: "octave-down", KeyX: "octave-up"};
const NAMES = ["C", "C♯", "D", "D♯", "E", "F", "F♯", "G", "G♯", "A", "A♯", "B"];
const WARM = 400; // ms
const FLOOR = -60; // dB
const MOST_AHEAD = 0.5; // s
const LONGEST_RESPONSE = 1; // s
const LEAST_FRET = {finger: 30, mouse: 20}; // px
const BODY_PART = 26; // %, of the width, where not all frets are shown
const LONG_PRESS = 400; // ms
const MOST_LATE = 2000; // ms: what was pressed longer before the sound ran is forgotten
const PITCH_EVERY = 120; // ms
const FULL = 0.7; // load of the audio thread from which pictures are shed, so that the sound has the machine
const SHED = 100; // ms from one picture to the next then
const SOON = 30; // ms after the sound runs, when it is played
const held = new Map(); // what is pressed: note, and where
let ready = false, sounding = false, context, node, module, wasm, worker, playing, octave = 28, from = 0;
const noteName = note => NAMES[note % 12] + (Math.floor(note / 12) - 1);
const say = text => { $("said").textContent = text; };

// --- what the browser has ---

// A function that uses a vector instruction
const SIMD = [0, 97, 115, 109, 1, 0, 0, 0, 1, 5, 1, 96, 0, 1, 123, 3, 2, 1, 0, 10, 10, 1, 8, 0, 65, 0, 253, 15, 253, 98, 11];

function lacking() {
  if (!PAGE.files && location.protocol === "file:")
    return "A page in a folder needs a web server. To play from a disk, export it with --single.";
  if (!window.isSecureContext) return "Browsers play this page from https, from localhost or from a disk only, not from http.";
  if (!window.AudioWorkletNode) return "This browser has no AudioWorklet: it cannot play. Chrome, Edge, Firefox and Safari 16.4 or later can.";
  if (!window.WebAssembly || !WebAssembly.validate(new Uint8Array(SIMD)))
    return "This browser has no WebAssembly SIMD: it cannot play. Chrome 97, Edge 97, Firefox 89 and Safari 16.4 or later can.";
  if (PAGE.files && !window.DecompressionStream)
    return "This browser has no DecompressionStream: it cannot open this page. Chrome 97, Edge 97, Firefox 113 and Safari 16.4 or later can.";
}

// --- files ---

async function unpack(text) {
  const packed = Uint8Array.from(atob(text), c => c.charCodeAt(0));
  return new Response(new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"))).arrayBuffer();
}

// Where a file of the page's folder is. Its version keeps a browser's cache from mixing two exports.
const address = name => `${name.split("/").map(encodeURIComponent).join("/")}?v=${PAGE.digest}`;

async function read(name) {
  if (PAGE.files) return unpack(PAGE.files[name]);
  const answer = await fetch(address(name));
  if (!answer.ok) throw new Error(`${name}: ${answer.status} ${answer.statusText}`);
  return answer.arrayBuffer();
}

const readText = async name => new TextDecoder().decode(await read(name));

// --- audio ---

// All that can be done before somebody asks for sound: browsers let a context be made then, but not run.
async function load() {
  context = new AudioContext({latencyHint: "interactive"});
  context.suspend().catch(() => {}); // where it may run at once
  context.onstatechange = () => { if (sounding && context.state !== "running") silence(); }; // a call came, say
  wasm = await read("livebass.wasm");
  module = await WebAssembly.compile(wasm);
  worker = new Worker(PAGE.files
    ? URL.createObjectURL(new Blob([await readText("worker.js")], {type: "text/javascript"})) : address("worker.js"));
  worker.onmessage = ({data: {id, built, error}}) => {
    const [resolve, reject] = waiting.get(id) || [];
    waiting.delete(id);
    if (error) reject?.(new Error(error));
    else resolve?.(built);
  };
  worker.onerror = ({message}) => {
    for (const [, reject] of waiting.values()) reject(new Error(`worker.js: ${message || "it cannot be loaded"}`));
    waiting.clear();
  };
  await ask({module});
  prepare($("bass").value, WARM);
}

const waiting = new Map(); // answers of the worker, by number
let asked = 0;

// Sends the worker a message, gives it `moved`; returns the promise of what it answers.
function ask(message, moved = []) {
  const id = asked++;
  const answer = new Promise((resolve, reject) => waiting.set(id, [resolve, reject]));
  worker.postMessage({id, ...message}, moved);
  return answer;
}

let response; // the player's own impulse response, at the rate of the context; undefined: that of the bass

// Builds a bass of the page at a rate (Hz): {bass, at, image, file, response}.
async function build(name, rate, warm = 0) {
  const file = await changedFile(name, await read(`basses/${name}.lbass`)), kept = file.slice(0), by = response;
  return {...await ask({name, file, tier: PAGE.tier, rate, warm, response}, [file]), file: kept, response: by};
}

const free = built => worker.postMessage({free: built.bass});

// A node that plays; with a `score` of [frame, status, data, data] and a `bass` at once, for offline contexts.
async function makeNode(context, more = {}) {
  // a page from a disk may load a script from a data: address, but none from a blob:
  await context.audioWorklet.addModule(PAGE.files
    ? "data:text/javascript;charset=utf-8," + encodeURIComponent(await readText("worklet.js")) : address("worklet.js"));
  return new AudioWorkletNode(context, "livebass", {
    numberOfInputs: 0, outputChannelCount: [more.channels || 2], processorOptions: {module, wasm, ...more},
  });
}

// The bass that waits for the start, or comes next
let next;

function prepare(name, warm = 0) {
  const before = next;
  next = {name, built: build(name, context.sampleRate, warm)};
  next.built.catch(error => say(`${name}: ${error.message}`));
  if (before) before.built.then(free, () => {});
  return next;
}

// Hands the bass that was chosen to the audio thread, once it is built; returns when it is there.
async function put() {
  const wanted = next;
  if (!wanted) return;
  const built = await wanted.built.catch(() => undefined);
  if (!built || next !== wanted) return;
  next = undefined;
  const {bass, at, image, ...made} = built;
  names.set(bass, wanted.name);
  basses.set(bass, made);
  const there = new Promise(resolve => copied.set(bass, resolve));
  node.port.postMessage({bass: {bass, at, image}}, [image]);
  await there;
}

const names = new Map(); // of basses in the audio thread, by address ...
const basses = new Map(); // ... and {file, response} that they were made of
const copied = new Map(); // what to call when the audio thread has them
let heardBass; // the address of the one that plays
let changes = 0; // of the playing, that the page has asked the audio thread for

// Changes how the bass plays. The audio thread tells how it plays once it has carried out all changes.
const change = message => node.port.postMessage({...message, change: ++changes});

function hear({data}) {
  const there = data.copied || data.faded;
  if (there) {
    copied.get(there)?.();
    copied.delete(there);
  }
  if (data.faded) {
    names.delete(data.faded);
    basses.delete(data.faded);
    free({bass: data.faded});
    buildWanted();
  }
  if (there) return;
  if (data.taped) {
    taped(data);
    return;
  }
  if (data.recalled !== undefined) {
    recalled?.(data);
    return;
  }
  if (data.sight) {
    began = data.began;
    const spare = names.get(data.of) === $("bass").value ? see.take(data) : data.sight; // another one may still ring
    if (spare) node.port.postMessage({spare}, [spare]);
    return;
  }
  const name = names.get(data.bass);
  if (data.bass !== heardBass && name === $("bass").value) {
    heardBass = data.bass;
    keepStroke();
  }
  if (name && name !== playing) {
    playing = name;
    say(`${bassCalled(playing).title} plays.`);
  }
  if (sounding && name === $("bass").value && data.changes === changes) showPlaying(data.playing);
  showMeters(data);
}

let loading, starting;

// Makes all that plays but for the wish to hear it. Browsers that keep the audio thread from beginning without that
// wish go on from where they stand once it comes.
function start() {
  starting ||= begin().catch(error => {
    starting = undefined;
    say(`The sound does not start: ${error.message}`);
    throw error;
  });
  return starting;
}

async function begin() {
  await loading;
  node = await makeNode(context);
  node.port.onmessage = hear;
  node.onprocessorerror = () => say("The audio thread stopped. Load the page again.");
  for (const symbol of Object.keys(CONTROLS)) tellParameter(symbol);
  node.port.postMessage({seeing: !document.hidden});
  analyser = new AnalyserNode(context, {fftSize: 8192, smoothingTimeConstant: 0.5});
  see.rate = context.sampleRate;
  node.connect(analyser).connect(context.destination);
  await put();
}

function showPower(on) {
  sounding = on;
  $("power").textContent = on ? "Stop" : "Start";
  $("power").setAttribute("aria-pressed", on);
  document.body.classList.toggle("sounding", on);
}

// Starts, or goes on. Browsers let a context run only where a key, a button or a finger's end just asked for it:
// resume() waits for that, so every call asks again, at once.
async function sound() {
  await Promise.all([start(), context.resume()]);
  if (sounding) return; // another call came first
  showPower(true);
  WAYS.forEach(tellWay); // and what was chosen while nothing sounded
  if (stroke !== toldStroke) tellStroke();
  playEarly();
}

function silence() {
  stopSong();
  if ($("record").ariaPressed === "true") switchRecording();
  letGo();
  showPower(false);
  panic();
}

async function switchPower() {
  if (!sounding) return sound();
  silence();
  await new Promise(done => setTimeout(done, 60)); // it fades
  if (sounding) return; // somebody played on
  say("");
  showMeters({load: 0, peak: 0, overload: 0, faults: 0, held: []});
  await context.suspend();
}

// The frame of the audio that is computed at `time` (ms, as events have it), late enough for all to be as late.
// Undefined, at once, if the browser tells no time or, after a pause, one from before.
function frameAt(time) {
  const {contextTime, performanceTime} = context.getOutputTimestamp?.() || {};
  if (!performanceTime) return undefined;
  const delay = (context.outputLatency || 0) + (context.baseLatency || 0);
  const at = contextTime + (time - performanceTime) / 1000 + delay;
  return at > context.currentTime + MOST_AHEAD ? undefined : Math.round(at * context.sampleRate);
}

// While nothing sounds, nothing is kept for later. A note may be meant for one string.
function send(time, midi, string, frame = frameAt(time)) {
  if (!node || context.state !== "running" || midi[0] >= 0xf0) return;
  if ((midi[0] & 0xf0) === 0x90) struckSince();
  node.port.postMessage({midi, string, frame});
}

// --- playing ---

let early = []; // what was pressed since the sound was asked for, until it runs
const IN_TIME = {late: 0, frameAt}; // as all else is played
const noteOn = ({note, velocity}) => [0x90, note, velocity], noteOff = ({note}) => [0x80, note, 0];

// Presses what `id` tells apart, at `time` (ms). A finger that began early goes on so many ms late, by a clock of its own.
function press(id, note, force, time, cell, clock = IN_TIME) {
  if (held.has(id) || note < 0 || note > 127) return;
  const velocity = Math.min(127, Math.max(1, Math.round(force)));
  const string = cell?.dataset.string === undefined ? undefined : +cell.dataset.string;
  const key = {note, velocity, string, cell, clock, begin: time, end: undefined};
  held.set(id, key);
  cell?.classList.add("down");
  if (sounding) {
    sendLate(key, time, noteOn(key), string);
  } else if (loading) {
    early.push(key);
    sound().catch(() => { early = []; }); // said where it happened
  }
}

function lift(key, time) {
  key.end = time;
  key.cell?.classList.remove("down");
  if (sounding) sendLate(key, time, noteOff(key));
}

// Sends a message of a key, as late as the key is: what waited in the audio thread would hold up what is played meanwhile.
function sendLate({clock: {late, frameAt}}, time, midi, string) {
  const wait = time + late - performance.now(), go = () => send(time, midi, string, frameAt(time));
  if (late && wait > 0) setTimeout(go, wait);
  else go();
}

function release(id, time = performance.now()) {
  const key = held.get(id);
  held.delete(id);
  if (key) lift(key, time);
}

// Plays what was pressed while the sound began: from now on, each note after the other and as long as they were played.
function playEarly() {
  const oldest = performance.now() - MOST_LATE, keys = early.filter(({end}) => !(end <= oldest));
  early = [];
  if (!keys.length) return;
  const begin = Math.max(oldest, keys[0].begin), first = context.currentTime + SOON / 1000;
  const frame = time => Math.round(context.sampleRate * (first + Math.max(0, time - begin) / 1000));
  const clock = {late: performance.now() - begin, frameAt: frame}, messages = [];
  for (const key of keys) {
    key.clock = clock;
    messages.push([key.begin, noteOn(key), key.string]);
    if (key.end !== undefined) messages.push([key.end, noteOff(key)]);
  }
  messages.sort(([a, on], [b, other]) => a - b || other[0] - on[0]); // of those at one time, new notes first
  for (const message of messages) sendLate({clock}, ...message);
}

function letGo() {
  for (const id of [...held.keys()]) release(id);
  for (const way of WAYS) for (const id of [...way.holds]) letGoOf(id);
}

const force = () => +$("force").value;

// Lower on a string, or on a key, is harder.
function forceAt(cell, y) {
  const {top, height} = cell.getBoundingClientRect();
  return 30 + 97 * Math.min(1, Math.max(0, (y - top) / height));
}

// Two hands: fingers on the frets hold strings down, and a finger over the body plucks them. Each finger on a fret, by
// its pointer: {string, fret}.
const fingers = new Map();
const withTwoHands = () => $("hands").ariaPressed === "true";
const cellOf = (string, fret) => $("neck").querySelector(`button[data-string="${string}"][data-fret="${fret}"]`);
const plucked = string => `string${string}`; // what sounds by the right hand is held as this

// The fret at which the left hand holds a string: the highest; 0: it is open.
const heldFret = string => Math.max(0, ...[...fingers.values()].filter(finger => finger.string === string).map(finger => finger.fret));

// Plucks a string where the left hand holds it.
function pluck(string, force, time) {
  const fret = heldFret(string);
  release(plucked(string), time);
  press(plucked(string), bassCalled($("bass").value).strings[string].note + fret, force, time, cellOf(string, fret) || cellOf(string, 0));
}

// A finger of the left hand came, moved or left: what sounds there goes on from the fret that is held now, hammered on or
// pulled off. An open string rings on when it was so before; one that a finger lets go of ends.
function follow(string, time, lifted = false) {
  const key = held.get(plucked(string)), fret = heldFret(string);
  if (!key) return;
  const note = bassCalled($("bass").value).strings[string].note + fret;
  if (note === key.note) return;
  if (lifted && !fret) {
    release(plucked(string), time);
    return;
  }
  const legato = WAYS.find(way => way.symbol === "legato"), number = legato && numberOf(legato);
  const already = number === undefined || isOn(legato);
  held.delete(plucked(string));
  if (!already) changeBy([0xb0, number, 127]);
  press(plucked(string), note, key.velocity, time, cellOf(string, fret) || cellOf(string, 0), key.clock);
  lift(key, time);
  if (!already) changeBy([0xb0, number, 0]);
}

function putFinger(id, cell, time) {
  const before = fingers.get(id), now = cell && {string: +cell.dataset.string, fret: +cell.dataset.fret};
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

// The right hand, over the body: a finger that comes down on a string that sounds stops it, one that goes across it
// plucks it, the faster the harder, and there; one that only taps plucks it, too, lower on the string harder.
const rights = new Map(); // by pointer: {y, time, began, string, crossed, plucked}
const PLUCK_SPEED = 30; // lanes a second, of the hardest pluck
const AGAIN = 40; // ms, from which on a finger can pluck a string again

// The string whose lane is at `y`, px from the top of the neck, and how far down in it, 0 to 1.
function laneAt(y) {
  const {height} = $("neck").querySelector(".open").getBoundingClientRect(), count = bassCalled($("bass").value).strings.length;
  const row = Math.min(count - 1, Math.max(0, Math.floor(y / height)));
  return {string: count - 1 - row, part: y / height - row};
}

// Sets the place of the pluck to that of a finger: the part of the body that it is at.
function pluckAt(x) {
  const {left, right} = $("neck").querySelector(".body").getBoundingClientRect(), bass = bassCalled($("bass").value);
  const [nearest, usual, farthest] = bass.pluck, length = bass.strings[0].length, begin = +$("neck").querySelector(".body").dataset.begin;
  const aside = (begin + (length - begin) * (x - left) / (right - left)) / length - usual;
  const value = aside * (farthest - usual) > 0 ? -aside / (farthest - usual) : nearest === usual ? 0 : aside / (nearest - usual);
  $("pluck_position").value = Math.min(1, Math.max(-1, value));
  $("pluck_position").oninput();
}

function rightDown(e) {
  const y = e.clientY - $("neck").getBoundingClientRect().top, {string} = laneAt(y);
  release(plucked(string), e.timeStamp);
  rights.set(e.pointerId, {y, time: e.timeStamp, began: e.timeStamp, string, crossed: false, plucked: {}});
}

function rightMoves(e, finger) {
  const y = e.clientY - $("neck").getBoundingClientRect().top, tall = $("neck").querySelector(".open").getBoundingClientRect().height;
  const count = bassCalled($("bass").value).strings.length;
  for (let string = 0; string < count; string++) {
    const middle = (count - 0.5 - string) * tall;
    const across = (finger.y - middle) * (y - middle) < 0;
    if (!across || e.timeStamp - finger.plucked[string] < AGAIN) continue; // screens tell where a finger will be, and take it back
    finger.plucked[string] = e.timeStamp;
    const speed = Math.abs(y - finger.y) / tall / Math.max(1e-3, (e.timeStamp - finger.time) / 1000);
    pluckAt(e.clientX);
    pluck(string, 30 + 97 * Math.min(1, speed / PLUCK_SPEED), e.timeStamp);
    finger.crossed = true;
  }
  Object.assign(finger, {y, time: e.timeStamp});
}

function rightUp(e, finger) {
  rights.delete(e.pointerId);
  if (finger.crossed || e.timeStamp - finger.began > LONG_PRESS) return;
  const {string, part} = laneAt(finger.y);
  pluckAt(e.clientX);
  pluck(string, 30 + 97 * part, e.timeStamp);
}

$("neck").addEventListener("pointerdown", e => {
  if (e.button || !e.target.closest(".body")) return;
  if (e.target.hasPointerCapture(e.pointerId)) e.target.releasePointerCapture(e.pointerId);
  rightDown(e);
});
addEventListener("pointermove", e => {
  const finger = rights.get(e.pointerId);
  if (finger) for (const one of e.getCoalescedEvents?.().length ? e.getCoalescedEvents() : [e]) rightMoves(one, finger);
});
for (const kind of ["pointerup", "pointercancel"])
  addEventListener(kind, e => {
    const finger = rights.get(e.pointerId);
    if (finger) rightUp(e, finger);
    if (fingers.has(e.pointerId)) putFinger(e.pointerId, undefined, e.timeStamp);
  });
$("hands").onclick = () => {
  const on = !withTwoHands();
  letGo();
  fingers.clear();
  showFingers();
  $("hands").setAttribute("aria-pressed", on);
  $("how").textContent = on ? "Hold strings down on the frets, and pluck them over the body: across, or by a tap."
    : "Press low on a string to play it hard.";
};

for (const place of [$("neck"), $("piano")]) {
  const cellAt = e => document.elementFromPoint(e.clientX, e.clientY)?.closest("[data-note]");
  place.addEventListener("pointerdown", e => {
    const cell = cellAt(e); // where the finger is: browsers take a touch near an edge for one beyond it
    if (!cell || e.button) return;
    if (e.target.hasPointerCapture?.(e.pointerId)) e.target.releasePointerCapture(e.pointerId); // touch would keep it: a finger may slide on
    if (withTwoHands() && cell.dataset.string !== undefined) {
      putFinger(e.pointerId, cell, e.timeStamp);
      return;
    }
    press("pointer" + e.pointerId, +cell.dataset.note, forceAt(cell, e.clientY), e.timeStamp, cell);
  });
  place.addEventListener("pointermove", e => {
    const id = "pointer" + e.pointerId, key = held.get(id);
    if (fingers.has(e.pointerId)) {
      const cell = cellAt(e);
      if (cell?.dataset.string !== undefined) putFinger(e.pointerId, cell, e.timeStamp);
      return;
    }
    if (!key) return;
    const cell = cellAt(e);
    if (!cell || cell === key.cell) return;
    // along a string the new note comes before the old one's end: so it slides there, or is hammered on
    const along = cell.dataset.string === key.cell.dataset.string;
    held.delete(id);
    if (!along) lift(key, e.timeStamp);
    press(id, +cell.dataset.note, forceAt(cell, e.clientY), e.timeStamp, cell, key.clock);
    if (along) lift(key, e.timeStamp);
  });
  place.addEventListener("pointerup", e => { // a finger that comes down starts no sound in browsers, one that leaves does
    if (loading && held.has("pointer" + e.pointerId) && !sounding) sound().catch(() => {});
  });
  // a focused place plays by Space and Enter
  place.addEventListener("keydown", e => {
    const cell = e.target.closest("[data-note]");
    if (!cell || ![" ", "Enter"].includes(e.key)) return;
    e.preventDefault();
    if (!e.repeat) press("focus", +cell.dataset.note, force(), e.timeStamp, cell);
  });
  place.addEventListener("keyup", e => { if ([" ", "Enter"].includes(e.key)) release("focus", e.timeStamp); });
  place.addEventListener("focusout", () => release("focus"));
  place.addEventListener("contextmenu", e => e.preventDefault());
}
for (const kind of ["pointerup", "pointercancel"]) addEventListener(kind, e => release("pointer" + e.pointerId, e.timeStamp));
addEventListener("blur", letGo);

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
  e.preventDefault(); // a list of basses would choose by letters
  if (!e.shiftKey && learn(e.code, e.key)) showKeys();
  if (k >= 0) press(e.code, octave + k, force(), e.timeStamp, $("piano").querySelector(`[data-key="${e.code}"]`));
  else $(OCTAVES[e.code]).click();
});
addEventListener("keyup", e => {
  release(e.code, e.timeStamp);
  letGoOf(e.code);
});

// --- the keys ---

function makePiano() {
  let white = 0;
  for (const [k, code] of CODES.entries()) {
    const key = document.createElement("button"), black = NAMES[(octave + k) % 12].length > 1;
    key.type = "button";
    key.dataset.key = code;
    key.className = black ? "black" : "white";
    key.style.setProperty("--at", black ? white : white++);
    key.append(document.createElement("b"), document.createElement("small"));
    $("piano").append(key);
  }
}

// Letters that are printed on the player's keyboard, by code: Chromium tells them all, elsewhere each is known from the
// first time it is pressed. Until then those of the US.
const letters = new Map();
const letterOf = code => letters.get(code) || (code === "Semicolon" ? ";" : code.slice(3));

// Takes note of what a key prints; true if that is news. No name of a key, such as "Dead".
function learn(code, text) {
  const letter = text?.toUpperCase();
  if (letter?.length !== 1 || letter === letterOf(code)) return false;
  letters.set(code, letter);
  return true;
}

navigator.keyboard?.getLayoutMap?.().then(map => {
  for (const code of [...CODES, ...Object.keys(OCTAVES)]) learn(code, map.get(code));
  showKeys();
}, () => {});

// Writes notes and letters on the keys.
function showKeys() {
  $("piano").querySelectorAll("button").forEach((key, k) => {
    const note = octave + k, letter = letterOf(key.dataset.key);
    key.dataset.note = note;
    key.firstChild.textContent = letter;
    key.lastChild.textContent = NAMES[note % 12] === "E" || NAMES[note % 12] === "C" ? noteName(note) : "";
    key.setAttribute("aria-label", `${noteName(note)}, key ${letter}`);
  });
  for (const [code, id] of Object.entries(OCTAVES)) {
    $(id).lastChild.textContent = letterOf(code);
    $(id).setAttribute("aria-label", `Octave ${id.slice(7)}, key ${letterOf(code)}`);
  }
}

function shiftOctave(by) {
  if (octave + by < 4 || octave + by > 76) return;
  octave += by;
  showKeys();
  say(`Keys from ${noteName(octave)}.`);
}
$("octave-down").onclick = () => shiftOctave(-12);
$("octave-up").onclick = () => shiftOctave(12);

// --- techniques ---

// What plucks, by key switches
const STROKES = PAGE.buttons.filter(button => button.strikes);
// Ways to play, each by the value of a controller, or by the held key switch that MIDI has for it. A way is on while it is
// latched, or held by a finger or a key.
const WAYS = PAGE.buttons.filter(button => !button.strikes).map(way => ({...way, holds: new Set(), latched: false, told: false}));
const DIGITS = [1, 2, 3, 4, 5, 6, 7, 8, 9, 0].map(n => `Digit${n}`);
const isOn = way => way.latched || way.holds.size > 0;

// Changes how the bass plays by a MIDI message, now; and by a controller on every channel.
const changeBy = midi => change({midi, frame: frameAt(performance.now())});
const changeEverywhere = (...everywhere) => change({everywhere, frame: frameAt(performance.now())});

// The number of a technique's controller, or else of its key; undefined where the key map of the bass has none.
function numberOf({symbol, value}) {
  const {keys, controllers} = bassCalled($("bass").value);
  return value ? controllers[symbol] : keys[symbol];
}

// Tells the bass whether a way is on, if that is news and it can hear.
function tellWay(way) {
  const on = isOn(way), number = numberOf(way);
  if (on === way.told || !sounding || number === undefined) return;
  if (way.everywhere) changeEverywhere(number, on ? way.value : 0);
  else changeBy(way.value ? [0xb0, number, on ? way.value : 0] : [on ? 0x90 : 0x80, number, 64]);
  way.told = on;
}

function showWay(way) {
  way.button.setAttribute("aria-pressed", isOn(way));
  tellWay(way);
}

function hold(way, id) {
  way.holds.add(id);
  showWay(way);
}

function letGoOf(id) {
  for (const way of WAYS) if (way.holds.delete(id)) showWay(way);
}

function latch(way, on) {
  way.latched = on;
  showWay(way);
}

// Ends all sound, and resets all controllers.
function panic() {
  if (node) change({panic: true});
  for (const way of WAYS) way.told &&= !way.value;
}

let stroke, toldStroke; // what the player plucks with, undefined: another one, of the bass; and what the bass knows of

function showStroke(chosen) {
  stroke = chosen;
  for (const one of STROKES) one.button.setAttribute("aria-pressed", one === stroke);
}

function tellStroke() {
  const number = numberOf(stroke);
  if (!sounding || number === undefined) return;
  for (const status of [0x90, 0x80]) changeBy([status, number, 64]);
  toldStroke = stroke;
}

function pluckWith(chosen) {
  showStroke(chosen);
  tellStroke();
}

// A bass begins with a stroke of its own.
function ownStroke(bass) {
  showStroke(STROKES.find(one => one.symbol === bass.stroke));
  toldStroke = stroke;
  for (const one of [...STROKES, ...WAYS]) one.button.disabled = numberOf(one) === undefined;
}

// A bass that was built anew begins with its own stroke: tells it the player's.
function keepStroke() {
  const own = STROKES.find(one => one.symbol === bassCalled($("bass").value).stroke);
  if (toldStroke !== stroke) return;
  toldStroke = own;
  if (stroke && stroke !== own) tellStroke();
}

// Shows how the bass plays now, whatever made it so: the page, or key switches and controllers by MIDI.
function showPlaying({on, pluckedWith, values}) {
  for (const way of WAYS) {
    const now = on[way.symbol];
    if (now === way.told) continue;
    way.told = way.latched = now;
    if (!now) way.holds.clear();
    showWay(way);
  }
  const found = STROKES.find(one => one.symbol === pluckedWith);
  if (found !== toldStroke) {
    toldStroke = found;
    showStroke(found);
  }
  for (const [symbol, value] of Object.entries(values)) showControl(symbol, value);
}

function chip(place, one, digit) {
  const button = one.button = document.createElement("button"), number = document.createElement("small");
  button.type = "button";
  button.setAttribute("aria-pressed", false);
  button.setAttribute("aria-label", `${one.name}, key ${digit}`);
  number.textContent = digit;
  button.append(one.name, " ", number);
  $(place).append(button);
  return button;
}

STROKES.forEach((one, k) => { chip("strokes", one, k + 1).onclick = () => pluckWith(one); });
WAYS.forEach((way, k) => {
  const button = chip("ways", way, (k + STROKES.length + 1) % 10);
  let since, before;
  button.onpointerdown = e => {
    if (e.button) return;
    [since, before] = [e.timeStamp, way.latched];
    latch(way, true);
  };
  // The end of a press, wherever: it switches off what was on, or what was held long.
  const end = e => {
    if (since === undefined) return;
    if (before || e.timeStamp - since >= LONG_PRESS) latch(way, false);
    since = undefined;
  };
  button.onpointerup = button.onpointerleave = end;
  button.onpointercancel = () => { // it was the beginning of a scroll
    if (since !== undefined) latch(way, before);
    since = undefined;
  };
  button.onclick = e => { if (!e.detail) latch(way, !way.latched); }; // by Enter, or by what reads the page to somebody
  button.oncontextmenu = e => e.preventDefault();
});

// --- the neck ---

const bassCalled = name => PAGE.basses.find(bass => bass.name === name);
const INLAYS = [3, 5, 7, 9, 12, 15, 17, 19, 21, 24]; // frets from the nut

// How many frets fit, none narrower than a finger: all, with the rest of the string to scale, or some, and less of that.
function fitting(width, frets) {
  const mouse = matchMedia("(min-width: 60rem)").matches && !matchMedia("(pointer: coarse)").matches;
  const least = mouse ? LEAST_FRET.mouse : LEAST_FRET.finger;
  if (width * (2 ** (-(frets - 1) / 12) - 2 ** (-frets / 12)) >= least) return frets;
  width *= 1 - BODY_PART / 100;
  let count = Math.min(frets - 1, 4);
  while (count < frets - 1 && width * (2 ** (-count / 12) - 2 ** (-(count + 1) / 12)) / (1 - 2 ** (-(count + 1) / 12)) >= least) count++;
  return count;
}

// Draws the neck from `from` on. A cell's fret counts from the capo, as the bass does; what is shown counts from the nut.
function showNeck() {
  const bass = bassCalled($("bass").value), neck = $("neck"), focused = neck.contains(document.activeElement);
  const count = fitting(neck.clientWidth - 64, bass.frets);
  from = Math.max(0, Math.min(from, bass.frets - count));
  const whole = count === bass.frets;
  const numbers = Array.from({length: count}, (_, k) => from + 1 + k);
  const widths = numbers.map(n => (2 ** (-n / 12) * 100 / 2 ** (-from / 12)).toFixed(2) + "fr");
  const beyond = whole ? `${(100 * 2 ** (-count / 12) / (2 ** (1 / 12) - 1)).toFixed(2)}fr` : `${BODY_PART}%`;
  neck.style.gridTemplateColumns = `3.25rem ${widths.join(" ")} ${beyond}`;
  neck.style.setProperty("--strings", bass.strings.length);
  neck.classList.toggle("fretless", bass.fretless);
  neck.classList.toggle("nut", from === 0);
  neck.classList.toggle("odd", bass.strings.length % 2 === 1);
  const parts = [];
  [...bass.strings].reverse().forEach((string, row) => {
    const i = bass.strings.length - 1 - row;
    for (const fret of [0, ...numbers]) {
      const cell = document.createElement("button"), note = string.note + fret;
      cell.type = "button";
      cell.className = fret ? "fret" : "open";
      cell.dataset.note = note;
      cell.dataset.string = i;
      cell.dataset.fret = fret;
      cell.tabIndex = -1;
      cell.style.gridRow = row + 1;
      cell.style.gridColumn = fret ? fret - from + 1 : 1;
      cell.setAttribute("aria-label", `${string.name} string, ${fret ? `fret ${bass.capo + fret}` : "open"}, ${noteName(note)}`);
      if (!fret) cell.append(string.name);
      parts.push(cell);
    }
  });
  for (const fret of numbers.filter(n => INLAYS.includes(bass.capo + n))) {
    const dot = document.createElement("i");
    dot.className = (bass.capo + fret) % 12 ? "inlay" : "inlay two";
    dot.style.gridColumn = fret - from + 1;
    parts.push(dot);
    const number = document.createElement("span");
    number.className = "number";
    number.style.gridColumn = fret - from + 1;
    number.textContent = bass.capo + fret;
    number.ariaHidden = "true";
    parts.push(number);
  }
  parts.push(bodyOf(bass, whole ? bass.strings[0].frets[count - 1] : bass.body));
  neck.replaceChildren(...parts);
  see.needed = true;
  const first = neck.querySelector(".open");
  first.tabIndex = 0;
  if (focused) first.focus();
  $("window").hidden = count === bass.frets;
  $("shown").textContent = `Frets ${bass.capo + from + 1} to ${bass.capo + from + count}`;
  $("down").disabled = from === 0;
  $("up").disabled = from + count >= bass.frets;
  neck.dataset.count = count;
}

// The rest of the strings, from `begin` (m from the nut) to the saddle: pickups, and the place of the right hand.
function bodyOf(bass, begin) {
  const body = document.createElement("div"), end = bass.strings[0].length;
  body.className = "body";
  body.dataset.begin = begin;
  for (const {position, aperture, strings} of bass.pickups) {
    const pickup = document.createElement("i"), rows = strings.map(i => bass.strings.length - 1 - i);
    pickup.className = "pickup";
    pickup.style.left = `${100 * (end - position - begin) / (end - begin)}%`;
    pickup.style.width = `${100 * aperture / (end - begin)}%`;
    pickup.style.top = `${100 * Math.min(...rows) / bass.strings.length}%`;
    pickup.style.bottom = `${100 * (1 - (Math.max(...rows) + 1) / bass.strings.length)}%`;
    body.append(pickup);
  }
  return body;
}

// Where a place (m from the nut) of a string is drawn on the neck, px; frets that are not shown are at its edges.
function placing() {
  const neck = $("neck"), at = $("strings").getBoundingClientRect().left, bass = bassCalled($("bass").value);
  const cells = [...neck.querySelectorAll('.fret[data-string="0"]')], body = neck.querySelector(".body").getBoundingClientRect();
  const {frets, length} = bass.strings[0], begin = +neck.querySelector(".body").dataset.begin;
  const metres = [from ? frets[from - 1] : 0], pixels = [cells[0].getBoundingClientRect().left - at];
  for (const cell of cells) {
    metres.push(frets[cell.dataset.fret - 1]);
    pixels.push(cell.getBoundingClientRect().right - at);
  }
  if (begin > metres.at(-1) + 1e-9) {
    metres.push(begin);
    pixels.push(body.left - at);
  }
  metres.push(length);
  pixels.push(body.right - at);
  return place => {
    let k = 1;
    while (k < metres.length - 1 && place > metres[k]) k++;
    const part = (place - metres[k - 1]) / (metres[k] - metres[k - 1]);
    return pixels[k - 1] + Math.min(1, Math.max(0, part)) * (pixels[k] - pixels[k - 1]);
  };
}

function shiftNeck(by) {
  from += by * Math.max(1, $("neck").dataset.count - 2);
  showNeck();
  layOut();
}
$("down").onclick = () => shiftNeck(-1);
$("up").onclick = () => shiftNeck(1);

// Arrow keys move over the neck.
$("neck").addEventListener("keydown", e => {
  const {string, fret} = e.target.dataset, move = {ArrowLeft: [0, -1], ArrowRight: [0, 1], ArrowUp: [1, 0], ArrowDown: [-1, 0]}[e.key];
  if (!move || fret === undefined) return;
  e.preventDefault();
  const wanted = [+string + move[0], +fret + move[1]];
  const at = ([s, f]) => $("neck").querySelector(`button[data-string="${s}"][data-fret="${f}"]`);
  if (!at(wanted) && move[1] > 0 && !$("up").disabled) shiftNeck(1);
  else if (!at(wanted) && move[1] < 0 && from > 0) { shiftNeck(-1); }
  else if (from > 0 && move[1] < 0 && wanted[1] === from) { shiftNeck(-1); }
  const cell = at(wanted);
  if (!cell) return;
  $("neck").querySelectorAll("button").forEach(other => { other.tabIndex = -1; });
  cell.tabIndex = 0;
  cell.focus();
});

let width = 0;
new ResizeObserver(() => {
  if ($("neck").clientWidth !== width) showNeck();
  layOut();
  width = $("neck").clientWidth;
}).observe($("neck"));

// --- what the audio thread tells ---

let loud = FLOOR, late = 0;

function showMeters({load, peak, overload, faults, held}) {
  const level = Math.max(FLOOR, peak > 0 ? 20 * Math.log10(peak) : FLOOR);
  loud = Math.max(level, loud - 2);
  $("level").ariaValueNow = loud.toFixed(0);
  $("level").style.setProperty("--part", (loud - FLOOR) / -FLOOR);
  $("level").classList.toggle("clipped", loud > 0);
  $("level-text").textContent = loud > FLOOR ? `${loud.toFixed(0)} dB` : "silent";
  late = Math.max(load, 0.85 * late);
  $("load").ariaValueNow = (100 * Math.min(1, late)).toFixed(0);
  $("load").style.setProperty("--part", Math.min(1, late));
  $("load-text").textContent = `${(100 * late).toFixed(0)} %`;
  $("overload").hidden = !(overload > 0 || load > 1);
  $("faults").textContent = faults === 1 ? "1 fault" : `${faults} faults`;
  $("neck").querySelectorAll(".on").forEach(cell => cell.classList.remove("on"));
  held.forEach((fret, string) => {
    if (fret >= 0) $("neck").querySelectorAll(`button[data-string="${string}"][data-fret="${fret}"], i[data-string="${string}"]`).forEach(cell => cell.classList.add("on"));
  });
}

// --- the pictures ---

const see = new See({neck: $("strings"), side: $("side"), note: $("note"), spectrum: $("spectrum")}, PAGE.sight, text => { $("seen").textContent = text; });
let analyser, place, lane, pitched = 0, drawn = 0;

// Measures where the neck is, when it was drawn anew.
function layOut() {
  const neck = $("neck"), strings = bassCalled($("bass").value).strings.length;
  const tall = neck.querySelector(".open").getBoundingClientRect().height;
  place = placing();
  lane = i => (strings - 0.5 - i) * tall;
  $("strings").style.height = `${tall * strings}px`;
  see.needed = true;
}

// The frame that is heard now; browsers without a time for it hear what was computed last.
function heardFrame() {
  const {contextTime, performanceTime} = context.getOutputTimestamp?.() || {};
  const time = performanceTime ? contextTime + (performance.now() - performanceTime) / 1000 : context.currentTime;
  return time * context.sampleRate - began;
}

let began = 0; // frame of the context at which the audio thread began: it tells

// Looks at the sound that is heard now, as often as the screen shows it; nothing is drawn while nothing changes.
function look(now) {
  requestAnimationFrame(look);
  if (PAGE.watching || PAGE.editing) see.follow(watched, now);
  if (PAGE.editing) {
    askPlugin();
  } else if (context && sounding) {
    const spare = see.follow(heardFrame(), now);
    if (spare && node) node.port.postMessage({spare}, [spare]);
    if (analyser && now - pitched > PITCH_EVERY) {
      pitched = now;
      showPitch();
      see.needed = true;
    }
  }
  if (see.replay) goOn(now);
  else see.fade(now);
  if (!sounding || late < FULL || now - drawn >= SHED) {
    drawn = now;
    see.draw(place, lane, analyser);
  }
  $("again").disabled = !ready || see.note.frame === undefined;
}

// --- the last note again ---

const BEFORE = 0.005, AFTER = 0.1; // s that are shown, before the release and after it
const HEARD = 1.5; // s of a pluck of the paper
let recalled, lastLook = 0, rolling = false, usualZoom;

// Asks the audio thread what the string was handed, and has the worker make its motion again from that.
async function showAgain() {
  const {string} = see.note;
  const {recalled: found, bass} = await new Promise(done => {
    recalled = done;
    node.port.postMessage({recall: string});
  });
  if (!found) return say("What that string did cannot be made again: play it from rest.");
  const {file, response} = basses.get(bass), rate = context.sampleRate, copy = file.slice(0);
  const made = await ask({recalled: found, file: copy, tier: PAGE.tier, rate, response,
                          before: Math.round(BEFORE * rate), frames: Math.round(AFTER * rate)}, [copy, found.told]);
  showSlowly(made);
}

// Shows a motion that the worker made, slowly, from its beginning.
function showSlowly(made) {
  if (!see.replay) usualZoom = see.zoom;
  see.show(made);
  enlarge(Math.min(usualZoom, Math.max(1, Math.floor(see.mostZoom(place, lane)))));
  Object.assign($("moment"), {max: see.replay.length - 1, value: 0, disabled: false});
  for (const id of ["picture", "clip"]) $(id).disabled = false;
  $("now").hidden = false;
  rolling = true;
  lastLook = performance.now();
  sayMoment();
}

// --- the cases of the paper ---

let source; // of the case that sounds

// Plucks the string of the paper as one of its cases, by no player: it is seen slowly, and heard where sound is wished.
// The bench counts.
async function showCase({apex, place, width, tier, says}, heard = true) {
  const {name} = paperBass();
  if ($("bass").value !== name) {
    $("bass").value = name;
    $("bass").dispatchEvent(new Event("change"));
  }
  if (heard) await sound();
  const rate = context.sampleRate, file = await changedFile(name, await read(`basses/${name}.lbass`));
  const [before, frames, length] = [BEFORE, AFTER, heard ? HEARD : 0].map(seconds => Math.round(seconds * rate));
  const made = await ask({pluck: {apex, place, width}, file, tier, rate, before, frames, heard: length}, [file]);
  see.rate = rate;
  see.note.fret = 0;
  showSlowly(made);
  $("case-said").textContent = says;
  if (!heard) return;
  source?.stop();
  source = new AudioBufferSourceNode(context, {buffer: new AudioBuffer({length, sampleRate: rate})});
  source.buffer.copyToChannel(made.sound, 0);
  source.connect(analyser);
  source.start();
}

const paperBass = () => PAGE.basses.find(({cases}) => cases.length);
const failed = error => say(`The case cannot be shown: ${error.message}`);

// Shows the case that the address of the page names, if it names one; it is silent until somebody asks for sound.
function showLinked() {
  const symbol = new URLSearchParams(location.hash.slice(1)).get("case");
  if (symbol === null) return;
  const one = paperBass()?.cases.find(one => one.symbol === symbol);
  if (one) showCase(one, false).catch(failed);
  else say(`The link names no case of this page: case=${symbol.slice(0, 20)}.`);
}

// A button for each case, where the page has the string of the paper.
function makeCases() {
  $("cases").hidden = !paperBass();
  addEventListener("hashchange", () => { if (ready) showLinked(); });
  for (const one of paperBass()?.cases || []) {
    const button = document.createElement("button");
    button.type = "button";
    button.id = `case-${one.symbol}`;
    button.textContent = one.title;
    button.onclick = () => showCase(one).catch(failed);
    $("cases").insertBefore(button, $("case-said"));
  }
}

// --- slow motion ---

// Goes on by the time since the last picture, at the speed that was chosen; at the end it stays.
function goOn(now) {
  if (rolling) {
    const frames = (now - lastLook) / 1000 * context.sampleRate / slowness();
    see.goTo(see.replay.at + frames, now);
    if (see.replay.at >= see.replay.length - 1) rolling = false;
    $("moment").value = see.replay.at;
    sayMoment();
    see.fade(now);
  }
  lastLook = now;
}

const slowness = () => Math.round(10 ** $("slow").value);

function sayMoment() {
  const text = `${see.moment.toFixed(2)} ms`;
  $("moment-text").textContent = text;
  $("moment").ariaValueText = `${text} after the release`;
}

function backToNow() {
  rolling = false;
  see.leave();
  enlarge(usualZoom);
  $("now").hidden = true;
  for (const id of ["moment", "picture", "clip"]) $(id).disabled = true;
  $("moment-text").textContent = "";
}

const POSTER = [1600, 1000], CLIP_RATE = 30, CLIP = {shortest: 3, longest: 12}; // px; pictures a second; s

function titleOf() {
  const {string, fret} = see.note, bass = bassCalled($("bass").value);
  const at = fret ? `, fret ${bass.capo + fret}` : "";
  return `livebass: ${bass.title}, ${bass.strings[string].name} string${at}, ${see.moment.toFixed(2)} ms after the release, ${see.zoom} times enlarged`;
}

function keep(blob, name) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}

const sheetOf = () => Object.assign(document.createElement("canvas"), {width: POSTER[0], height: POSTER[1]});
const fileName = ending => `livebass-${$("bass").value}-${see.moment.toFixed(1)}ms.${ending}`;

function savePicture() {
  const sheet = sheetOf();
  see.poster(sheet, titleOf());
  sheet.toBlob(blob => keep(blob, fileName("png")));
}

// Records the note from its beginning to its end, at the speed that was chosen or, if that would take too long, faster.
async function saveClip() {
  const sheet = sheetOf(), kind = ["video/mp4", "video/webm"].find(type => MediaRecorder.isTypeSupported(type));
  const recorder = new MediaRecorder(sheet.captureStream(CLIP_RATE), {mimeType: kind, videoBitsPerSecond: 6e6}), parts = [];
  recorder.ondataavailable = ({data}) => parts.push(data);
  const ended = new Promise(done => { recorder.onstop = done; });
  const {length} = see.replay, wanted = length / context.sampleRate * slowness();
  const seconds = Math.min(CLIP.longest, Math.max(CLIP.shortest, wanted));
  rolling = false;
  $("clip").disabled = true;
  recorder.start();
  const began = performance.now();
  for (let part = 0; part < 1 && see.replay;) {
    part = Math.min(1, (performance.now() - began) / 1000 / seconds);
    see.goTo(part * (length - 1), performance.now());
    $("moment").value = see.replay.at;
    sayMoment();
    see.poster(sheet, titleOf());
    await new Promise(done => setTimeout(done, 1000 / CLIP_RATE));
    see.fade(performance.now());
  }
  recorder.stop();
  await ended;
  if (!see.replay) return;
  $("clip").disabled = false;
  if (!parts.some(part => part.size)) throw new Error("this machine is too slow");
  keep(new Blob(parts, {type: kind}), fileName(kind.slice(6)));
}

$("picture").onclick = savePicture;
$("clip").onclick = () => saveClip().catch(error => say(`The clip cannot be recorded: ${error.message}`));
if (!window.MediaRecorder || !HTMLCanvasElement.prototype.captureStream) $("clip").hidden = true;
$("again").onclick = () => showAgain().catch(error => say(`The note cannot be made again: ${error.message}`));
$("now").onclick = backToNow;
$("slow").oninput = () => { $("slow-text").textContent = slowness() === 1 ? "as it was" : `1/${slowness()}`; };
$("slow").oninput();
$("moment").oninput = () => {
  rolling = false;
  see.goTo(+$("moment").value, performance.now());
  sayMoment();
};

// Shows the note that sounds, and by how many cents it is off.
function showPitch() {
  const sound = new Float32Array(analyser.fftSize);
  analyser.getFloatTimeDomainData(sound);
  const hertz = pitchOf(sound, context.sampleRate);
  if (!hertz) { $("pitch").textContent = ""; return; }
  const note = 69 + 12 * Math.log2(hertz / 440), nearest = Math.round(note), cents = Math.round(100 * (note - nearest));
  $("pitch").textContent = `${noteName(nearest)} ${cents < 0 ? "−" : "+"}${Math.abs(cents)} cents, ${hertz.toFixed(1)} Hz`;
}

document.addEventListener("visibilitychange", () => node?.port.postMessage({seeing: !document.hidden}));

$("zoom").oninput = () => {
  see.zoom = +$("zoom").value;
  $("zoom-text").textContent = `${see.zoom} times`;
  see.needed = true;
};
$("zoom").oninput();

function enlarge(times) {
  $("zoom").value = times;
  $("zoom").oninput();
}

// One picture at a time where there is no room for three.
const PICTURES = [["side", "Side"], ["note", "Last note"], ["spectrum", "Spectrum"]];
for (const [id, name] of PICTURES) {
  const tab = document.createElement("button");
  tab.type = "button";
  tab.textContent = name;
  tab.onclick = () => choosePicture(id);
  tab.dataset.picture = id;
  document.querySelector(".tabs").append(tab);
}

function choosePicture(chosen) {
  for (const tab of document.querySelectorAll(".tabs button")) tab.setAttribute("aria-pressed", tab.dataset.picture === chosen);
  for (const [id] of PICTURES) $(`${id}-figure`).classList.toggle("chosen", id === chosen);
  see.needed = true;
}
choosePicture("side");
for (const query of ["(prefers-color-scheme: light)", "(forced-colors: active)"])
  matchMedia(query).addEventListener("change", () => { see.needed = true; });

// --- a song, and a recording ---

const AHEAD = 0.15, LOOK_EVERY = 30; // s of a song that are sent ahead; ms between looks
let song, songName = "", rollingFrom, timer;
let songMessages = [], songAt = 0; // of the part that plays, and how many of them were sent

// Opens a MIDI file and chooses the part that is a bass.
async function openSong(file) {
  stopSong();
  song = new Song(await file.arrayBuffer(), context.sampleRate);
  songName = file.name;
  showParts();
  $("part").selectedIndex = Math.max(0, [...$("part").options].findIndex(({value}) => value === AUTO));
  $("roll").disabled = $("loop").disabled = false;
  const minutes = Math.floor(song.length / 60), seconds = String(Math.floor(song.length % 60)).padStart(2, "0");
  const lines = [`${songName}, ${minutes}:${seconds}: ${song.says()}`, ...song.remarks];
  $("song-text").textContent = lines.map(line => `${line}.`).join("\n");
}

// Lists the parts of the song for the bass that plays, whose key switches are no notes.
function showParts() {
  if (!song) return;
  const chosen = $("part").value;
  $("part").replaceChildren(...song.choices(bassCalled($("bass").value)).map(([value, text]) => new Option(text, value)));
  if ([...$("part").options].some(({value}) => value === chosen)) $("part").value = chosen;
  $("parts").hidden = $("part").options.length < 2;
}

async function rollSong() {
  if (rollingFrom !== undefined) return stopSong();
  await sound();
  putPart(); // takes a moment
  rollingFrom = context.currentTime + 0.1;
  songAt = 0;
  $("roll").textContent = "Stop song";
  $("roll").setAttribute("aria-pressed", true);
  timer = setInterval(sendSong, LOOK_EVERY);
  return sendSong();
}

// Takes the messages of the part that was chosen, from where the song is.
function takePart() {
  putPart();
  const now = (context.currentTime - rollingFrom) * song.rate;
  songAt = songMessages.filter(({frame}) => frame < now).length;
}

// Puts the part on the bass that plays: low keys that switch on another may be notes on it. Its messages are as many.
function putPart() {
  songMessages = song.messages($("part").value, bassCalled($("bass").value));
}

// Sends what comes in the next moments; begins again at the end of a loop.
function sendSong() {
  const until = context.currentTime + AHEAD - rollingFrom;
  while (songAt < songMessages.length && songMessages[songAt].frame <= until * song.rate) {
    const {frame, midi} = songMessages[songAt++];
    send(0, midi, undefined, Math.round(rollingFrom * song.rate) + frame);
  }
  if (songAt < songMessages.length || until < song.length + AHEAD) return;
  if ($("loop").ariaPressed !== "true") return stopSong();
  rollingFrom += Math.max(1, song.length);
  songAt = 0;
}

function stopSong() {
  clearInterval(timer);
  if (rollingFrom !== undefined) setTimeout(() => change({panic: true}), 1000 * AHEAD); // what was sent ahead ends, too
  rollingFrom = undefined;
  $("roll").textContent = "Play";
  $("roll").setAttribute("aria-pressed", false);
}

$("open").onclick = () => $("song-file").click();
const tryToOpen = file => PRESET.test(file.name) && benches.size ? takePreset(file) : openSong(file).catch(error => { $("song-text").textContent = `${file.name}: ${error.message}`; });
$("song-file").onchange = () => {
  const [file] = $("song-file").files;
  $("song-file").value = "";
  if (file) tryToOpen(file);
};
$("part").onchange = () => {
  if (rollingFrom === undefined) return;
  change({panic: true});
  takePart();
};
$("roll").onclick = () => rollSong().catch(error => say(error.message));
$("loop").onclick = () => $("loop").setAttribute("aria-pressed", $("loop").ariaPressed !== "true");
addEventListener("dragover", e => e.preventDefault());
addEventListener("drop", e => {
  e.preventDefault();
  const [file] = e.dataTransfer.files;
  if (file) tryToOpen(file);
});

let tape; // blocks of a recording

// Takes a part of the recording; the last one makes the file.
function taped({taped, last}) {
  tape?.push(taped);
  if (!last || !tape) return;
  keep(wavOf(tape, context.sampleRate), `livebass-${$("bass").value}.wav`);
  tape = undefined;
}

async function switchRecording() {
  const on = $("record").ariaPressed !== "true";
  if (on) {
    await sound();
    tape = [];
  }
  node.port.postMessage({record: on});
  $("record").setAttribute("aria-pressed", on);
  $("record").textContent = on ? "Stop and save" : "Record";
}
$("record").onclick = () => switchRecording().catch(error => say(error.message));

// --- controls ---

// Sliders, each of a parameter; its usual value leaves all as the bass has it.
const CONTROLS = {
  gain: value => value > PAGE.parameters.gain.least ? `${value} dB` : "silent",
  tone: value => value < 0 ? "darker" : value > 0 ? "brighter" : "its own",
  pluck_position: value => value < 0 ? "to the bridge" : value > 0 ? "to the neck" : "its own",
  compression: value => sayKnob("compression", value),
  drive: value => sayKnob("drive", value),
};

// What a knob of the effects comes to: at 0 it is as the bass has it.
function sayKnob(symbol, value) {
  const all = value || bassCalled($("bass").value)?.effects[symbol];
  return all ? `${Math.round(100 * all)} %` : "off";
}

function tellParameter(symbol) {
  const {number, effect} = PAGE.parameters[symbol], value = +$(symbol).value;
  if (node) change(effect < 0 ? {parameter: [number, value]} : {effect: [effect, value]});
}

function sayControl(symbol) {
  $(symbol).ariaValueText = $(`${symbol}-text`).textContent = CONTROLS[symbol](+$(symbol).value);
}

// Moves a slider to where a controller has moved its parameter.
function showControl(symbol, value) {
  const slider = $(symbol), within = Math.min(slider.max, Math.max(slider.min, value));
  if (Math.abs(within - slider.value) <= slider.step / 2 + 1e-9) return;
  slider.value = within;
  sayControl(symbol);
}

for (const symbol of Object.keys(CONTROLS)) {
  const {least, most, usual, unit} = PAGE.parameters[symbol], slider = $(symbol);
  Object.assign(slider, {min: least, max: most, step: unit ? 1 : 0.01, value: usual});
  slider.oninput = () => {
    sayControl(symbol);
    tellParameter(symbol);
  };
  slider.ondblclick = () => {
    slider.value = usual;
    slider.oninput();
  };
  sayControl(symbol);
}

function showBass() {
  if (see.replay) backToNow();
  const bass = bassCalled($("bass").value);
  sayControl("compression");
  sayControl("drive");
  $("about").textContent = bass.about;
  ownStroke(bass);
  see.setBass(bass);
  showNeck();
  layOut();
  showBench();
}

$("bass").onchange = () => {
  letGo();
  showBass();
  showParts();
  if (rollingFrom !== undefined) putPart();
  keepLink();
  if (ready) prepare($("bass").value);
  if (node) put();
};
$("power").onclick = () => switchPower().catch(() => {}); // said where it happened
$("force").oninput = () => { $("force-text").textContent = $("force").value; };
$("panic").onclick = () => {
  letGo();
  for (const way of WAYS) latch(way, false);
  panic();
};

const LEAST_LEVEL = 1e-3; // of the loudest channel: a channel below it is silent
let responseFile; // the audio file of the player's own impulse response: its name, {samples, channels, channel}

// Takes the impulse response in an audio file, whose rate the browser makes that of the sound: its first channel that is
// not silent.
async function readResponse(file) {
  const sound = await context.decodeAudioData(await file.arrayBuffer()).catch(() => { throw new Error("not an audio file"); });
  const channels = Array.from({length: sound.numberOfChannels}, (_, k) => sound.getChannelData(k));
  const loudest = channels.map(samples => samples.reduce((most, x) => Math.max(most, Math.abs(x)), 0)), most = Math.max(...loudest);
  const channel = loudest.findIndex(level => level >= LEAST_LEVEL * most);
  if (!(most > 0) || !Number.isFinite(most)) throw new Error("has no sound that can be played");
  return {name: file.name, samples: Float64Array.from(channels[channel]), channels: channels.length, channel};
}

// Builds the bass anew with the impulse response of an audio file, as loud as without it or, by the button, as the file
// has it; or without one of the player's own.
async function takeResponse(from) {
  let taken;
  if (from) {
    const normalized = $("response-level").ariaPressed !== "true", rate = context.sampleRate;
    taken = await ask({samples: from.samples, rate, normalized});
    if (!taken.length) throw new Error("has no sound that can be played");
    if (taken.length > LONGEST_RESPONSE * rate)
      throw new Error(`lasts ${(taken.length / rate).toFixed(1)} s; a response lasts ${LONGEST_RESPONSE} s at most`);
  }
  response = taken;
  responseFile = from;
  const which = from?.channels === 2 ? ["left", "right"][from.channel] : (from?.channel ?? 0) + 1;
  $("response-text").textContent = !from ? "" : from.channels === 1 ? `Through ${from.name}.`
    : `Through ${from.name}: ${from.channels} channels; ${from.channels === 2 ? `the ${which} one` : `number ${which}`} is played.`;
  $("response-off").hidden = $("response-level").hidden = !from;
  prepare($("bass").value);
  if (node) await put();
}

$("response").onclick = () => $("response-file").click();
$("response-off").onclick = () => takeResponse().catch(() => {});
$("response-level").onclick = () => {
  $("response-level").setAttribute("aria-pressed", $("response-level").ariaPressed !== "true");
  if (responseFile) takeResponse(responseFile).catch(() => {});
};
$("response-file").onchange = async () => {
  const [file] = $("response-file").files;
  $("response-file").value = ""; // the same file may be chosen again
  if (!file || !ready) return;
  await readResponse(file).then(takeResponse).catch(error => { $("response-text").textContent = `${file.name}: ${error.message}`; });
};

async function connectMidi() {
  const access = await navigator.requestMIDIAccess();
  const listen = () => {
    const inputs = [...access.inputs.values()];
    for (const input of inputs) input.onmidimessage = e => send(e.timeStamp, [...e.data]);
    $("midi-text").textContent = inputs.length
      ? `MIDI from ${inputs.map(input => input.name).join(", ")}.` : "No MIDI device is connected; one that is plugged in now is heard.";
  };
  access.onstatechange = listen;
  listen();
}

$("midi").onclick = () => {
  if (ready) sound().catch(() => {});
  connectMidi().catch(error => { $("midi-text").textContent = `The browser gives no MIDI: ${error.message}`; });
};
if (!navigator.requestMIDIAccess) {
  $("midi").hidden = true;
  $("midi-text").textContent = "This browser has no Web MIDI: play with keys, mouse or fingers. Chrome and Edge have it, Firefox on https and localhost.";
}

// --- the beginning ---

for (const bass of PAGE.basses) $("bass").add(new Option(bass.title, bass.name));
makePiano();
makeBench();
makeCases();
showKeys();
showBass();
takeLink();
const lack = !PAGE.watching && !PAGE.editing && lacking();
if (PAGE.watching) {
  watch();
} else if (PAGE.editing) {
  edit();
} else if (lack) {
  $("lacks").textContent = lack;
  $("lacks").hidden = false;
} else {
  loading = load();
  loading.then(() => {
    $("power").disabled = false;
    ready = true;
    start().catch(() => {}); // said where it happened
    showLinked();
  }, error => {
    loading = undefined;
    say(`The page cannot be opened: ${error.message}`);
  });
}
requestAnimationFrame(look);
