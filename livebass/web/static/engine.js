// A synth and its basses in the memory of the WebAssembly module. Runs in the audio thread and in workers: no DOM.
"use strict";

const PAGE_BYTES = 65536, MESSAGES = 4096;
const {records: RECORDS, numbers: N} = LAYOUT;
const lines = bytes => Math.ceil(bytes / N.LINE) * N.LINE;

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
    this.home = lines(this.sound + 4 * N.CHUNK); // where basses may begin
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

  // Plays n <= N.CHUNK frames; returns them as a view that lasts until the next call.
  play(n) {
    this.x.lb_process(this.synthAddress, this.soundAddress, BigInt(n));
    if (!this.out || this.out.length !== n || this.out.buffer !== this.memory.buffer)
      this.out = new Float32Array(this.memory.buffer, this.sound, n);
    return this.out;
  }
}
