// A synth and its basses in the memory of the WebAssembly module. Runs in the audio thread and in workers: no DOM.
import {Kernels, N, RECORDS, lines} from "./kernels.js";
import {LAYOUT} from "../layout.js";

const MESSAGES = 4096;
export const PIECE = 4096; // bytes
const CONTACTS = 512; // that a string keeps until they are taken
const EVENTS = 256; // that a string received since it was still
// Of a string at rest: its clock, and what the player set; all else is the bass's
const KEPT = ["frame", "step", "still", "bend", "tuned", "tone_wanted", "blend_wanted", "idle"];
const GOLDEN = (Math.sqrt(5) - 1) / 2; // part of the length at which no mode has a node
const HELD = 2 ** 30; // frames of a pull that does not end
export const pieces = bytes => Math.ceil(bytes / PIECE) * PIECE;

export class Engine extends Kernels {
  constructor(module) {
    super(new WebAssembly.Instance(module));
    /** @type {Record<string, number>} */
    this.numbers = {}; // of functions that kernels call by number
    for (const name of LAYOUT.called)
      this.numbers[name] = this.x.__indirect_function_table.grow(1, this.x["lb_" + name]);
    this.synth = this.end;
    this.rings = this.synth + lines(RECORDS.SYNTH.bytes);
    this.sound = this.rings + Number(this.x.lb_ring_bytes(BigInt(MESSAGES)));
    this.sights = lines(this.sound + 8 * N.CHUNK); // drawing data of each string
    this.home = pieces(this.sights + N.MAX_STRINGS * RECORDS.SIGHT.bytes); // basses may begin here
    this.begins = this.end = this.home; // of what is in the memory
    this.reserve(this.home);
    this.synthAddress = BigInt(this.synth);
    this.soundAddress = BigInt(this.sound);
  }

  // Empties the memory, as if it were new.
  clear() {
    this.bytes.fill(0, this.synth, this.home);
    for (let at = this.begins; at < this.end; at += PIECE) this.empty(at);
    this.begins = this.end = this.home;
  }

  // --- memory in pieces: most of a silent bass is zeros, and memory that nobody has written costs nothing ---

  isEmpty(at) { return !new Float64Array(this.memory.buffer, at, PIECE / 8).some(word => !Object.is(word, 0)); }
  empty(at) { if (!this.isEmpty(at)) this.bytes.fill(0, at, at + PIECE); }

  // Returns the memory from `at` to `end` without its empty pieces: `full`, the others' numbers; and `image`, their bytes.
  pack(at, end) {
    const full = [];
    for (let k = 0; at + k * PIECE < end; k++) if (!this.isEmpty(at + k * PIECE)) full.push(k);
    const image = new Uint8Array(PIECE * full.length);
    full.forEach((k, i) => image.set(this.bytes.subarray(at + k * PIECE, at + (k + 1) * PIECE), i * PIECE));
    return {full, image: image.buffer};
  }

  // --- basses ---

  // Lays out a bass's image, its operators and its bass from `at` on, at a rate (Hz); returns the bass's
  // address. `response`, an impulse response at that rate, replaces the image's unless empty. Throws an Error for
  // one that cannot be played. Basses with the same `of`, unless 0, carry on each other's notes. The memory must hold
  // zeros.
  build(file, tier, rate, at, response = new Float64Array(0), of = 0) {
    const {x} = this, size = file.byteLength;
    this.begins = this.end = at;
    this.add(size);
    const samples = this.add(response.byteLength), pool = this.add(RECORDS.POOL.bytes);
    const building = this.add(RECORDS.BUILDING.bytes);
    this.bytes.set(new Uint8Array(file), at);
    if (Number(x.lb_check_file(BigInt(at), BigInt(size))) !== N.GOOD) throw new Error("not a bass of this version");
    [tier, N.COARSE].forEach((which, k) => {
      this.fill("POOL", pool, {file: at, tier: which, rate});
      x.lb_measure_pool(BigInt(pool));
      const operators = this.add(this.get("POOL", pool, "bytes"));
      this.set("POOL", pool, "memory", operators);
      this.set("POOL", pool, "clean", 1);
      this.set("BUILDING", building, "operators", operators, k);
      if (Number(x.lb_fill_pool(BigInt(pool))) !== N.DONE) throw new Error(`cannot be played at ${rate} Hz`);
    });
    this.bytes.set(new Uint8Array(response.buffer), samples);
    const {over_frets, over_board, play_string} = this.numbers;
    this.fill("BUILDING", building, {
      file: at, tier, rate, of, over_frets, over_board, play_string, log_room: CONTACTS, report_room: EVENTS,
      response: samples, response_count: response.length, response_rate: rate,
    });
    x.lb_measure_bass(BigInt(building));
    const bass = this.add(this.get("BUILDING", building, "bytes"));
    this.set("BUILDING", building, "memory", bass);
    this.set("BUILDING", building, "clean", 1);
    x.lb_fill_bass(BigInt(building));
    return bass;
  }

  // Cuts the silence from an impulse response, a Float64Array at a rate (Hz); returns a Float64Array, empty if all is
  // silence. `normalized`: the bass stays as loud as without the response.
  cutResponse(samples, rate, normalized) {
    const at = this.add(samples.byteLength);
    this.bytes.set(new Uint8Array(samples.buffer), at);
    const left = Number(this.x.lb_cut_response(BigInt(at), BigInt(samples.length), rate, normalized ? 1n : 0n));
    return new Float64Array(this.memory.buffer.slice(at, at + 8 * left));
  }

  // --- the synth ---

  // Resets the synth, without a bass, at a rate (Hz).
  begin(rate) {
    this.x.lb_fill_synth(this.synthAddress, BigInt(this.rings), BigInt(MESSAGES), rate, -1n, 1,
                         BigInt(this.numbers.process));
    this.set("SYNTH", this.synth, "adaptive", 1);
  }

  field(name) { return this.get("SYNTH", this.synth, name); }
  setField(name, value) { this.set("SYNTH", this.synth, name, value); }

  // Sends a MIDI message for a frame of the synth, or N.NOW; returns false if there is no room for it.
  send(frame, status, first = 0, second = 0) {
    const ring = BigInt(this.get("SYNTH", this.synth, "midi_ring"));
    return Number(this.x.lb_push_message(ring, BigInt(MESSAGES), BigInt(frame), BigInt(status), BigInt(first),
                                         BigInt(second))) === 1;
  }

  // Moves a controller on every channel, for notes of all channels.
  sendEverywhere(frame, controller, value) {
    for (let channel = 0; channel < N.CHANNELS; channel++) this.send(frame, 0xb0 | channel, controller, value);
  }

  // Sends an event that is not MIDI.
  tell(frame, kind, number, value) {
    const ring = BigInt(this.get("SYNTH", this.synth, "midi_ring"));
    this.x.lb_push_event(ring, BigInt(MESSAGES), BigInt(frame), BigInt(kind), BigInt(number), value);
  }

  // --- the strings' motion ---

  // The address of string `i`'s VOICE.
  voice(bass, i) { return this.get("BASS", bass, "string", i) + RECORDS.STRING.fields.voice[0]; }

  // Adds to `list` the contacts that began since the last call: string, fret (over a board, m from the nut), frame and
  // speed (m/s). `taken` counts each string's contacts so far.
  takeContacts(bass, taken, list) {
    const began = this.get("BASS", bass, "frame");
    for (let i = 0; i < this.get("BASS", bass, "strings"); i++) {
      const voice = this.voice(bass, i), logged = this.get("VOICE", voice, "logged");
      if (logged === taken[i]) continue;
      const steps = this.get("VOICE", voice, "numerator") / this.get("VOICE", voice, "denominator");
      for (let k = Math.max(taken[i] || 0, logged - CONTACTS); k < logged; k++) {
        const at = this.get("VOICE", voice, "log") + (k % CONTACTS) * RECORDS.CONTACT.bytes;
        const place = this.x.lb_see_contact(BigInt(bass), BigInt(i), BigInt(at));
        list.push(i, place, began + this.get("CONTACT", at, "step") / steps, this.get("CONTACT", at, "speed"));
      }
      taken[i] = logged;
    }
  }

  // Adds to `list` the notes that began since the last call: string, fret, and the frame of the finger's release or the
  // strike. `reports` holds for each string the frame from which its events are kept, and how many were taken.
  takeNotes(bass, reports, list) {
    for (let i = 0; i < this.get("BASS", bass, "strings"); i++) {
      const from = this.get("REPORTS", this.get("VOICE", this.voice(bass, i), "reports"), "from_frame"), [before, taken] = reports[i] || [];
      reports[i] = [from, this.takeNotesOf(bass, i, from === before ? taken : 0, list)];
    }
  }

  // Does this for string `i`, from its event `first` on; returns the number of events it received.
  takeNotesOf(bass, i, first, list) {
    const began = this.get("BASS", bass, "frame"), strikes = [N.STRIKE_EVENT, N.THROW, N.HAMMER, N.PULL_OFF];
    const voice = this.voice(bass, i), count = this.get("VOICE", voice, "report_count");
    for (let k = Math.max(first, count - EVENTS); k < count; k++) {
      const event = this.get("VOICE", voice, "reports") + RECORDS.REPORTS.bytes + (k % EVENTS) * RECORDS.EVENT.bytes;
      const kind = this.get("EVENT", event, "kind"), frame = began + this.get("EVENT", event, "frame");
      if (kind === N.PLUCK) list.push(i, this.get("EVENT", event, "fret"), frame + this.get("VOICE", voice, "pull"));
      else if (strikes.includes(kind)) list.push(i, this.get("EVENT", event, "fret"), frame);
    }
    return count;
  }

  // Returns all that string `i` received since it was still, to repeat its motion: its REPORTS and events, their number,
  // the number of notes, and the last note's frame; undefined: there were no events, or more than are kept.
  recall(bass, i) {
    const voice = this.voice(bass, i), count = this.get("VOICE", voice, "report_count"), notes = [];
    if (!count || count > EVENTS) return undefined;
    this.takeNotesOf(bass, i, 0, notes);
    const at = this.get("VOICE", voice, "reports"), size = RECORDS.REPORTS.bytes + count * RECORDS.EVENT.bytes;
    if (!notes.length) return undefined;
    return {reports: this.memory.buffer.slice(at, at + size), count, string: i, notes: notes.length / 3, frame: notes.at(-1) - this.get("BASS", bass, "frame")};
  }

  // Repeats a string's motion on `bass`, a new one, from the data of `recall`, from `before` frames before its last
  // note to `frames` after it; with `changed`, on a bass that differs: its string is at rest before the first event.
  // Returns the same as `motion`, with `heard` frames of sound.
  again(bass, {reports, count, string, frame}, {before, frames, heard, changed = false}) {
    const place = this.add(reports.byteLength);
    this.bytes.set(new Uint8Array(reports), place);
    if (!changed) this.x.lb_begin_again(BigInt(this.get("BASS", bass, "string", string)), BigInt(place));
    else for (const name of KEPT) this.set("VOICE", this.voice(bass, string), name, this.get("VOICE", place, name));
    return this.motion(bass, string, place + RECORDS.REPORTS.bytes, count, frame, before, frames, heard);
  }

  // Plays a note on string `string` of `bass`, a new one: MIDI messages `first`, such as a key switch, then the note.
  // Returns what `recall` returns.
  perform(bass, {string, note, velocity, first = []}, rate) {
    this.begin(rate);
    this.setField("next_bass", bass);
    this.play(N.CHUNK);
    for (const message of first) this.send(N.NOW, ...message);
    this.tell(N.NOW, N.NOTE_STRING, note, string);
    this.send(N.NOW, 0x90, note, velocity);
    let found;
    for (let k = 0; !found && k < rate; k += N.CHUNK) {
      this.play(N.CHUNK);
      found = this.recall(bass, string);
    }
    return found;
  }

  // Makes the motion of the first string of `bass`, a new one: a finger, `width` (m) wide, pulls it to `apex` (m) at
  // `place` (m from the nut) and lets go. Returns the same as `motion`, with `heard` frames of sound from the first
  // frame on.
  pluck(bass, {apex, place, width}, {before, frames, heard}) {
    const event = this.add(RECORDS.EVENT.bytes);
    this.fill("EVENT", event, {kind: N.PLUCK, apex, place, width});
    return this.motion(bass, 0, event, 1, this.get("VOICE", this.voice(bass, 0), "pull"), before, frames, heard);
  }

  // Lets go of string `string` of `bass`, a new one, that a hand holds at rest, as livebass simulate does: `apex` (m; below
  // 0: towards the frets) at `place` (m from the stop at `fret`), `angle` (rad) from away from the neck to across it.
  // Returns the same as `motion`, from the release on.
  letGo(bass, {string, fret, apex, place, angle}, {before, frames, heard}) {
    const voice = this.voice(bass, string), event = this.add(RECORDS.EVENT.bytes);
    this.fill("VOICE", voice, {pull: 0, follow: 0, angle: 0});
    this.fill("EVENT", event, {kind: N.PLUCK, string, fret, apex, place, angle});
    return this.motion(bass, string, event, 1, this.get("VOICE", voice, "frame"), before, frames, heard);
  }

  // How the shape of string `string`, stopped at `fret`, of `bass`, a new one, follows a hand that holds it: its `length`
  // (m), and the weight of each mode. Held `a` (m) at `p` (m from the stop), mode j has the amplitude
  // a / (p (length - p)) weights[j - 1] sin(j pi p / length).
  hold(bass, string, fret) {
    const board = this.get("BASS", bass, "frets") + 1, at = this.get("BASS", bass, "string", string);
    const ops = this.get("BASS", bass, "operators") + RECORDS.OPERATOR.bytes * board * string;
    const op = ops + RECORDS.OPERATOR.bytes * fret, length = this.get("OPERATOR", op, "length"), place = GOLDEN * length;
    const voice = this.voice(bass, string), event = this.add(RECORDS.EVENT.bytes);
    this.fill("VOICE", voice, {pull: HELD, angle: 0});
    this.fill("EVENT", event, {kind: N.PLUCK, string, fret, apex: 1, place});
    this.alone(bass, string, event, 1)(1);
    const slot = at + RECORDS.STRING.fields.slots[0] + RECORDS.SLOT.bytes * this.get("VOICE", voice, "slot");
    const held = slot + RECORDS.SLOT.fields.u[0], modes = this.get("OPERATOR", op, "modes");
    const weights = Float64Array.from({length: modes}, (_, j) =>
      this.get("WORK", held, "held", j) * place * (length - place) / Math.sin((j + 1) * Math.PI * GOLDEN));
    return {length, weights};
  }

  // The hardest pluck that the player of `bass` gives `note` on string `string`, which `hold` holds: its apex and place
  // (m); of a player who strikes, undefined.
  hardest(bass, string, note, rate) {
    const found = this.perform(bass, {string, note, velocity: 127}, rate), voice = this.voice(bass, string);
    for (let k = (found?.count || 0) - 1; k > 0; k--) { // the first event is that of `hold`
      const event = this.get("VOICE", voice, "reports") + RECORDS.REPORTS.bytes + k * RECORDS.EVENT.bytes;
      if (this.get("EVENT", event, "kind") !== N.PLUCK) continue;
      return {apex: this.get("EVENT", event, "apex"), place: this.get("EVENT", event, "place")};
    }
    return undefined;
  }

  // What a note of `velocity` does on string `string` of `bass`, a new one at rest, at each of `frets`; `open` is the open
  // string's key. Of each: its contacts within `frames` of the release, where it hits hardest (a fret, over a board m from
  // the nut; undefined without contacts), at what speed (m/s), and the frame of the last contact after the release.
  buzz(bass, {string, open, frets, velocity, frames}, rate) {
    const {end} = this, rest = this.bytes.slice(bass, end), voice = this.voice(bass, string);
    const toRest = () => {
      this.bytes.set(rest, bass);
      this.bytes.fill(0, this.synth, this.home);
      this.end = end;
    };
    return frets.map(fret => {
      const found = this.perform(bass, {string, note: open + fret, velocity}, rate), met = [], taken = [];
      toRest();
      if (!found) return {contacts: 0, hardest: undefined, speed: 0, last: 0};
      const place = this.add(found.reports.byteLength);
      this.bytes.set(new Uint8Array(found.reports), place);
      this.x.lb_begin_again(BigInt(this.get("BASS", bass, "string", string)), BigInt(place));
      const run = this.alone(bass, string, place + RECORDS.REPORTS.bytes, found.count), until = found.frame + frames;
      for (let at = this.get("VOICE", voice, "frame"); at < until; at += N.CHUNK) {
        run(Math.min(N.CHUNK, until - at));
        this.takeContacts(bass, taken, met);
      }
      toRest();
      let hardest, speed = 0, last = found.frame;
      for (let k = 0; k < met.length; k += 4) {
        last = Math.max(last, met[k + 2]);
        if (met[k + 3] > speed) [hardest, speed] = [met[k + 1], met[k + 3]];
      }
      return {contacts: met.length / 4, hardest, speed, last: last - found.frame};
    });
  }

  // Returns a function that plays n frames of string `string` of `bass` alone, with `count` events at the address `events`.
  alone(bass, string, events, count) {
    const board = this.get("BASS", bass, "frets") + 1, at = this.get("BASS", bass, "string", string);
    const ops = this.get("BASS", bass, "operators") + RECORDS.OPERATOR.bytes * board * string;
    let used = 0;
    return n => {
      for (let left = n; left > 0; left -= N.CHUNK)
        used += Number(this.x.lb_run_string(BigInt(at), BigInt(ops), BigInt(board - 1), BigInt(events + used * RECORDS.EVENT.bytes),
                                            BigInt(count - used), this.soundAddress, 0n, BigInt(Math.min(N.CHUNK, left))));
    };
  }

  // Plays `count` events, at the address `events`, on string `string` of `bass`. From `before` frames before `frame` to
  // `frames` after it, returns {rows, across, slots, lies, contacts, first, string, frame, sound}: SEEN amplitudes (m^1.5)
  // of u and of v per frame; [length, stop, fret, stop across] per frame; the higher fret that it lies on in the end, or
  // 0; contacts as in `takeContacts`; the first frame; the sound from there on, `heard` frames.
  motion(bass, string, events, count, frame, before, frames, heard = 0) {
    const x = this.x, strings = this.get("BASS", bass, "strings"), voice = this.voice(bass, string);
    const run = this.alone(bass, string, events, count);
    const first = Math.max(this.get("VOICE", voice, "frame"), frame - before), sound = new Float32Array(heard);
    run(first - this.get("VOICE", voice, "frame"));
    const length = frame + frames - first, slots = new Float64Array(length * 4);
    const [rows, across] = [0, 1].map(() => new Float32Array(length * N.SEEN));
    const contacts = [], taken = Array(strings).fill(0);
    let lies = 0;
    taken[string] = this.get("VOICE", voice, "logged");
    const sight = this.sights + string * RECORDS.SIGHT.bytes, [slot] = RECORDS.SIGHT.fields.slot, size = RECORDS.SLOT_SIGHT.bytes;
    for (let k = 0; k < length; k++) {
      run(1);
      if (k < heard) sound[k] = this.view.getFloat64(this.sound, true);
      x.lb_see_bass(BigInt(bass), BigInt(this.sights));
      this.takeContacts(bass, taken, contacts);
      const here = sight + slot + size * this.get("VOICE", voice, "slot");
      if (!this.get("SLOT_SIGHT", here, "on")) continue;
      const modes = this.get("SLOT_SIGHT", here, "modes");
      for (const [name, all] of /** @type {[string, Float32Array][]} */ ([["u", rows], ["v", across]]))
        all.set(new Float32Array(this.memory.buffer, here + RECORDS.SLOT_SIGHT.fields[name][0], modes), k * N.SEEN);
      slots.set(["length", "stop", "fret", "stop_across"].map(name => this.get("SLOT_SIGHT", here, name)), k * 4);
      lies = this.get("SLOT_SIGHT", here, "lies");
    }
    for (let k = length; k < heard; k += N.CHUNK) {
      const n = Math.min(N.CHUNK, heard - k);
      run(n);
      sound.set(new Float64Array(this.memory.buffer, this.sound, n), k);
    }
    return {rows, across, slots, lies, sound, contacts: contacts.map((value, k) => k % 4 === 2 ? value - this.get("BASS", bass, "frame") : value), first, string, frame};
  }

  // Copies the drawing data of a bass's strings into `buffer`, an ArrayBuffer of that size, or a new one.
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
