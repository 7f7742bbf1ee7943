// The audio thread. Its only clock is Date, in milliseconds: summed over some quanta, it gives the load, which the
// synth is told.
//
// From one quantum to the next, hard playing on a board may cost many times the available time; coarse strings cost a
// tenth of that. If the thread falls behind, it relieves one string at once; if soon again, all sounding strings, and
// from then on every string as it begins to sound, until the playing has been soft for a while.
import {Engine, PIECE} from "./engine.js";
import {N, RECORDS} from "./kernels.js";
import {LAYOUT} from "../layout.js";

const WINDOW = 16; // quanta between reports, 43 ms at 48 kHz
const PART = 32; // frames played at a time: a hard note on a board may take 0.1 s for the first quantum
const BEHIND = 8; // ms that the thread may owe
const AGAIN = 256; // parts that count as "soon again": a busy machine holds a thread up only once
const BUSY = 0.35; // load of hard playing
const FADING = 0.985; // of the highest load, from report to report, if the playing is not hard
const HARD = 1; // highest load down to which strings are relieved as they begin to sound
const MAX_REPORTED = 0.7; // most of the highest load that is told; it relieves no string
const OVERLOAD = 2; // a load that relieves one string
const MAX_AHEAD = 0.5; // s: a message waiting for its frame holds up later ones
const TAPE = 8192; // frames of a recording handed over at once
const SEE_EVERY = 6; // quanta between two sights: 62 per second at 48 kHz
const SLICE = 1 << 20; // bytes of a bass copied per quantum

class LivebassProcessor extends AudioWorkletProcessor {
  constructor({processorOptions: o}) {
    super();
    const module = o.module instanceof WebAssembly.Module ? o.module : new WebAssembly.Module(o.wasm);
    this.engine = new Engine(module);
    this.engine.begin(sampleRate);
    this.busy = this.quanta = this.owed = this.settled = this.highest = 0; // ms; quanta; ms; ms; load
    this.sinceBehind = AGAIN;
    this.changes = this.changed = 0; // the page's changes of the playing: how many came; frame of the last one
    this.live = !o.score; // with a score: offline, always the same sound
    this.seeing = false; // the page draws
    // {messages, begin, end, loops, tempo, from, at, next, held}: frame, status and data of each message, or frame, kind,
    // number and value of a tablature's event; frames of the song, which is `at` one of them at the frame `from`; the
    // next message, -1 after a jump; the notes that sound
    this.song = undefined;
    this.tape = undefined; // the recording, until it is full: {samples, used}
    this.seen = 0; // bass that was seen last
    this.unseen = 0; // quanta since it was seen
    this.spare = []; // buffers from the page
    this.contacts = [];
    this.notes = [];
    this.taken = []; // contacts of each string so far ...
    this.reports = []; // ... and its events
    if (o.bass) this.take(o.bass);
    for (const message of o.score || []) this.engine.send(...message);
    this.port.onmessage = ({data}) => this.hear(data);
  }

  hear({midi, everywhere, string, frame, bass, parameter, panic, change, spare, seeing, recall, record, song, steer}) {
    if (record !== undefined) this.record(record);
    if (spare) this.spare.push(spare);
    if (recall) this.port.postMessage({recalled: this.engine.recall(recall.bass, recall.string) || null});
    if (song !== undefined) this.takeSong(song);
    if (steer && this.song) this.steer(steer);
    if (seeing !== undefined) this.seeing = seeing;
    const e = this.engine, now = e.field("frame"), maximum = now + Math.round(MAX_AHEAD * sampleRate);
    const when = frame === undefined ? N.NOW : Math.min(maximum, Math.max(now, frame - (this.start || 0)));
    if (string !== undefined) e.tell(when, N.NOTE_STRING, midi[1], string);
    if (midi) e.send(when, ...midi);
    if (everywhere) e.sendEverywhere(when, ...everywhere);
    if (bass) this.take(bass);
    if (parameter) this.setParameter(...parameter);
    if (panic) e.setField("panic", 1);
    if (change) {
      this.changes = change;
      this.changed = Math.max(this.changed, when === N.NOW ? now : when);
    }
  }

  // Begins a song; null ends it. With `goesOn` it takes the place of the present one, and goes on where that is.
  takeSong(song) {
    const before = this.song;
    if (before) this.release(this.engine.field("frame"));
    this.song = undefined;
    if (!song || (song.goesOn && !before)) return;
    if (song.goesOn) {
      this.song = {...before, ...song, next: -1};
      this.steer({});
    } else this.song = {...song, from: song.from - (this.start || 0), next: -1, held: new Set(), strings: false};
  }

  // Changes tempo, part or loop of the song from now on, or its place: `at`, a frame of it.
  steer({at = undefined, ...change}) {
    const s = this.song, now = this.engine.field("frame");
    Object.assign(s, {at: s.at + Math.max(0, now - s.from) * s.tempo, from: Math.max(now, s.from), ...change});
    if (at !== undefined || s.at < s.begin || s.at >= s.end) {
      this.release(now);
      Object.assign(s, {at: at ?? s.begin, next: -1});
    }
    this.tellPlace();
  }

  tellPlace() {
    const {from, at, tempo} = this.song;
    this.port.postMessage({songAt: {from: from + (this.start || 0), at, tempo}});
  }

  sendSong(frame, status, a, b) {
    const kind = status & 0xF0, note = (status & 15) << 7 | a;
    if (status < 0x80) {
      this.song.strings = true;
      this.engine.tell(frame, status, a, b);
      return;
    }
    if (kind === 0x90) this.song.held.add(note);
    else if (kind === 0x80) this.song.held.delete(note);
    this.engine.send(frame, status, a, b);
  }

  // Ends the song's notes.
  release(frame) {
    for (const note of this.song.held) this.engine.send(frame, 0x80 | note >> 7, note & 127, 64);
    this.song.held.clear();
    for (let i = 0; this.song.strings && i < N.MAX_STRINGS; i++) this.engine.tell(frame, N.STRING_REST, i, 0);
    this.song.strings = false;
  }

  // After a jump: sends all controllers as they are at the place.
  chase(frame) {
    const {messages: m, at} = this.song, latest = new Map();
    let k = 0;
    for (; k < m.length && m[k] < at; k += 4)
      if (m[k + 1] >= 0xA0) latest.set(m[k + 1] < 0xC0 ? m[k + 1] * 128 + m[k + 2] : m[k + 1] * 128, k);
    for (const one of latest.values()) this.engine.send(frame, m[one + 1], m[one + 2], m[one + 3]);
    this.song.next = k;
  }

  // Sends the song's messages of the next n frames.
  playSong(n) {
    const now = this.engine.field("frame"), until = now + n;
    while (this.song && this.song.from < until) {
      const s = this.song, m = s.messages, frameOf = frame => Math.round(s.from + (frame - s.at) / s.tempo);
      if (s.next < 0) this.chase(Math.max(now, s.from));
      const last = s.loops ? s.end : s.end + 1; // the last notes may end with the song
      for (; s.next < m.length && m[s.next] < last; s.next += 4) {
        const at = frameOf(m[s.next]);
        if (at >= until) return;
        this.sendSong(Math.max(now, at), m[s.next + 1], m[s.next + 2], m[s.next + 3]);
      }
      const end = frameOf(s.end);
      if (until < end) return;
      this.release(Math.max(now, end));
      if (s.loops) {
        Object.assign(s, {from: end, at: s.begin, next: -1});
        this.tellPlace();
      } else {
        this.song = undefined;
        this.port.postMessage({songEnded: true});
      }
    }
  }

  // Sets a parameter, by kind and number of its event. The page alone sets the gain: a controller's own gain goes back
  // to 0 dB.
  setParameter(kind, number, value) {
    const e = this.engine, performer = this.performer();
    e.tell(N.NOW, kind, number, value);
    if (kind !== N.PARAMETER || number !== N.GAIN_DB || !performer || e.get("PERFORMER", performer, "controls.level") === 1) return;
    for (let k = 0; k < N.CONTROLLERS; k++)
      if (e.get("PERFORMER", performer, "key_map.function", k) === N.CC_PARAMETER + number) e.send(N.NOW, 0xB0, k, 127);
  }

  // Begins to copy a bass, and gives back one that was on its way.
  take(bass) {
    if (this.coming) this.port.postMessage({faded: this.coming.bass});
    this.engine.reserve(bass.at + bass.size);
    this.coming = {...bass, bytes: new Uint8Array(bass.image), done: 0, taken: 0};
    if (this.start === undefined) this.copy(Infinity); // nothing waits for this thread yet
  }

  // Copies up to `maximum` bytes of the coming bass, and writes its empty pieces, too: no note should wait for memory. Once
  // complete, it plays from the next quantum on.
  copy(maximum) {
    const c = this.coming, e = this.engine, end = Math.min(c.size, c.done + maximum);
    for (; c.done < end; c.done += PIECE) {
      if (c.full[c.taken] * PIECE === c.done) {
        e.bytes.set(c.bytes.subarray(c.taken * PIECE, (c.taken + 1) * PIECE), c.at + c.done);
        c.taken++;
      } else e.bytes.fill(0, c.at + c.done, c.at + c.done + PIECE);
    }
    if (end < c.size) return;
    const waiting = e.field("next_bass");
    if (waiting) this.port.postMessage({faded: waiting});
    e.setField("next_bass", c.bass);
    this.port.postMessage({copied: c.bass});
    this.coming = undefined;
    this.highest = 0; // was the old bass's
  }

  // Tells the page of a silent bass: its memory can be reused.
  clearAway() {
    const faded = this.engine.field("faded_bass");
    if (!faded) return;
    this.engine.setField("faded_bass", 0);
    this.port.postMessage({faded});
  }

  // The address of the playing bass's performer; 0: none plays.
  performer() {
    const bass = this.engine.field("bass");
    return bass && this.engine.get("BASS", bass, "performer");
  }

  // The frets held down, by string; -1: none.
  held() {
    const e = this.engine, player = this.performer(), found = [];
    for (let i = 0; player && i < e.get("PERFORMER", player, "strings"); i++)
      found.push(e.get("PERFORMER", player, "hands.state", i) === N.FREE ? -1 : e.get("PERFORMER", player, "hands.fret", i));
    return found;
  }

  // The present playing: active techniques, the stroke, and parameter values, whatever set them.
  playing() {
    const e = this.engine, player = this.performer();
    if (!player) return undefined;
    const of = (name, index) => e.get("PERFORMER", player, name, index);
    const any = player + RECORDS.PERFORMER.fields["controls.channel"][0] + N.ANY * RECORDS.CHANNEL.bytes;
    const moved = (field, ofChannel) => ofChannel ? e.get("CHANNEL", any, field) : of(`controls.${field}`);
    const isOn = ([action, field, ofChannel]) =>
      (action > 0 && of("switched", action) > 0) || (field !== "" && moved(field, ofChannel) > 0);
    const defaultValue = of("player.pluck_position"), aside = of("position") - defaultValue;
    const farthest = of("player.pluck_farthest") - defaultValue, nearest = of("player.pluck_nearest") - defaultValue;
    return {
      on: Object.fromEntries(Object.entries(LAYOUT.ways).map(([symbol, way]) => [symbol, isOn(way)])),
      pluckedWith: of("slapped") > 0 ? "slap" : {[N.FINGER]: "finger", [N.PICK]: "pick"}[of("stroke")],
      values: {
        gain: e.get("SYNTH", e.synth, "parameters", N.GAIN_DB) + 20 * Math.log10(of("controls.level")),
        tone: of("tone"),
        blend: of("controls.blend"),
        pluck_position: aside * farthest > 0 ? -aside / farthest : nearest && aside / nearest,
      },
    };
  }

  // Tells the synth the load of the last n frames.
  tellLoad(load, n) {
    const e = this.engine;
    this.highest = Math.max(load, (load > BUSY ? 1 : FADING) * this.highest);
    e.x.lb_relieve(e.synthAddress, Math.max(load, Math.min(this.highest, MAX_REPORTED)), BigInt(n));
  }

  // Moves up to `count` sounding strings to their coarse operators.
  relieve(count) {
    const e = this.engine;
    for (let k = 0; k < count; k++) e.x.lb_relieve(e.synthAddress, OVERLOAD, 0n);
  }

  // Relieves strings at once if the last n frames, which took `took` ms, call for it.
  keepUp(took, n) {
    this.owed = Math.max(0, this.owed + took - 1000 * n / sampleRate);
    this.sinceBehind++;
    if (this.owed > BEHIND) {
      const again = this.sinceBehind < AGAIN;
      if (again) this.highest = Math.max(this.highest, OVERLOAD);
      this.relieve(again ? N.MAX_STRINGS : 1);
      this.settled += this.owed;
      this.owed = this.sinceBehind = 0;
    } else if (this.highest > HARD) {
      this.relieve(N.MAX_STRINGS);
    }
  }

  // Plays n frames of the quantum into `out` from frame `at` on; then relieves strings if necessary.
  playPart(out, at, n) {
    const began = Date.now(), sound = this.engine.play(n);
    for (const channel of out) channel.set(sound, at);
    if (this.live) this.keepUp(Date.now() - began, n);
  }

  // Starts or stops recording: at the end the page gets the rest, marked as the last part.
  record(on) {
    if (!on && this.tape) this.port.postMessage({taped: this.tape.samples.slice(0, this.tape.used), last: true});
    this.tape = on ? {samples: new Float32Array(TAPE), used: 0} : undefined;
  }

  // Records a quantum; hands over a full tape.
  keepOnTape(tape, sound) {
    tape.samples.set(sound, tape.used);
    tape.used += sound.length;
    if (tape.used + sound.length <= TAPE) return;
    const full = tape.used === TAPE ? tape.samples : tape.samples.slice(0, tape.used);
    this.port.postMessage({taped: full}, [full.buffer]);
    this.tape = {samples: new Float32Array(TAPE), used: 0};
  }

  // Sends the page the strings' motion, every SEE_EVERY quanta.
  see() {
    const e = this.engine, bass = e.field("bass");
    if (!bass) return;
    if (bass !== this.seen) {
      this.seen = bass;
      this.taken = [];
      this.reports = [];
    }
    e.takeContacts(bass, this.taken, this.contacts);
    e.takeNotes(bass, this.reports, this.notes);
    if (++this.unseen < SEE_EVERY) return;
    this.unseen = 0;
    const sight = e.see(bass, this.spare.pop());
    this.port.postMessage({sight, of: bass, frame: e.field("frame"), began: this.start, contacts: this.contacts, notes: this.notes}, [sight]);
    [this.contacts, this.notes] = [[], []];
  }

  process(inputs, [out]) {
    const n = out[0].length, e = this.engine, began = Date.now();
    if (this.start === undefined) this.start = currentFrame;
    this.playSong(n);
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
