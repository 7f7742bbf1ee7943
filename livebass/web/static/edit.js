// The page as the editor of a plugin, in a web view of its host: what plays is an instance there, which is told what is
// done here and says what it does. livebass/plugin/c/page.h says how.
"use strict";

const SAID = {see: 0, move: 1, note: 2, undo: 3, swap: 4}, TOLD = {basses: 0, seen: 1};
const PHASES = {begin: 0, move: 1, end: 2}; // of a change by hand
const SETTLED = 300; // ms after a change here from which on what is told counts
const LOST = 1000; // ms, after which an answer is not waited for any more
const USUAL_RATE = 48000; // Hz, of a plugin that plays at none yet
const HAND_FREE = 0; // state of a string that no hand holds
const plugin = {basses: [], values: [], lights: [], notes: 0, asked: -Infinity, changed: -Infinity};
const knobs = []; // of parameters, by their numbers: {slider, output, parameter}
let side; // the button of A and B

const toPlugin = (...numbers) => parent.postMessage(new Float64Array(numbers).buffer, "*");

// Says that something is done here.
function doInPlugin(...numbers) {
  plugin.changed = performance.now();
  toPlugin(...numbers);
}

const moveKnob = (number, value, ...phases) => { for (const phase of phases) doInPlugin(SAID.move, number, value, PHASES[phase]); };

// Begins to edit: what the page would tell its audio thread goes to the plugin.
function edit() {
  document.body.classList.add("editing");
  node = {port: {postMessage: tellPlugin}};
  context = {state: "running", sampleRate: 0, currentTime: 0};
  sounding = true;
  makeKnobs();
  $("bass").onchange = () => { // it is shown once it plays
    const wanted = $("bass").selectedIndex;
    $("bass").value = plugin.name;
    moveKnob(PAGE.editing.bass, wanted, "begin", "move", "end");
  };
  addEventListener("message", ({data}) => {
    if (data instanceof ArrayBuffer) hearPlugin(data);
  });
  askPlugin(1);
}

// Asks what is to be seen, once the last answer is there.
function askPlugin(opened = 0) {
  if (performance.now() - plugin.asked < LOST) return;
  plugin.asked = performance.now();
  toPlugin(SAID.see, plugin.basses.length ? opened : 1);
}

function tellPlugin({midi, string = -1, parameter}) {
  if (midi && (midi[0] & 0xe0) === 0x80)
    doInPlugin(SAID.note, midi[0] >= 0x90 && midi[2] > 0 ? 1 : 0, string, midi[1], midi[2] / 127);
  if (parameter) moveKnob(parameter[0], parameter[1], "begin", "move", "end");
}

function hearPlugin(data) {
  const view = new DataView(data), kind = Number(view.getBigInt64(0, true));
  if (kind === TOLD.basses) {
    const lines = new TextDecoder().decode(data.slice(8)).split("\n").filter(line => line);
    plugin.basses = lines.map(line => line.split("\t"));
    $("bass").replaceChildren(...plugin.basses.map(([name, title]) => new Option(title, name)));
  }
  if (kind !== TOLD.seen) return;
  plugin.asked = -Infinity;
  const settled = performance.now() - plugin.changed > SETTLED, end = 24 + 8 * knobs.length;
  side.textContent = Number(view.getBigInt64(8, true)) ? "B" : "A";
  see.rate = view.getFloat64(16, true) || USUAL_RATE;
  knobs.forEach((knob, k) => showKnob(knob, view.getFloat64(24 + 8 * k, true), settled));
  if (data.byteLength > end) takeLook(new Look(data, end), settled);
}

// A LOOK in a message: what the plugin's window would show.
class Look {
  constructor(data, at) {
    Object.assign(this, {data, at, view: new DataView(data)});
    const {look, lane} = PAGE.editing;
    this.lanes = Array.from({length: this.get("strings")}, (_, i) => at + look.fields.string[0] + i * lane.bytes);
  }

  read(record, at, name, index) {
    const [offset, kind] = PAGE.editing[record].fields[name];
    if (kind === "f4") return this.view.getFloat32(at + offset + 4 * index, true);
    return kind === "f8" ? this.view.getFloat64(at + offset + 8 * index, true) : Number(this.view.getBigInt64(at + offset + 8 * index, true));
  }

  get(name, index = 0) { return this.read("look", this.at, name, index); }
  of(string, name, index = 0) { return this.read("lane", this.lanes[string], name, index); }

  // What is drawn of all strings.
  sights() {
    const {sight, lane} = PAGE.editing, all = new Uint8Array(this.lanes.length * sight), [first] = lane.fields.sight;
    this.lanes.forEach((at, i) => all.set(new Uint8Array(this.data, at + first, sight), i * sight));
    return all.buffer;
  }

  // The bass as the page knows basses: its measures as they are, its texts as it was exported, if it was.
  bass(name, title) {
    const known = PAGE.editing.basses[name], frets = this.get("frets"), fretless = this.get("fretless") > 0;
    const places = Array.from({length: frets}, (_, k) => this.get("place", k + 1));
    const strings = this.lanes.map((_, i) => ({
      name: known?.strings[i]?.name ?? NAMES[this.of(i, "open") % 12], note: this.of(i, "open"),
      gauge: known?.strings[i]?.gauge ?? 1, length: this.of(i, "length"), frets: places,
      heights: known?.strings[i]?.heights.slice(0, frets) ?? places.map(() => -2e-3),
    }));
    const pickups = Array.from({length: this.of(0, "pickups")}, (_, k) => ({
      position: this.of(0, "saddle", k), aperture: this.of(0, "aperture", k), strings: strings.map((_, i) => i),
    }));
    return {
      name, title, about: known?.about ?? "", strings, pickups: known?.pickups ?? pickups, body: strings[0].length - 0.3,
      pluck: ["nearest", "usual", "farthest"].map(name => this.get(name)), capo: known?.capo ?? 0, frets, fretless,
      stroke: known?.stroke, keys: known?.keys ?? {}, controllers: {}, effects: known?.effects ?? {}, cases: [],
    };
  }
}

function takeLook(look, settled) {
  const [name, title] = plugin.basses[plugin.values[PAGE.editing.bass]] || [];
  if (!name || !look.lanes.length) return;
  if (plugin.shown !== look.get("bass")) {
    plugin.shown = look.get("bass");
    plugin.name = name;
    plugin.lights = look.lanes.map(() => []);
    plugin.notes = look.get("notes");
    PAGE.basses = plugin.basses.map(([other]) => ({name: other, cases: []}));
    PAGE.basses[plugin.basses.findIndex(([other]) => other === name)] = look.bass(name, title);
    $("bass").value = name;
    showBass();
    say(`${title} plays.`);
  }
  watched = look.get("frame");
  see.take({sight: look.sights(), frame: watched, contacts: newContacts(look), notes: newNotes(look)});
  showMeters({
    load: look.get("load"), peak: look.get("peak"), overload: look.get("overload"), faults: 0,
    held: look.lanes.map((_, i) => look.of(i, "state") === HAND_FREE ? -1 : look.of(i, "fret")),
  });
  if (settled) showLamps(look);
}

// The places that were lit since the last look: string, fret or m from the nut, frame, m/s.
function newContacts(look) {
  const found = [];
  look.lanes.forEach((_, i) => {
    for (let k = 1; k <= look.get("frets"); k++) {
      const light = look.of(i, "light", k), before = plugin.lights[i][k] || 0;
      if (light > before) found.push(i, look.get("fretless") ? look.get("place", k) : k, watched, FULL_SPEED * light ** 2);
      plugin.lights[i][k] = light;
    }
  });
  return found;
}

function newNotes(look) {
  const before = plugin.notes, latest = look.get("latest");
  plugin.notes = look.get("notes");
  return plugin.notes > before && latest >= 0 ? [latest, look.of(latest, "fret"), watched] : [];
}

function showLamps(look) {
  const {switches, strokes, symbols} = PAGE.editing, switched = look.get("switched");
  const on = Object.fromEntries(WAYS.map(({symbol}) => [symbol, Math.floor(switched / 2 ** (switches[symbol] ?? 63)) % 2 === 1]));
  const values = Object.fromEntries(Object.keys(CONTROLS).map(symbol => [symbol, plugin.values[symbols.indexOf(symbol)]]));
  showPlaying({on, pluckedWith: look.get("slapped") > 0 ? "slap" : strokes[look.get("stroke")], values});
}

// --- parameters ---

const knobText = ({points, unit, whole}, value) => points.length ? points[Math.round(value)] : `${value.toFixed(whole ? 0 : 2)} ${unit}`.trim();

// Makes a slider for each parameter but that of the bass, by groups, and the buttons of their changes.
function makeKnobs() {
  const section = document.createElement("section"), groups = new Map();
  section.id = "knobs";
  section.ariaLabel = "Parameters";
  const tools = document.createElement("div");
  tools.className = "tools";
  for (const [text, title, said] of [["Undo", "Undo", SAID.undo], ["A", "A or B", SAID.swap]]) {
    const button = document.createElement("button");
    Object.assign(button, {type: "button", textContent: text, title, onclick: () => doInPlugin(said)});
    tools.append(button);
    side = button;
  }
  section.append(tools);
  PAGE.editing.parameters.forEach((parameter, number) => {
    const knob = makeKnob(parameter, number);
    knobs.push(knob);
    if (number === PAGE.editing.bass) return;
    if (!groups.has(parameter.group)) {
      const group = document.createElement("fieldset"), legend = document.createElement("legend");
      legend.textContent = parameter.group;
      group.append(legend);
      section.append(group);
      groups.set(parameter.group, group);
    }
    groups.get(parameter.group).append(knob.control);
  });
  document.querySelector("main").append(section);
}

function makeKnob(parameter, number) {
  const control = document.createElement("div"), label = document.createElement("label");
  const output = document.createElement("output"), slider = document.createElement("input");
  const {symbol, name, least, most, usual, whole, points} = parameter, knob = {control, output, slider, parameter, held: false};
  control.className = "control";
  label.textContent = name;
  label.htmlFor = slider.id = `knob-${symbol}`;
  Object.assign(slider, {type: "range", min: least, max: most, step: whole || points.length ? 1 : (most - least) / 1000});
  control.append(label, output, slider);
  const begin = () => {
    if (!knob.held) moveKnob(number, +slider.value, "begin");
    knob.held = true;
  };
  slider.oninput = () => {
    begin();
    moveKnob(number, +slider.value, "move");
    output.textContent = knobText(parameter, +slider.value);
  };
  slider.onchange = () => {
    if (knob.held) moveKnob(number, +slider.value, "end");
    knob.held = false;
  };
  slider.onpointerup = slider.onkeyup = slider.onblur = slider.onchange; // no change where it is back at its old value
  slider.ondblclick = () => {
    slider.value = usual;
    slider.oninput();
    slider.onchange();
  };
  return knob;
}

function showKnob({slider, output, parameter, held}, value, settled) {
  plugin.values[PAGE.editing.symbols.indexOf(parameter.symbol)] = value;
  if (held || !settled) return;
  slider.value = value;
  slider.ariaValueText = output.textContent = knobText(parameter, value);
}
