// The audio thread. There is no clock here but Date's milliseconds: summed over some quanta they tell the load, and the
// synth is told it.
//
// A board that is played hard costs many times the time there is, from one quantum to the next, and its coarse strings
// a tenth of that. So a thread that falls behind relieves one string at once; one that falls behind again soon relieves
// all that sound, and from then on every string as it begins to sound, until the playing has been soft for a while.
import {Engine, N, RECORDS} from "./engine.js";
import {LAYOUT} from "./layout.js";

const WINDOW = 16; // quanta between reports, 43 ms at 48 kHz
const PART = 32; // frames that are played at a time: a hard note on a board may take 0.1 s for the first quantum
const BEHIND = 8; // ms that the thread may owe
const AGAIN = 256; // parts within which it is behind "again": a busy machine holds a thread up only once
const BUSY = 0.35; // load of hard playing
const FADING = 0.985; // of the highest load, from report to report, where the playing is not hard
const HARD = 1; // highest load down to which strings are relieved as they begin to sound
const MOST_TOLD = 0.7; // of the highest load, which relieves no string
const OVERLOAD = 2; // a load that relieves one string
const MOST_AHEAD = 0.5; // s: what waits for its frame holds up what was sent after it
const TAPE = 8192; // frames of a recording that are handed over at once
const SEE_EVERY = 6; // quanta between two sights: 62 a second at 48 kHz
const SLICE = 1 << 20; // bytes of a bass that are copied in one quantum

class LivebassProcessor extends AudioWorkletProcessor {
  constructor({processorOptions: o}) {
    super();
    const module = o.module instanceof WebAssembly.Module ? o.module : new WebAssembly.Module(o.wasm);
    this.engine = new Engine(module);
    this.engine.begin(sampleRate);
    this.busy = this.quanta = this.owed = this.settled = this.highest = 0; // ms; quanta; ms; ms; load
    this.sinceBehind = AGAIN;
    this.changes = this.changed = 0; // of the playing, by the page: how many have come; frame of the last one
    this.live = !o.score; // with a score: offline, always the same sound
    this.seeing = false; // the page draws
    this.tape = undefined; // what is recorded, until it is full: {samples, used}
    this.seen = 0; // bass that was seen last
    this.unseen = 0; // quanta since it was seen
    this.spare = []; // buffers that the page gave back
    this.contacts = [];
    this.notes = [];
    this.taken = []; // contacts of each string so far ...
    this.told = []; // ... and its events
    if (o.bass) this.take(o.bass);
    for (const message of o.score || []) this.engine.send(...message);
    this.port.onmessage = ({data}) => this.hear(data);
  }

  hear({midi, everywhere, string, frame, bass, parameter, effect, panic, change, spare, seeing, recall, record}) {
    if (record !== undefined) this.record(record);
    if (spare) this.spare.push(spare);
    if (recall !== undefined && this.engine.field("bass")) {
      const found = this.engine.recall(this.engine.field("bass"), recall);
      this.port.postMessage({recalled: found || null, bass: this.engine.field("bass")});
    }
    if (seeing !== undefined) this.seeing = seeing;
    const e = this.engine, now = e.field("frame"), most = now + Math.round(MOST_AHEAD * sampleRate);
    const when = frame === undefined ? N.NOW : Math.min(most, Math.max(now, frame - (this.start || 0)));
    if (string !== undefined) e.tell(when, N.NOTE_STRING, midi[1], string);
    if (midi) e.send(when, ...midi);
    if (everywhere) e.sendEverywhere(when, ...everywhere);
    if (bass) this.take(bass);
    if (parameter) this.setParameter(...parameter);
    if (effect) e.setEffect(...effect);
    if (panic) e.setField("panic", 1);
    if (change) {
      this.changes = change;
      this.changed = Math.max(this.changed, when === N.NOW ? now : when);
    }
  }

  // Sets a parameter. The gain is that of the page alone: a controller that has one of its own goes back to 0 dB.
  setParameter(number, value) {
    const e = this.engine, performer = this.performer();
    e.setParameter(number, value);
    if (number !== N.GAIN_DB || !performer || e.get("PERFORMER", performer, "controls.level") === 1) return;
    for (let k = 0; k < N.CONTROLLERS; k++)
      if (e.get("PERFORMER", performer, "key_map.function", k) === N.CC_PARAMETER + number) e.send(N.NOW, 0xB0, k, 127);
  }

  // Begins to copy a bass, and gives back a bass that was on its way.
  take(bass) {
    if (this.coming) this.port.postMessage({faded: this.coming.bass});
    this.engine.reserve(bass.at + bass.image.byteLength);
    this.coming = {...bass, bytes: new Uint8Array(bass.image), done: 0};
    if (this.start === undefined) this.copy(Infinity); // nothing waits for this thread yet
  }

  // Copies up to `most` bytes of the bass that comes; it plays from the next quantum on when all are there.
  copy(most) {
    const c = this.coming, e = this.engine, end = Math.min(c.bytes.length, c.done + most);
    e.bytes.set(c.bytes.subarray(c.done, end), c.at + c.done);
    c.done = end;
    if (end < c.bytes.length) return;
    const waiting = e.field("next_bass");
    if (waiting) this.port.postMessage({faded: waiting});
    e.setField("next_bass", c.bass);
    this.port.postMessage({copied: c.bass});
    this.coming = undefined;
    this.highest = 0; // of the bass before
  }

  // Tells the page of a bass that is silent, so that its memory can be used again.
  clearAway() {
    const faded = this.engine.field("faded_bass");
    if (!faded) return;
    this.engine.setField("faded_bass", 0);
    this.port.postMessage({faded});
  }

  // The address of the performer of the bass that plays; 0: none plays.
  performer() {
    const bass = this.engine.field("bass");
    return bass && this.engine.get("BASS", bass, "performer");
  }

  // The frets that the player holds down, by string; -1: none.
  held() {
    const e = this.engine, player = this.performer(), found = [];
    for (let i = 0; player && i < e.get("PERFORMER", player, "strings"); i++)
      found.push(e.get("PERFORMER", player, "hands.state", i) === N.FREE ? -1 : e.get("PERFORMER", player, "hands.fret", i));
    return found;
  }

  // How the bass plays: techniques that are on, what it is plucked with, and the values of parameters, wherever they
  // have come from.
  playing() {
    const e = this.engine, player = this.performer();
    if (!player) return undefined;
    const of = (name, index) => e.get("PERFORMER", player, name, index);
    const any = player + RECORDS.PERFORMER.fields["controls.channel"][0] + N.ANY * RECORDS.CHANNEL.bytes;
    const moved = (field, ofChannel) => ofChannel ? e.get("CHANNEL", any, field) : of(`controls.${field}`);
    const isOn = ([action, field, ofChannel]) =>
      (action > 0 && of("switched", action) > 0) || (field !== "" && moved(field, ofChannel) > 0);
    const usual = of("player.pluck_position"), aside = of("position") - usual;
    const farthest = of("player.pluck_farthest") - usual, nearest = of("player.pluck_nearest") - usual;
    return {
      on: Object.fromEntries(Object.entries(LAYOUT.ways).map(([symbol, way]) => [symbol, isOn(way)])),
      pluckedWith: of("slapped") > 0 ? "slap" : {[N.FINGER]: "finger", [N.PICK]: "pick"}[of("stroke")],
      values: {
        gain: e.get("SYNTH", e.synth, "parameters", N.GAIN_DB) + 20 * Math.log10(of("controls.level")),
        tone: of("tone"),
        pluck_position: aside * farthest > 0 ? -aside / farthest : nearest && aside / nearest,
      },
    };
  }

  // Tells the synth the load of the last n frames.
  tellLoad(load, n) {
    const e = this.engine;
    this.highest = Math.max(load, (load > BUSY ? 1 : FADING) * this.highest);
    e.x.lb_relieve(e.synthAddress, Math.max(load, Math.min(this.highest, MOST_TOLD)), BigInt(n));
  }

  // Changes up to `count` strings that sound to their coarse operators.
  relieve(count) {
    const e = this.engine;
    for (let k = 0; k < count; k++) e.x.lb_relieve(e.synthAddress, OVERLOAD, 0n);
  }

  // Relieves strings at once where the last n frames, which took `took` ms, call for it.
  keepUp(took, n) {
    this.owed = Math.max(0, this.owed + took - 1000 * n / sampleRate);
    this.sinceBehind++;
    if (this.owed > BEHIND) {
      const again = this.sinceBehind < AGAIN;
      if (again) this.highest = Math.max(this.highest, OVERLOAD);
      this.relieve(again ? N.MOST_STRINGS : 1);
      this.settled += this.owed;
      this.owed = this.sinceBehind = 0;
    } else if (this.highest > HARD) {
      this.relieve(N.MOST_STRINGS);
    }
  }

  // Plays n frames of the quantum into `out` from frame `at` on; relieves strings before the next ones.
  playPart(out, at, n) {
    const began = Date.now(), sound = this.engine.play(n);
    for (const channel of out) channel.set(sound, at);
    if (this.live) this.keepUp(Date.now() - began, n);
  }

  // Begins to record what is heard, or ends it: the page gets the rest, and then the word that this was all.
  record(on) {
    if (!on && this.tape) this.port.postMessage({taped: this.tape.samples.slice(0, this.tape.used), last: true});
    this.tape = on ? {samples: new Float32Array(TAPE), used: 0} : undefined;
  }

  // Records a quantum; hands over what is full.
  keepOnTape(tape, sound) {
    tape.samples.set(sound, tape.used);
    tape.used += sound.length;
    if (tape.used + sound.length <= TAPE) return;
    const full = tape.used === TAPE ? tape.samples : tape.samples.slice(0, tape.used);
    this.port.postMessage({taped: full}, [full.buffer]);
    this.tape = {samples: new Float32Array(TAPE), used: 0};
  }

  // Tells the page what the strings do, every SEE_EVERY quanta.
  see() {
    const e = this.engine, bass = e.field("bass");
    if (!bass) return;
    if (bass !== this.seen) {
      this.seen = bass;
      this.taken = [];
      this.told = [];
    }
    e.takeContacts(bass, this.taken, this.contacts);
    e.takeNotes(bass, this.told, this.notes);
    if (++this.unseen < SEE_EVERY) return;
    this.unseen = 0;
    const sight = e.see(bass, this.spare.pop());
    this.port.postMessage({sight, of: bass, frame: e.field("frame"), began: this.start, contacts: this.contacts, notes: this.notes}, [sight]);
    [this.contacts, this.notes] = [[], []];
  }

  process(inputs, [out]) {
    const n = out[0].length, e = this.engine, began = Date.now();
    if (this.start === undefined) this.start = currentFrame;
    for (let at = 0; at < n; at += PART) this.playPart(out, at, Math.min(PART, n - at));
    if (this.coming) this.copy(SLICE);
    if (!this.live) return true;
    if (this.tape) this.keepOnTape(this.tape, out[0]);
    if (this.seeing) this.see();
    this.busy += Date.now() - began;
    this.quanta += 1;
    if (this.quanta === WINDOW) {
      const time = 1000 * n * WINDOW / sampleRate, load = this.busy / time;
      this.tellLoad((this.busy - this.settled) / time, n * WINDOW); // strings were relieved for the rest
      this.clearAway();
      this.port.postMessage({
        load, peak: e.field("peak"), overload: e.field("overload"), faults: e.field("faults"),
        messages: e.field("messages"), bass: e.field("bass"), held: this.held(),
        playing: this.playing(), changes: e.field("frame") > this.changed ? this.changes : undefined,
      });
      e.setField("peak", 0);
      this.busy = this.settled = this.quanta = 0;
    }
    return true;
  }
}
registerProcessor("livebass", LivebassProcessor);
