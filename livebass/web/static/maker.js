// Makes the instrument file of a bass that was changed on the bench, by the kernels that make it in Python.
// A .bench file has the count of its numbers, a BENCH, these numbers, and the
// strokes and effects of a file whose hand measures its force by another neck.
import {Engine, N, RECORDS, lines} from "./engine.js";

export class Maker {
  // `bench`: the .bench file of a bass, in a memory of its own.
  constructor(module, bench) {
    this.engine = new Engine(module);
    this.end = this.engine.home;
    const count = Number(new DataView(bench).getBigInt64(0, true)), size = RECORDS.BENCH.bytes;
    this.bench = this.put(new Uint8Array(bench, 8, size));
    this.numbers = this.put(new Uint8Array(bench, 8 + size, 8 * count));
    this.rest = new Uint8Array(bench, 8 + size + 8 * count);
    this.strings = this.get("strings");
    this.frets = this.get("frets");
    this.notes = this.strings * (this.frets + 1);
  }

  get(name) { return this.engine.get("BENCH", this.bench, name); }
  set(name, value, index = 0) { this.engine.set("BENCH", this.bench, name, value, index); }

  // The address of so many bytes, zeros.
  room(bytes) {
    const at = this.end;
    this.end = lines(at + bytes);
    this.engine.reserve(this.end);
    this.engine.bytes.fill(0, at, this.end);
    return at;
  }

  // The address of a copy of these bytes.
  put(bytes) {
    const at = this.room(bytes.length);
    this.engine.bytes.set(bytes, at);
    return at;
  }

  string(i) { return this.bench + RECORDS.BENCH.fields.string[0] + i * RECORDS.BENCH_STRING.bytes; }
  of(i, name) { return this.engine.get("BENCH_STRING", this.string(i), name); }

  // Number `k` of the lists of the strings, and to set it.
  number(k) { return this.engine.view.getFloat64(this.numbers + 8 * k, true); }
  setNumber(k, value) { this.engine.view.setFloat64(this.numbers + 8 * k, value, true); }

  // Takes the changes of a Bench (bench.js, `numbers`) but for the heights.
  change({strings, resonance, taps, tiers}) {
    for (const [i, name, value] of strings) this.engine.set("BENCH_STRING", this.string(i), name, value);
    for (let i = 0; i < this.strings && resonance; i++) {
      const row = this.of(i, "resonances") + 3 * resonance.place;
      this.setNumber(row, resonance.frequency);
      this.setNumber(row + 2, resonance.mass);
    }
    for (const [i, tap, place] of taps) this.setNumber(this.of(i, "taps") + this.of(i, "tap_width") * tap, place);
    tiers?.forEach(([modes], k) => this.set("tiers", modes, k));
  }

  // Gives the frets, or the board, the heights that follow from these (m).
  setNeck({action, relief, nut_height, lifts}) {
    const at = lifts ? this.put(new Uint8Array(Float64Array.from(lifts).buffer)) : 0;
    for (let i = 0; i < this.strings; i++)
      if (Number(this.engine.x.lb_set_neck(BigInt(this.bench), BigInt(i), action[i], relief[i], nut_height[i], BigInt(at))) !== N.SET)
        throw new Error("the heights of this neck are not set by action, relief and nut");
  }

  // Makes the notes. Throws an Error, one line, for a neck that cannot be played.
  fill(names) {
    const x = this.engine.x, bench = BigInt(this.bench);
    this.set("numbers", this.numbers);
    x.lb_measure_bench(bench);
    this.set("notes", this.room(this.notes * RECORDS.NOTE.bytes));
    this.set("modes", this.room(8 * N.TIERS * this.notes));
    this.set("lists", this.room(8 * this.get("room")));
    const state = Number(x.lb_fill_bench(bench));
    if (state === N.MADE) return;
    const place = this.get("fault_place"), above = `stands ${(1000 * this.get("fault_height")).toFixed(2)} mm above string ${names[this.get("fault_string")]} at rest`;
    throw new Error(state === N.CROWN_ABOVE ? `fret ${place} ${above}` : `the board ${above}, ${(1000 * place).toFixed(0)} mm from the stop`);
  }

  // The heights (m) of what string `i` may touch, open, as the hand measures by them.
  heightsUnder(i) {
    const note = this.get("notes") + i * (this.frets + 1) * RECORDS.NOTE.bytes, of = name => this.engine.get("NOTE", note, name);
    const list = of("surface_count") ? "surface" : "obstacles";
    const at = this.get("lists") + 8 * of(list);
    return Array.from({length: of(`${list}_count`)}, (_, k) => this.engine.view.getFloat64(at + 16 * k + 8, true));
  }

  // The crowns of each string, m from the open string.
  crowns() {
    return Array.from({length: this.strings}, (_, i) =>
      Array.from({length: this.of(i, "frets_count")}, (_, k) => this.number(this.of(i, "frets") + 2 * k + 1)));
  }

  // Sets numbers of the INSTRUMENT of the file at an address.
  setInstrument(file, {instrument, taps, tiers}) {
    const {view} = this.engine, at = name => file + RECORDS.FILE.fields[`instrument.${name}`][0];
    const place = index => Array.isArray(index) ? index[0] * N.MOST_PICKUPS + index[1] : index;
    for (const [name, index, value] of instrument) view.setFloat64(at(name) + 8 * place(index), value, true);
    for (const [i, tap, value] of taps) view.setFloat64(at("saddle") + 8 * place([i, tap]), value, true);
    tiers?.forEach(([, rate, heavy], k) => {
      const tier = at("tiers") + k * RECORDS.TIER.bytes;
      this.engine.set("TIER", tier, "contact_rate", rate);
      this.engine.set("TIER", tier, "heavy", heavy);
    });
  }

  // The instrument file of the bass whose own is `base`, with these changes: {file, heights}.
  make(base, changes, names) {
    this.change(changes);
    let hands = [];
    if (changes.hand) {
      this.setNeck(changes.hand);
      this.fill(names);
      hands = Array.from({length: this.strings}, (_, i) => this.heightsUnder(i));
    }
    if (changes.neck) this.setNeck(changes.neck);
    this.fill(names);
    const {engine} = this, head = new Uint8Array(base, 0, RECORDS.FILE.bytes), used = this.get("used");
    const strokes = 8 * N.ROOM_OF_STROKES, before = RECORDS.FILE.bytes + this.notes * (RECORDS.NOTE.bytes + 8 * N.TIERS);
    const version = hands.length ? N.WITH_EFFECTS : Number(new DataView(base).getBigInt64(RECORDS.FILE.fields.version[0], true));
    const rest = this.rest.slice(0, version === N.WITH_EFFECTS ? undefined : version === N.WITH_STROKES ? strokes : 0);
    const added = rest.length - RECORDS.ADDED.bytes, heights = hands.flat();
    hands.reduce((place, list, i) => {
      new DataView(rest.buffer).setBigInt64(added + RECORDS.ADDED.fields.hand[0] + 8 * i, BigInt(place + 1), true);
      return place + list.length;
    }, used);
    const size = before + 8 * (used + heights.length) + rest.length + 8, file = this.room(size);
    engine.bytes.set(head, file);
    engine.set("FILE", file, "version", version);
    engine.set("FILE", file, "words", size / 8);
    this.setInstrument(file, changes);
    heights.forEach((height, k) => engine.view.setFloat64(file + before + 8 * (used + k), height, true));
    engine.bytes.set(rest, file + size - 8 - rest.length);
    if (Number(engine.x.lb_keep_notes(BigInt(this.bench), BigInt(file))) !== N.DONE) throw new Error("the notes have no room");
    return {file: engine.memory.buffer.slice(file, file + size), heights: this.crowns()};
  }
}
