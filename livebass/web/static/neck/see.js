// The motion of the strings: their shapes from their modes, and the frets that they hit. It follows the sound that is heard,
// not the sound that is computed; pictures.js draws it.
export const POINTS = 160; // steps of a drawn string
export const SHOWN = {before: 0.005, after: 0.1}; // s of a replay, from the note's release on
export const FULL_SPEED = 4; // m/s of a string whose hit is drawn at full strength
const MAX_SIGHTS = 8; // waiting for their sound
const REPORTED_AFTER = 0.5; // s after which a note is told ...
const LATEST = 2; // ... once all hits until then are known; or after so many s
const FLASH = 300; // ms that a flash stays
const MIN_REACH = 0.5e-3; // m, that a picture has room for
const SOME = 24; // frames between measured shapes of a replay
const SAME_PLACE = 2e-6; // m

export class See {
  // `records`: SIGHT and SLOT_SIGHT, as the kernels lay them out. `onNote` is called with a note half a second after it
  // began, `kept` as soon as the part that a replay shows was heard.
  constructor(records, onNote, kept) {
    /** @type {(note: SeenNote) => void} */
    this.onNote = onNote;
    /** @type {(note: SeenNote) => void} */
    this.kept = kept;
    /** @type {RecordFields} */
    this.record = records.SIGHT;
    /** @type {RecordFields & {seen: number}} */
    this.slot = records.SLOT_SIGHT;
    this.seen = this.slot.seen;
    this.sines = new Float32Array((POINTS + 1) * this.seen);
    for (let k = 0; k <= POINTS; k++)
      for (let j = 0; j < this.seen; j++) this.sines[k * this.seen + j] = Math.sin(Math.PI * (j + 1) * k / POINTS);
    this.rate = 48000; // Hz
    this.known = 0; // the frame of the newest sight
    /** @type {Bass} */
    this.bass = /** @type {any} */ (undefined);
    /** @type {DataView<ArrayBuffer> | undefined} */
    this.view = undefined; // of the drawn sight
    /** @type {Replay | undefined} */
    this.replay = undefined;
    /** @type {Replay | undefined} */
    this.other = undefined; // the same pluck on another bass, beside the replay
    /** @type {SeenNote} */
    this.live = {string: 0, contacts: []}; // the last note that was played, while a replay is shown
    /** @type {HeldShape | undefined} */
    this.held = undefined; // the string in a hand
    /** @type {{frame: number, buffer: ArrayBuffer}[]} */
    this.sights = []; // the oldest first
    /** @type {Hit[]} */
    this.waiting = []; // contacts not heard yet
    /** @type {SeenNote[]} */
    this.plucks = []; // notes not heard yet
    /** @type {Map<string, Flash>} */
    this.flashes = new Map(); // by "string fret"
    /** @type {SeenNote} */
    this.note = {string: 0, contacts: []}; // the last one
    this.shapes = {u: new Float32Array(POINTS + 1), v: new Float32Array(POINTS + 1)};
    this.reach = {below: 0, above: MIN_REACH, across: MIN_REACH}; // m, of the last note's motion so far
    this.needed = true; // something must be redrawn
  }

  // Takes the strings, frets and pickups of another bass.
  setBass(bass) {
    this.bass = bass;
    this.sights.length = this.waiting.length = this.plucks.length = 0;
    this.flashes.clear();
    this.begin(this.live = {string: 0, contacts: []});
    this.view = this.held = undefined;
  }

  // A note begins.
  begin(note) {
    this.note = note;
    this.reach = {below: 0, above: MIN_REACH, across: MIN_REACH};
    this.needed = true;
  }

  // Takes a sight of the audio thread at a frame; returns a buffer that it can reuse, or undefined. `of`: the bass.
  take({sight, frame, contacts, notes, of = 0}) {
    for (let k = 0; k < notes.length; k += 3)
      this.plucks.push({string: notes[k], fret: notes[k + 1], frame: notes[k + 2], contacts: [], of});
    for (let k = 0; k < contacts.length; k += 4)
      this.waiting.push({string: contacts[k], fret: contacts[k + 1], frame: contacts[k + 2], speed: contacts[k + 3]});
    this.sights.push({frame, buffer: sight});
    this.known = frame;
    return this.sights.length > MAX_SIGHTS ? this.sights.shift()?.buffer : undefined;
  }

  // The place of slot `index` of a string in a sight.
  slotAt(string, index) {
    return string * this.record.bytes + this.record.fields.slot[0] + index * this.slot.bytes;
  }

  // A field of slot `index` of a string in the drawn sight.
  read(string, index, name) {
    if (!this.view) return 0;
    const [offset, kind] = this.slot.fields[name], at = this.slotAt(string, index) + offset;
    return kind === "f8" ? this.view.getFloat64(at, true) : Number(this.view.getBigInt64(at, true));
  }

  // Calls draw({string, fret, length, u, v}) for each sounding part of a string: u from the open string's rest line
  // away from the frets, v along them, m, (POINTS + 1), from its stop to the saddle.
  eachString(draw) {
    if (this.replay) {
      this.drawReplay(this.replay, this.replay.at, draw);
      return;
    }
    if (this.held) draw(this.held);
    if (!this.view) return;
    const {buffer} = this.view, {fields} = this.slot;
    for (let string = 0; string < this.bass.strings.length; string++)
      for (let index = 0; index < 2; index++) {
        if (string === this.held?.string || !this.read(string, index, "on")) continue;
        const at = this.slotAt(string, index), read = name => this.read(string, index, name);
        const [u, v] = ["u", "v"].map(name => new Float32Array(buffer, at + fields[name][0], this.seen));
        const [fret, length, stop, aside, modes] = ["fret", "length", "stop", "stop_across", "modes"].map(read);
        const own = this.bass.strings[string], end = stop + this.restOf(own.heights, this.crownOf(own, length, fret));
        const shape = {string, fret, length, ...this.shape(u, v, Math.min(this.seen, modes), length, end, aside)};
        if (string === this.note.string) this.measure(shape);
        draw(shape);
      }
  }

  // Does this for row `at` of a replay.
  drawReplay({rows, across, slots, string, heights = this.bass.strings[string].heights}, at, draw) {
    const k = Math.floor(at), [length, stop, fret, aside] = slots.subarray(4 * k, 4 * k + 4);
    const [u, v] = [rows, across].map(all => all.subarray(k * this.seen, (k + 1) * this.seen));
    const end = stop + this.restOf(heights, this.crownOf(this.bass.strings[string], length, fret));
    if (length) draw({string, fret, length, ...this.shape(u, v, this.seen, length, end, aside)});
  }

  // The fret at which a string ends that is `sounding` m long: `fret`, or over a board a higher one that it lies on.
  crownOf({length, frets}, sounding, fret) {
    return 1 + frets.findIndex(place => Math.abs(length - place - sounding) < SAME_PLACE) || fret;
  }

  // The higher fret that the string of a motion lies on in the end; undefined: it does not fret out.
  /** @returns {number | undefined} */
  liesOn({lies}) { return lies || undefined; }

  // The height (m) of a string's end at rest, on its fret's crown.
  restOf(heights, fret) { return fret ? heights[fret - 1] : 0; }

  // {u, v} (m) from amplitudes on a string of `length` m whose stop is at `stop` and `aside` (m).
  shape(u, v, modes, length, stop, aside) {
    this.fill(this.shapes.u, u, modes, length, stop);
    this.fill(this.shapes.v, v, modes, length, aside);
    return this.shapes;
  }

  fill(shape, q, modes, length, stop) {
    const scale = Math.sqrt(2 / length), {seen, sines} = this;
    for (let k = 0; k <= POINTS; k++) {
      let sum = 0;
      for (let j = 0, at = k * seen; j < modes; j++) sum += q[j] * sines[at + j];
      shape[k] = scale * sum + stop * (1 - k / POINTS);
    }
  }

  // Widens the last note's reach to a shape.
  measure({u, v}) {
    const {reach} = this;
    for (const x of u) {
      reach.above = Math.max(reach.above, x);
      reach.below = Math.min(reach.below, x);
    }
    for (const x of v) reach.across = Math.max(reach.across, Math.abs(x));
  }

  // --- time ---

  // Advances to the frame heard now: its newest sight, the contacts until then. Returns the previous sight's buffer for
  // reuse, or undefined.
  follow(frame, now) {
    let newest;
    const before = this.view?.buffer;
    while (this.sights.length && this.sights[0].frame <= frame) newest = this.sights.shift();
    if (newest) {
      this.view = new DataView(newest.buffer);
      this.needed = true;
    }
    while (this.plucks.length && Number(this.plucks[0].frame) <= frame) {
      [this.live] = this.plucks.splice(0, 1);
      if (!this.replay) this.begin(this.live);
    }
    const heard = this.waiting.filter(contact => contact.frame <= frame);
    if (heard.length) this.waiting = this.waiting.filter(contact => contact.frame > frame);
    if (this.replay) return newest && before;
    for (const contact of heard) this.flash(contact, now);
    this.say(frame);
    return newest && before;
  }

  // Passes the last note on once it was heard for long enough.
  say(frame) {
    const {note} = this;
    if (note.frame === undefined) return;
    const since = (frame - note.frame) / this.rate;
    if (!note.wasKept && since > SHOWN.after) {
      note.wasKept = true;
      this.kept(note);
    }
    const known = (Math.min(frame, this.known) - note.frame) / this.rate;
    if (!note.wasReported && (known > REPORTED_AFTER || since > LATEST)) {
      note.wasReported = true;
      this.onNote(note);
    }
  }

  flash(hit, now) {
    const {string, frame} = hit, {note} = this;
    this.light(hit, 1, now);
    if (string === note.string && note.frame !== undefined && frame >= note.frame) note.contacts.push(hit);
    this.needed = true;
  }

  // Lights the flash of a hit; it stays as strong as a harder hit just before.
  light({string, fret, speed}, bright, since) {
    const key = `${string} ${fret}`, strength = Math.min(1, Math.sqrt(speed / FULL_SPEED));
    const before = since ? this.flashes.get(key)?.strength || 0 : 0;
    this.flashes.set(key, {string, fret, strength: Math.max(strength, before), bright, since});
  }

  // Fades the flashes; with `held` they stay as they are until they disappear.
  fade(now, held) {
    for (const [key, flash] of this.flashes) {
      const left = 1 - (now - flash.since) / FLASH;
      flash.bright = held ? 1 : Math.min(1, left);
      if (left <= 0) this.flashes.delete(key);
      this.needed = true;
    }
  }

  // --- a string in a hand ---

  // A hand takes a string that it can pull to `highest` (m): the picture keeps that room until another note is shown.
  grasp(string, fret, highest) {
    this.begin({string, fret, contacts: []});
    this.reach.above = highest;
  }

  // The hand holds it like this.
  hold(/** @type {HeldShape} */ held) {
    this.held = held;
    this.needed = true;
  }

  // The hand leaves it where it was.
  drop() {
    this.held = undefined;
    this.begin(this.live);
  }

  // --- replay of the last note ---

  // Shows a motion made by `Engine.again`, from its first frame on; `other`, if any, beside it, over crowns of its own.
  show(/** @type {Motion} */ made, /** @type {Motion | undefined} */ other) {
    const replay = this.replay = this.replayOf(made), room = this.held && this.reach;
    this.other = other && this.replayOf(other);
    this.held = undefined;
    const {string, frame, hits} = replay, [, , fret] = replay.slots.subarray(4 * (frame - replay.first));
    this.begin({string, fret, frame, contacts: hits.filter(hit => hit.frame >= frame), wasReported: true, wasKept: true});
    if (room) this.reach = room;
    for (const one of [replay, this.other])
      for (let k = 0; one && k < one.length; k += SOME) this.drawReplay(one, k, shape => this.measure(shape));
    this.flashes.clear();
    return replay;
  }

  replayOf(made) {
    /** @type {Hit[]} */
    const hits = [];
    for (let k = 0; k < made.contacts.length; k += 4) {
      const [string, fret, frame, speed] = made.contacts.slice(k, k + 4);
      hits.push({string, fret, frame, speed});
    }
    return {...made, hits, at: 0, length: made.slots.length / 4};
  }

  // Goes to frame `at` of the replay, `slowness` times slower than life; the latest contacts flash. Returns those on
  // the way there.
  goTo(at, slowness) {
    const r = this.replay, before = r?.at || 0;
    if (!r) return [];
    r.at = Math.min(r.length - 1, Math.max(0, at));
    if (this.other) this.other.at = r.at;
    const stays = FLASH / 1000 * this.rate / slowness; // frames
    this.flashes.clear();
    for (const hit of r.hits) {
      const age = r.first + r.at - hit.frame;
      if (age >= 0 && age < stays) this.light(hit, 1 - age / stays, 0);
    }
    this.needed = true;
    return r.hits.filter(({frame}) => frame - r.first > before && frame - r.first <= r.at);
  }

  // The shown moment, ms after the release.
  get moment() { return this.replay ? 1000 * (this.replay.first + this.replay.at - this.replay.frame) / this.rate : 0; }

  leave() {
    this.replay = this.other = this.held = undefined;
    this.flashes.clear();
    this.begin(this.live);
  }
}
