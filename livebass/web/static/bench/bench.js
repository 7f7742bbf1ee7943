// The bench: a bass's slider values, as in links and presets. It has no DOM and no physics: the kernels make the bass
// (worker.js).
const MAX_UNDONE = 100;
export const SLOTS = ["A", "B"];
const BESIDES = ["riff", "stroke", "moment", "rang", "pulled", "made", "revision"]; // what else a link says (share.js)
const FORMAT = 1; // of links and presets
const NUMBER = /^[+-]?(\d+\.?\d*|\.\d+)$/;
const hundredths = value => Math.round(100 * value) / 100 + 0;

export const sameValues = (a, b) => JSON.stringify(Object.entries(a).sort()) === JSON.stringify(Object.entries(b).sort());

// Throws an Error, one line, for what a later livebass made.
function checkFormat(/** @type {string} */ format) {
  if (+format !== FORMAT) throw new Error(`made for a later livebass: this page reads format ${FORMAT}`);
}

export class Bench {
  // `bass`: one of the page's basses with a bench. `page`: its `parameters` of the playing, by symbol, as plugins have
  // them, and what `sliders` of all its basses have in common, by symbol.
  constructor(bass, page) {
    this.bass = bass;
    this.page = page;
    this.parameters = page.parameters;
    this.of = bass.bench;
    this.controls = new Map(this.of.sliders.map(slider => [slider.symbol, {...page.sliders[slider.symbol], ...slider}]));
    this.slots = {A: {}, B: {}}; // by symbol: values other than 0; 0 keeps the preset's
    this.slot = "A";
    this.before = []; // states for `undo`, the oldest first ...
    this.after = []; // ... and for `redo`
    this.revision = /** @type {number | undefined} */ (undefined); // an earlier one, which a link named; undefined: the present one
    this.moving = undefined; // the symbol of the slider being moved: one step of undo
    this.slid = undefined; // the symbol of the slider that moved last; undefined: all values came at once
    this.played = {A: {}, B: {}}; // the values that a bass was made of last
    this.stops = /** @type {{symbol: string, others: string, value: number, way: number}[]} */ ([]); // see `stopAt`
  }

  get values() { return this.slots[this.slot]; }
  get changed() { return Object.keys(this.values).length > 0; }

  value(symbol) { return this.values[symbol] ?? 0; }

  // A slider's result on this bass, in its `ownUnit`; undefined if that is not one number.
  comesTo(symbol, value) {
    const {own, unit} = this.controls.get(symbol);
    if (typeof own !== "number") return undefined;
    const all = /^pickup_\d_place$/.test(symbol) ? this.value("pickup_place") : 0; // moves each of them, too
    return unit === "%" ? own * (1 + value / 100) : own + value + all;
  }

  // --- changes ---

  // Keeps the present state for `undo`.
  keep() {
    this.before.push({slot: this.slot, values: {...this.values}});
    if (this.before.length > MAX_UNDONE) this.before.shift();
    this.after.length = 0;
  }

  // Sets a value, within the limits; further values of the same symbol belong to the same step until `settle`.
  set(symbol, value) {
    if (this.moving !== symbol) this.keep();
    this.moving = this.slid = symbol;
    this.put(symbol, value);
  }

  put(symbol, value) {
    const {minimum, maximum, points} = this.controls.get(symbol);
    value = hundredths(Math.min(Math.max(value, minimum), maximum));
    if (points.length) value = Math.round(value);
    const stop = this.stops.find(stop => stop.symbol === symbol && stop.others === this.others(symbol) && (value - stop.value) * stop.way > 0);
    if (stop) value = stop.value;
    if (value) this.values[symbol] = value;
    else delete this.values[symbol];
  }

  // Ends a slider's step.
  settle() { this.moving = undefined; }

  // Sets all values at once; the others are the preset's.
  setAll(values) {
    this.settle();
    this.keep();
    this.slots[this.slot] = {};
    this.slid = undefined;
    for (const [symbol, value] of Object.entries(values)) if (this.controls.has(symbol)) this.put(symbol, value);
  }

  reset() { this.setAll({}); }

  // Switches to A or B.
  choose(slot) {
    this.settle();
    this.slot = slot;
  }

  undo() { return this.step(this.before, this.after); }
  redo() { return this.step(this.after, this.before); }

  step(from, to) {
    this.settle();
    const kept = from.pop();
    if (!kept) return false;
    this.slot = kept.slot;
    to.push({slot: this.slot, values: this.values});
    this.slots[this.slot] = kept.values;
    return true;
  }

  // Number and value of each moved slider, for the kernels.
  moved(values = this.values) { return Object.entries(values).map(([symbol, value]) => [this.controls.get(symbol).number, value]); }

  // --- necks that cannot be played ---

  // What the other sliders and the revision say, as a text.
  others(/** @type {string} */ symbol) {
    return JSON.stringify([this.revision, Object.entries(this.values).filter(([other]) => other !== symbol).sort()]);
  }

  // The bench's values have no playable neck: finds the last ones that have, towards them from the values that played.
  // `isPlayable`: tells by values. Returns the values, the slider that stops there, and its way (-1: down); no slider:
  // several have moved, or a link did.
  async lastPlayable(wanted, /** @type {(values: object) => Promise<boolean>} */ isPlayable) {
    const played = this.played[this.slot], symbols = [...this.controls.keys()];
    const [symbol, ...more] = symbols.filter(symbol => (wanted[symbol] ?? 0) !== (played[symbol] ?? 0));
    if (more.length || symbol !== this.slid || this.controls.get(symbol).points.length) return {values: {...played}, symbol: undefined, way: 0};
    const {step} = this.controls.get(symbol), from = played[symbol] ?? 0, change = (wanted[symbol] ?? 0) - from, way = Math.sign(change);
    const at = n => ({...wanted, [symbol]: hundredths(from + way * n * step)});
    let [good, bad] = [0, Math.ceil(Math.abs(change) / step - 1e-9)];
    while (bad - good > 1) {
      const middle = (good + bad) >> 1;
      if (await isPlayable(at(middle))) good = middle;
      else bad = middle;
    }
    return {values: at(good), symbol, way};
  }

  // Goes back to playable values; the slider `symbol` stops there from now on, as long as the others stay.
  stopAt({values, symbol, way}) {
    this.slots[this.slot] = Object.fromEntries(Object.entries(values).filter(([, value]) => value));
    if (symbol) this.stops.push({symbol, others: this.others(symbol), value: this.value(symbol), way});
    const last = this.before.at(-1);
    if (last?.slot === this.slot && sameValues(last.values, this.values)) this.before.pop();
  }

  // --- links and presets ---

  // A link's text after its #: the bass, the changed values and more.
  link(more = {}) {
    const revision = this.revision === undefined ? {} : {revision: this.revision};
    return new URLSearchParams({like: this.bass.name, ...this.values, ...revision, ...more}).toString();
  }

  // The path of the file of the bass in its revision.
  get file() { return `basses/${this.bass.name}${this.revision === undefined ? "" : `@${this.revision}`}.lbass`; }

  // Returns a link's bass, by name, its slider values, its parameters, and the names that this bass does not know, such
  // as a mail program's; no name: the link is empty. Throws an Error, one line, for an invalid link. `benches`: the
  // benches of all basses, by name.
  static fromLink(text, benches) {
    const said = [...new URLSearchParams(text.replace(/^#/, ""))];
    if (!said.length) return {};
    const [[key, name], ...values] = said, bench = benches.get(name);
    if (key !== "like" || !bench) throw new Error(`the link names no bass of this page that can be changed: ${said[0].join("=").slice(0, 40)}`);
    const found = {name, values: {}, played: {}, ignored: /** @type {string[]} */ ([]), revision: undefined};
    for (const [written, value] of values) {
      const symbol = bench.today(written);
      if (symbol === "format") checkFormat(value);
      if (symbol === "revision" && +value !== bench.bass.revision) found.revision = bench.earlier(value);
      if (symbol === "format" || BESIDES.includes(symbol)) continue;
      if (!bench.limits(symbol)) found.ignored.push(symbol.slice(0, 40));
      else found[bench.controls.has(symbol) ? "values" : "played"][symbol] = bench.read("link", symbol, value);
    }
    return found;
  }

  // The number of an earlier revision that a link names. Throws an Error, one line, if the page does not have it.
  earlier(/** @type {string} */ text) {
    if (this.bass.earlier?.includes(+text)) return +text;
    const has = this.bass.revision === undefined ? "has no revisions" : `has revisions up to ${this.bass.revision}`;
    throw new Error(`the link is of revision ${text.slice(0, 9)} of ${this.bass.title}, which ${has} on this page`);
  }

  // The present name of what an older version may have called otherwise.
  today(/** @type {string} */ symbol) { return Object.hasOwn(this.of.renamed, symbol) ? this.of.renamed[symbol] : symbol; }

  // A slider or a parameter of the playing, with its limits; undefined: this bass has neither.
  limits(symbol) { return this.controls.get(symbol) ?? (Object.hasOwn(this.parameters, symbol) ? this.parameters[symbol] : undefined); }

  // The number that a `link` or `preset` gives a symbol. Throws an Error, one line, for one that it may not have.
  read(kind, symbol, value) {
    const limits = this.limits(symbol);
    if (!limits) throw new Error(`the ${kind} changes what this bass does not have: ${symbol.slice(0, 40)}`);
    const {minimum, maximum, unit} = limits;
    if (!NUMBER.test(value.trim()) || +value < minimum || +value > maximum)
      throw new Error(`the ${kind} says ${symbol} = ${value.slice(0, 20)}: it must be from ${minimum} to ${maximum} ${unit}`.trimEnd());
    return +value;
  }

  // The preset as a file: `like` the page's, with the changed values and these parameters of the playing.
  toml(played = {}) {
    const {head, like} = this.of, said = [`like = ${JSON.stringify(like)}`];
    const section = (name, table) => {
      const lines = Object.entries(table || {}).map(([key, value]) => `${key} = ${value}`);
      if (lines.length) said.push(...name ? ["", `[${name}]`] : [], ...lines);
    };
    section("", head[""]);
    section("bench", this.values);
    section("plugin", played);
    section("player", head.player);
    section("effects", head.effects);
    return said.join("\n") + "\n";
  }

  // Returns the bass's name from a preset that a page or a plugin saved, its slider values, and its parameters of the
  // playing. Throws an Error, one line, for any other preset.
  static fromToml(text, benches) {
    let section = "", bench;
    const found = {name: "", values: {}, played: {}};
    for (const line of text.split(/\r?\n/).map(line => line.replace(/#.*/, "").trim()).filter(line => line)) {
      const [, header] = /^\[(\w+)\]$/.exec(line) || [], [, key, value] = /^(\w+)\s*=\s*(.+)$/.exec(line) || [];
      const symbol = bench && key && bench.today(key);
      if (header) section = header;
      else if (!section && key === "like") {
        bench = [...benches.values()].find(({of}) => JSON.stringify(of.like) === value);
        if (!bench) throw new Error(`the preset is like a bass that this page does not have or cannot change: ${value.slice(0, 40)}`);
        found.name = bench.bass.name;
      } else if (!section && key === "format") checkFormat(value);
      else if (bench && !section && (key === "name" || key === "description")) continue;
      else if (symbol && section === "bench") found.values[symbol] = bench.read("preset", symbol, value);
      else if (symbol && section === "plugin") found.played[symbol] = bench.read("preset", symbol, value);
      else if (bench?.of.head[section]?.[key] !== value) throw new Error(`a page opens presets that it or a plugin saved, and they have no such line: ${line.slice(0, 40)}`);
    }
    if (!bench) throw new Error("the preset does not say which bass it is like");
    return found;
  }
}
