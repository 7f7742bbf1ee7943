// A synth and its basses in the memory of the WebAssembly module. Runs in the audio thread and in workers: no DOM.
"use strict";

const PAGE_BYTES = 65536, MESSAGES = 4096;
const CONTACTS = 512; // of a string, that begin before they are taken
const EVENTS = 256; // that a string was handed since it was still
const {records: RECORDS, numbers: N} = LAYOUT;
const lines = bytes => Math.ceil(bytes / N.LINE) * N.LINE;
const TOLD_BYTES = lines(RECORDS.TOLD.bytes + EVENTS * RECORDS.EVENT.bytes);

class Engine {
  constructor(module) {
    this.x = new WebAssembly.Instance(module).exports;
    this.memory = this.x.memory;
    this.numbers = {}; // of functions that kernels call by number
    for (const name of LAYOUT.called)
      this.numbers[name] = this.x.__indirect_function_table.grow(1, this.x["lb_" + name]);
    this.synth = lines(this.x.__heap_base.value);
    this.rings = this.synth + lines(RECORDS.SYNTH.bytes);
    this.sound = this.rings + Number(this.x.lb_ring_bytes(BigInt(MESSAGES)));
    this.sights = lines(this.sound + 4 * N.CHUNK); // what is drawn of each string ...
    this.logs = lines(this.sights + N.MOST_STRINGS * RECORDS.SIGHT.bytes); // ... and rings of its contacts
    this.tolds = lines(this.logs + N.MOST_STRINGS * CONTACTS * RECORDS.CONTACT.bytes); // ... and of its events
    this.home = this.tolds + N.MOST_STRINGS * TOLD_BYTES; // where basses may begin
    this.reserve(this.home);
    this.synthAddress = BigInt(this.synth);
    this.soundAddress = BigInt(this.sound);
  }

  // Makes memory up to the address `end`.
  reserve(end) {
    const more = Math.ceil((end - this.memory.buffer.byteLength) / PAGE_BYTES);
    if (more > 0) this.memory.grow(more);
    if (!this.view || this.view.buffer !== this.memory.buffer) {
      this.view = new DataView(this.memory.buffer);
      this.bytes = new Uint8Array(this.memory.buffer);
    }
  }

  get(record, address, name, index = 0) {
    const [offset, kind] = RECORDS[record].fields[name], at = address + offset + 8 * index;
    return kind === "f8" ? this.view.getFloat64(at, true) : Number(this.view.getBigInt64(at, true));
  }

  set(record, address, name, value, index = 0) {
    const [offset, kind] = RECORDS[record].fields[name], at = address + offset + 8 * index;
    if (kind === "f8") this.view.setFloat64(at, value, true);
    else this.view.setBigInt64(at, BigInt(value), true);
  }

  // --- basses ---

  // Lays out an instrument file, its operators and its bass from `at` on, at a rate (Hz); returns where it ends and the
  // address of the bass. An impulse response at that rate, a Float64Array, takes the place of the file's. Throws an
  // Error for a file that cannot be played.
  build(file, tier, rate, at, response = new Float64Array(0)) {
    const x = this.x, size = file.byteLength;
    const samples = lines(at + size), pool = lines(samples + response.byteLength);
    const building = pool + lines(RECORDS.POOL.bytes);
    let end = building + lines(RECORDS.BUILDING.bytes);
    this.reserve(end);
    this.bytes.fill(0, at, end);
    this.bytes.set(new Uint8Array(file), at);
    if (Number(x.lb_check_file(BigInt(at), BigInt(size))) !== N.GOOD) throw new Error("not a bass of this version");
    [tier, N.COARSE].forEach((which, k) => {
      this.set("POOL", pool, "file", at);
      this.set("POOL", pool, "tier", which);
      this.set("POOL", pool, "rate", rate);
      x.lb_measure_pool(BigInt(pool));
      this.set("POOL", pool, "memory", end);
      this.set("BUILDING", building, "operators", end, k);
      end = lines(end + this.get("POOL", pool, "bytes"));
      this.reserve(end);
      if (Number(x.lb_fill_pool(BigInt(pool))) !== N.DONE) throw new Error(`cannot be played at ${rate} Hz`);
    });
    this.set("BUILDING", building, "file", at);
    this.set("BUILDING", building, "tier", tier);
    this.set("BUILDING", building, "rate", rate);
    for (const name of ["over_frets", "over_board", "play_string"])
      this.set("BUILDING", building, name, this.numbers[name]);
    this.bytes.set(new Uint8Array(response.buffer), samples);
    this.set("BUILDING", building, "response", samples);
    this.set("BUILDING", building, "response_count", response.length);
    this.set("BUILDING", building, "response_rate", rate);
    x.lb_measure_bass(BigInt(building));
    this.set("BUILDING", building, "memory", end);
    const bass = end;
    end = lines(end + this.get("BUILDING", building, "bytes"));
    this.reserve(end);
    x.lb_fill_bass(BigInt(building));
    return {bass, end};
  }

  // --- the synth ---

  // Makes the synth as new, without a bass, at a rate (Hz).
  begin(rate) {
    this.x.lb_fill_synth(this.synthAddress, BigInt(this.rings), BigInt(MESSAGES), rate, -1n, 1,
                         BigInt(this.numbers.process));
    this.set("SYNTH", this.synth, "adaptive", 1);
  }

  field(name) { return this.get("SYNTH", this.synth, name); }
  setField(name, value) { this.set("SYNTH", this.synth, name, value); }

  // Sends a MIDI message for a frame of the synth, or N.NOW; false: there is no room for it.
  send(frame, status, first = 0, second = 0) {
    const ring = BigInt(this.get("SYNTH", this.synth, "midi_ring"));
    return Number(this.x.lb_push_message(ring, BigInt(MESSAGES), BigInt(frame), BigInt(status), BigInt(first),
                                         BigInt(second))) === 1;
  }

  // Sends an event of a kind other than MIDI.
  tell(frame, kind, number, value) {
    const ring = BigInt(this.get("SYNTH", this.synth, "midi_ring"));
    this.x.lb_push_event(ring, BigInt(MESSAGES), BigInt(frame), BigInt(kind), BigInt(number), value);
  }

  // Sets a parameter of the playing, by its number.
  setParameter(number, value) { this.tell(N.NOW, N.PARAMETER, number, value); }

  // Sets a knob of the effects, by its number.
  setEffect(number, value) { this.tell(N.NOW, N.EFFECT, number, value); }

  // --- what the strings do ---

  // The address of the VOICE of string `i`.
  voice(bass, i) { return this.get("BASS", bass, "string", i) + RECORDS.STRING.fields.voice[0]; }

  // Gives the strings of a bass room for their contacts and their events.
  openLogs(bass) {
    for (let i = 0; i < this.get("BASS", bass, "strings"); i++) {
      const voice = this.voice(bass, i);
      this.set("VOICE", voice, "log", this.logs + i * CONTACTS * RECORDS.CONTACT.bytes);
      this.set("VOICE", voice, "log_room", CONTACTS);
      this.set("VOICE", voice, "told", this.tolds + i * TOLD_BYTES);
      this.set("VOICE", voice, "told_room", EVENTS);
    }
  }

  // Adds to `list` the contacts that began since the last time, of which `taken` counts those of each string: string,
  // fret (over a board, m from the nut), frame, speed (m/s).
  takeContacts(bass, taken, list) {
    const began = this.get("BASS", bass, "frame"), board = this.get("BASS", bass, "frets") + 1;
    for (let i = 0; i < this.get("BASS", bass, "strings"); i++) {
      const voice = this.voice(bass, i), logged = this.get("VOICE", voice, "logged");
      if (logged === taken[i]) continue;
      const steps = this.get("VOICE", voice, "numerator") / this.get("VOICE", voice, "denominator");
      for (let k = Math.max(taken[i] || 0, logged - CONTACTS); k < logged; k++) {
        const at = this.logs + (i * CONTACTS + k % CONTACTS) * RECORDS.CONTACT.bytes;
        const of = name => this.get("CONTACT", at, name), stop = of("fret"), point = of("point");
        list.push(i, this.placeOf(bass, board * i + stop, stop, point), began + of("step") / steps, of("speed"));
      }
      taken[i] = logged;
    }
  }

  // Adds to `list` the notes that began since the last time, of which `told` counts the events of each string: string,
  // fret, and the frame at which a finger lets go or a string is struck.
  takeNotes(bass, told, list) {
    const began = this.get("BASS", bass, "frame"), strikes = [N.STRIKE_EVENT, N.THROW, N.HAMMER, N.PULL_OFF];
    for (let i = 0; i < this.get("BASS", bass, "strings"); i++) {
      const voice = this.voice(bass, i), count = this.get("VOICE", voice, "told_count");
      const first = count < told[i] ? 0 : told[i] || 0; // it was still, and counts anew
      for (let k = Math.max(first, count - EVENTS); k < count; k++) {
        const event = this.tolds + i * TOLD_BYTES + RECORDS.TOLD.bytes + (k % EVENTS) * RECORDS.EVENT.bytes;
        const kind = this.get("EVENT", event, "kind"), frame = began + this.get("EVENT", event, "frame");
        if (kind === N.PLUCK) list.push(i, this.get("EVENT", event, "fret"), frame + this.get("VOICE", voice, "pull"));
        else if (strikes.includes(kind)) list.push(i, this.get("EVENT", event, "fret"), frame);
      }
      told[i] = count;
    }
  }

  // The fret of a contact point of an operator; over a board its place, m from the nut.
  placeOf(bass, index, stop, point) {
    const op = this.get("BASS", bass, "operators") + RECORDS.OPERATOR.bytes * index;
    if (this.get("OPERATOR", op, "points") <= N.MOST_NEAR) return stop + 1 + point;
    const open = op - RECORDS.OPERATOR.bytes * stop, length = this.get("OPERATOR", op, "length");
    return this.get("OPERATOR", open, "length") - length + this.view.getFloat64(this.get("OPERATOR", op, "positions") + 8 * point, true);
  }

  // Copies what is seen of the strings of a bass into `buffer`, an ArrayBuffer as large as that, or a new one.
  see(bass, buffer) {
    const size = this.get("BASS", bass, "strings") * RECORDS.SIGHT.bytes;
    this.x.lb_see_bass(BigInt(bass), BigInt(this.sights));
    if (!buffer || buffer.byteLength !== size) buffer = new ArrayBuffer(size);
    new Uint8Array(buffer).set(this.bytes.subarray(this.sights, this.sights + size));
    return buffer;
  }

  // Plays n <= N.CHUNK frames; returns them as a view that lasts until the next call.
  play(n) {
    this.x.lb_process(this.synthAddress, this.soundAddress, BigInt(n));
    if (!this.out || this.out.length !== n || this.out.buffer !== this.memory.buffer)
      this.out = new Float32Array(this.memory.buffer, this.sound, n);
    return this.out;
  }
}
