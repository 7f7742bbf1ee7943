// The bench: what is changed of a bass, as keys of a preset that is like it. No DOM.
const SIGNIFICANT = 6; // digits of a value that is worked out; a preset has it as it is here
const MOST_UNDONE = 100;
export const SLOTS = ["A", "B"];
const NECK_KEYS = ["action", "relief", "nut_height"];
const rounded = value => +value.toPrecision(SIGNIFICANT);

export class Bench {
  // `bass`: one of the page that has a bench; `units`: the size of each unit, SI.
  constructor(bass, units) {
    this.bass = bass;
    this.units = units;
    this.of = bass.bench;
    this.controls = new Map(this.of.controls.map(control => [control.symbol, control]));
    this.slots = {A: {}, B: {}}; // by symbol: values that are not those of the preset
    this.slot = "A";
    this.before = []; // what `undo` brings back, the oldest first ...
    this.after = []; // ... and what `redo` does
    this.moving = undefined; // the symbol of a slider that is being moved: one step of undo
  }

  get values() { return this.slots[this.slot]; }
  get changed() { return Object.keys(this.values).length > 0; }

  // The row of a symbol; of "lift7", the lift of fret 7, that of "lift". Undefined: this bass has none.
  control(symbol) {
    const [, fret] = /^lift([1-9]\d?)$/.exec(symbol) || [];
    if (fret) return this.controls.has("lift") && +fret <= this.bass.frets ? this.controls.get("lift") : undefined;
    return symbol === "lift" ? undefined : this.controls.get(symbol);
  }

  // The preset's own value, in the control's unit.
  usual(symbol) {
    const {neck, contact, resonance, pickups, coil, player} = this.of, {unit} = this.control(symbol);
    const [, name, number] = /^([a-z_]+)(\d*)$/.exec(symbol) || [];
    const of = {
      lift: () => neck.lift[number] || 0,
      contact_loss: () => contact.loss[0],
      resonance: () => resonance.frequencies[resonance.lowest],
      resonance_mass: () => resonance.masses[resonance.lowest],
      gauge: () => 1, tension: () => 1, damping: () => 1, mute: () => 0, height: () => 0,
      pickup: () => pickups[+number - 1].position,
      tone: () => coil.tone,
      cable: () => coil.capacitance,
    }[name];
    return rounded((of ? of() : name in player ? player[name] : neck[name][0]) / (this.units[unit] || 1));
  }

  value(symbol) { return this.values[symbol] ?? this.usual(symbol); }

  // --- changes ---

  // Keeps what is there for `undo`.
  keep() {
    this.before.push({slot: this.slot, values: {...this.values}});
    if (this.before.length > MOST_UNDONE) this.before.shift();
    this.after.length = 0;
  }

  // Sets a value, within the limits; until `settle` further ones of the same symbol are the same step.
  set(symbol, value) {
    const {least, most} = this.control(symbol), usual = this.usual(symbol);
    if (this.moving !== symbol) this.keep();
    this.moving = symbol;
    value = rounded(Math.min(Math.max(value, Math.min(least, usual)), Math.max(most, usual)));
    if (value === usual) delete this.values[symbol];
    else this.values[symbol] = value;
  }

  // Ends the step of a slider.
  settle() { this.moving = undefined; }

  // Takes all values at once; others are as the preset has them.
  setAll(values) {
    this.settle();
    this.keep();
    this.slots[this.slot] = {};
    for (const [symbol, value] of Object.entries(values))
      if (this.control(symbol) && rounded(value) !== this.usual(symbol)) this.values[symbol] = rounded(value);
  }

  reset() { this.setAll({}); }

  // Goes on with A or B.
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

  // --- links ---

  // What a link says behind its #: the bass and the values that differ.
  link() {
    return new URLSearchParams({bass: this.bass.name, ...this.values}).toString();
  }

  // The name of the bass of a link and its values; no name: the link says nothing. Throws an Error, one line, for what
  // it may not say. `benches`: those of all basses, by name.
  static fromLink(text, benches) {
    const said = [...new URLSearchParams(text.replace(/^#/, ""))];
    if (!said.length) return {};
    const [[key, name], ...values] = said, bench = benches.get(name);
    if (key !== "bass" || !bench) throw new Error(`the link names no bass of this page that can be changed: ${said[0].join("=").slice(0, 40)}`);
    for (const [symbol, value] of values) {
      const control = bench.control(symbol);
      if (!control) throw new Error(`the link changes what this bass does not have: ${symbol.slice(0, 40)}`);
      const {least, most, unit} = control, usual = bench.usual(symbol);
      const good = value.trim() !== "" && +value >= Math.min(least, usual) && +value <= Math.max(most, usual);
      if (!good) throw new Error(`the link says ${symbol} = ${value.slice(0, 20)}: allowed are ${rounded(least)} to ${rounded(most)} ${unit}`.trimEnd());
    }
    return {name, values: Object.fromEntries(values.map(([symbol, value]) => [symbol, +value]))};
  }

  // --- the preset ---

  // A value as a preset has it, and what it reads there: {text, si}.
  quantity(value, unit) {
    const number = rounded(value);
    return unit ? {text: `"${number} ${unit}"`, si: number * this.units[unit]} : {text: `${number}`, si: number};
  }

  // A value in SI, worked out, in a unit.
  worked(si, unit) { return this.quantity(si / (this.units[unit] || 1), unit); }

  // One value for each string, or one for all if they are the same.
  list(values, unit) {
    const numbers = values.map(rounded), si = numbers.map(number => number * this.units[unit]);
    const same = numbers.every(number => number === numbers[0]);
    return {si, text: same ? `"${numbers[0]} ${unit}"` : `{unit = "${unit}", values = [${numbers.join(", ")}]}`};
  }

  // The keys of the preset that differ, {text, si} each, by section; of strings and pickups one object each.
  keys() {
    /** @type {{neck: any, strings: any[], pickups: any[], coil: any, player: any}} */
    const made = {neck: {}, strings: [], pickups: [], coil: {}, player: {}};
    const {values, of} = this, has = symbol => symbol in values;
    if (has("action")) made.neck.action = this.list(this.actions(), "mm");
    for (const name of ["relief", "nut_height", "contact_loss"])
      if (has(name)) made.neck[name] = this.quantity(values[name], this.control(name).unit);
    const lifted = Object.keys(values).filter(symbol => symbol.startsWith("lift"));
    if (lifted.length) made.neck.lift = this.lifts();
    if (has("resonance") || has("resonance_mass")) Object.assign(made.neck, this.resonances());
    made.strings = (of.strings || []).map(string => this.stringKeys(string));
    made.pickups = of.pickups.map((pickup, k) => this.pickupKeys(pickup, k + 1));
    if (has("tone")) made.coil.tone = this.quantity(values.tone);
    if (has("cable")) made.coil.capacitance = this.quantity(values.cable, "pF");
    for (const name of ["pluck_position", "rounding", "hardest"])
      if (has(name)) made.player[name] = this.quantity(values[name], this.control(name).unit);
    if (lifted.length || NECK_KEYS.some(has)) Object.assign(made.player, this.hand(made.neck));
    return made;
  }

  // The action of each string (mm): all go up and down in proportion.
  actions() {
    const {action} = this.of.neck;
    return action.map(each => this.value("action") * each / action[0]);
  }

  // The hand stays as it is while the neck changes: it measures its force by the preset's own.
  hand(changed) {
    const {neck} = this.of, made = {}, inMm = name => this.list(neck[name].map(si => si / this.units.mm), "mm");
    made.graze_action = inMm("action");
    for (const name of ["relief", "nut_height"]) if (changed[name]) made[`graze_${name}`] = inMm(name);
    return made;
  }

  // By which each fret stands proud, of all that do.
  lifts() {
    const frets = Array.from({length: this.bass.frets}, (_, k) => k + 1).filter(fret => this.value(`lift${fret}`));
    const each = frets.map(fret => ({fret, ...this.quantity(this.value(`lift${fret}`), "mm")}));
    return {text: `{${each.map(({fret, text}) => `${fret} = ${text}`).join(", ")}}`, si: Object.fromEntries(each.map(({fret, si}) => [fret, si]))};
  }

  // The neck's resonances: all their lists, as those of a preset take the place of others together.
  resonances() {
    const {lowest, frequencies, qualities, masses, shapes} = this.of.resonance;
    const withOwn = (values, symbol) => values.map((value, k) => k === lowest ? this.value(symbol) : value).join(", ");
    return {
      resonance_frequencies: {text: `{unit = "Hz", values = [${withOwn(frequencies, "resonance")}]}`, si: this.value("resonance")},
      resonance_qualities: {text: `[${qualities.join(", ")}]`},
      resonance_masses: {text: `{unit = "kg", values = [${withOwn(masses, "resonance_mass")}]}`, si: this.value("resonance_mass")},
      resonance_shapes: {text: `[${shapes.join(", ")}]`},
    };
  }

  // A string g times as thick, and t times as heavy for that: the pitch stays, so the tension goes with the mass. The
  // bending stiffness E I goes with g^4, and B with E I over the tension.
  stringKeys(string) {
    const {values} = this, g = this.value("gauge"), t = this.value("tension"), made = {};
    if ("gauge" in values) made.diameter = this.worked(string.diameter * g, "mm");
    if ("gauge" in values || "tension" in values) {
      made.linear_density = this.worked(string.linear_density * g * g * t, "g/m");
      made.tension = this.worked(string.tension * g * g * t, "N");
      made.inharmonicity = this.worked(string.inharmonicity * g * g / t);
    }
    if ("gauge" in values && string.axial_stiffness) made.axial_stiffness = this.worked(string.axial_stiffness * g * g, "N");
    if ("damping" in values)
      for (const name of ["viscoelastic_angle", "thermoelastic"]) made[name] = this.worked(string[name] * values.damping);
    if ("mute" in values) made.extra_damping = this.quantity(string.extra_damping + values.mute, "/s");
    return made;
  }

  // Nearer to the strings is louder: the flux falls e times with each decay length.
  pickupKeys({level, decay_length}, number) {
    const {values} = this, made = {}, place = `pickup${number}`, height = `height${number}`;
    if (place in values) made.position = this.quantity(values[place], "mm");
    if (height in values) made.level = this.quantity(level * Math.exp(values[height] * this.units.mm / decay_length));
    return made;
  }

  // The preset as a file: like the one of the page, and what differs.
  toml() {
    const {of} = this, keys = this.keys(), said = [`like = ${JSON.stringify(of.like)}`];
    const lines = table => Object.entries(table).map(([name, value]) => `${name} = ${value.text ?? value}`);
    const section = (head, table) => { if (Object.keys(table).length) said.push("", head, ...lines(table)); };
    said.push(...lines(of.head[""] || {}));
    section("[neck]", keys.neck);
    keys.strings.forEach((string, i) => section("[[string]]", Object.keys(string).length ? {name: JSON.stringify(of.strings[i].name), ...string} : {}));
    const behind = Math.max(0, ...keys.pickups.map((pickup, k) => Object.keys(pickup).length ? k + 1 : 0));
    for (const pickup of keys.pickups.slice(0, behind)) said.push("", "[[pickup]]", ...lines(pickup));
    section("[coil]", keys.coil);
    section("[player]", {...of.head.player, ...keys.player});
    section("[effects]", of.head.effects || {});
    return said.join("\n") + "\n";
  }

  // --- the notes ---

  // What the maker (maker.js) is told, in SI: numbers of the BENCH and of the INSTRUMENT.
  numbers() {
    const {of, bass} = this, keys = this.keys(), si = entry => entry?.si;
    /** @type {Record<string, any>} */
    const made = {strings: [], taps: [], instrument: []};
    if (keys.player.graze_action) {
      const now = name => [keys.neck[name]?.si ?? of.neck[name]].flat(), each = bass.strings.map((_, i) => i);
      const all = values => each.map(i => values[i] ?? values[0]), hand = name => all(si(keys.player[`graze_${name}`]) ?? of.neck[name]);
      const lift = keys.neck.lift?.si || of.neck.lift;
      made.neck = Object.fromEntries(NECK_KEYS.map(name => [name, all(now(name))]));
      made.neck.lifts = Object.keys(lift).length ? Array.from({length: bass.strings[0].frets.length}, (_, k) => lift[k + 1] || 0) : null;
      made.hand = Object.fromEntries(NECK_KEYS.map(name => [name, hand(name)]));
    }
    if (keys.neck.contact_loss) this.tellLoss(keys.neck.contact_loss.si, made);
    const {resonance_frequencies: frequency, resonance_masses: mass} = keys.neck;
    if (frequency) made.resonance = {place: of.resonance.lowest, frequency: frequency.si, mass: mass.si};
    keys.strings.forEach((string, i) => {
      const {axial_stiffness: axial, ...own} = string;
      for (const [name, value] of Object.entries(own)) made.strings.push([i, name, value.si]);
      if (axial) made.instrument.push(["stretch", i, axial.si / of.strings[i].stretches]);
    });
    keys.pickups.forEach(({position, level}, k) => {
      for (const [i, tap, strength] of of.pickups[k].senses) {
        if (position) made.taps.push([i, tap, position.si]);
        if (level) made.instrument.push(["mix", [i, tap], level.si * strength]);
      }
    });
    for (const [name, value] of Object.entries(keys.coil)) made.instrument.push([`circuit.${name}`, 0, value.si]);
    for (const [name, value] of Object.entries(keys.player))
      if (!name.startsWith("graze_")) made.instrument.push([`player.${name}`, 0, value.si]);
    return made;
  }

  // Tells the loss of contacts (N s/m), and the tiers that it calls for.
  tellLoss(loss, made) {
    const {pressing, tiers} = this.of.contact, each = pressing.map(force => loss / force); // s/m
    each.forEach((value, i) => made.strings.push([i, "contact_loss", value]));
    made.tiers = tiers.filter(({from}) => Math.min(...each) >= from).pop().tiers;
  }
}
