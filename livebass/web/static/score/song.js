// A MIDI file on the page: its parts, the bass's parts among them, and their messages. Kernels read and choose, as they do
// for `livebass render`; here are the words.
import {N, RECORDS} from "../audio/kernels.js";
import {isBass, isDrums, isGame, isOther} from "./names.js";
import {NUMBERS, sentence} from "./sentences.js";
import {Smf} from "./smf.js";
import {WORDS} from "../words.js";

const MAX_SONG = 4 << 20; // bytes in a file; the densest notes take 540 MB of memory
const MAX_BARS = 5000;
const KEYS = 128, PROGRAM = 0xc0;
export const AUTO = "auto"; // the automatic choice, among the parts

// What a name says to the kernels.
const saysOf = name => (isBass(name) ? N.IS_BASS : 0) | (isOther(name) ? N.IS_OTHER : 0) | (isDrums(name) ? N.IS_DRUMS : 0);

export class Song {
  // Reads a Standard MIDI File, an ArrayBuffer, for a rate (Hz), by kernels, whose memory it keeps. Throws an Error with
  // one line for anything else.
  constructor(buffer, rate, kernels) {
    if (buffer.byteLength > MAX_SONG) throw new Error(`has ${(buffer.byteLength / 1e6).toFixed(1)} MB; a song has at most 4`);
    this.smf = new Smf(kernels, new Uint8Array(buffer));
    if (isGame(this.smf.names)) throw new Error(WORDS.game.refusal);
    this.kernels = kernels;
    this.rate = rate;
    this.take = this.smf.texts.has(WORDS.take);
    this.score = kernels.add(RECORDS.SCORE.bytes);
    this.count = this.readScore(); // of its parts
    if (!this.count) throw new Error("has no notes");
    this.listed = kernels.add(RECORDS.LISTED.bytes);
    this.switches = kernels.add(KEYS);
    this.fitting = kernels.add(RECORDS.FITTING.bytes);
    this.workspace = kernels.add(8 * N.FITTING_WORDS * this.found("note_ons"));
    this.choose(AUTO);
    this.remarks = [...this.smf.warnings, ...this.choiceRemarks()];
    this.length = this.found("end") / rate; // s
  }

  found(name) { return this.kernels.get("SCORE", this.score, name); }
  call(name, ...numbers) { return Number(this.kernels.x[`lb_${name}`](...numbers.map(BigInt))); }

  // Gives the score memory of the size that it needs.
  give(name, size) { this.kernels.set("SCORE", this.score, name, this.kernels.add(this.found(size))); }

  // Finds the file's lines and parts; returns the number of parts.
  readScore() {
    const {kernels, smf, score} = this, row = kind => kernels.get("SMF", smf.at, "rows", N.ROWS[kind]);
    kernels.fill("SCORE", score, {
      file: smf.at, messages: row("MESSAGE"), tempos: row("TEMPO"), exclusives: row("EXCLUSIVE"),
      data: kernels.get("SMF", smf.at, "data"), names: this.putNames(), rate: this.rate, take: Number(this.take),
    });
    this.call("measure_lines", score);
    this.give("memory", "bytes");
    const error = this.call("read_lines", score);
    if (error) throw new Error(sentence(error === N.TOO_LONG ? WORDS.tooLong : WORDS.tooMuch, [(this.found("last") / this.rate / 3600).toFixed(1)]));
    this.give("more", "more_bytes");
    return this.call("read_parts_of", score);
  }

  // Tells the kernels what the names of tracks and channels say; returns the address.
  putNames() {
    const {kernels, smf: {names, instruments, channelNames}} = this, at = kernels.add(N.NAMES * names.length);
    names.forEach((name, track) => {
      kernels.bytes[at + N.NAMES * track + N.TRACK_NAME] = saysOf(name) | (isBass(instruments[track]) ? N.BASS_INSTRUMENT : 0);
    });
    for (const [place, name] of channelNames) {
      const [track, channel] = place.split(" ").map(Number);
      if (name) kernels.bytes[at + N.NAMES * track + channel] = saysOf(name) | N.NAMED;
    }
    return at;
  }

  // Chooses the notes of a value of `choices`, and finds their messages.
  choose(which) {
    this.call("choose_notes", this.score, which === AUTO ? N.AUTO : N.OF_PART, which === AUTO ? 0 : which);
    this.chosen = which;
  }

  // Its bars: [begin (s), number, name]. Files without quarter notes have bars of 2 s.
  bars() {
    const {ticksPerQuarter, ticksPerSecond, metres, endTick} = this.smf;
    /** @type {[number, number, string][]} */
    const found = [];
    for (let at = 0, k = 0, quarters = 4; (at < endTick || !at) && found.length < MAX_BARS;) {
      for (; k < metres.length && metres[k].tick <= at; k++) ({quarters} = metres[k]);
      found.push([this.call("frame_at_tick", this.score, at) / this.rate, found.length + 1, ""]);
      const long = ticksPerQuarter ? quarters * ticksPerQuarter : 2 * ticksPerSecond[0] / ticksPerSecond[1];
      at = Math.min(at + Math.max(1, Math.round(long)), metres[k]?.tick ?? Infinity);
    }
    return found;
  }

  // --- parts ---

  // Part `key` of the last choice, with numbers from 1. Keys of the table of switches, if `switching`, are not notes.
  part(key, switching = false) {
    this.call("describe_part", this.score, key, switching ? this.switches : 0, this.listed);
    const get = (name, k) => this.kernels.get("LISTED", this.listed, name, k), track = get("track"), channel = get("channel");
    const list = (name, count) => Array.from({length: get(count)}, (_, k) => get(name, k));
    return {
      key: String(key), port: get("port") + 1, channel: channel + 1, track: track + 1, drums: Boolean(get("drums")),
      name: this.smf.channelNames.get(`${track} ${channel}`) || this.smf.names[track],
      programs: list("program", "programs").map(program => program + 1), banks: list("bank", "banks"),
      notes: get("notes"), switches: get("switches"), chosen: get("chosen"), lowest: get("lowest"), highest: get("highest"),
      why: WORDS.reasons[get("why")],
    };
  }

  // The parts of the automatic choice, sorted by port, channel and track.
  parts(switching = false) {
    if (this.chosen !== AUTO) this.choose(AUTO);
    return Array.from({length: this.count}, (_, key) => this.part(key, switching));
  }

  // The parts as they sound on `bass`, {range, switches}: switch keys are not notes, unless they were raised.
  partsOn(bass) {
    const {raised} = this.fitted(AUTO, bass);
    this.putSwitches(raised ? [] : bass.switches);
    return this.parts(true);
  }

  // The choices on `bass`: [value, text]; the automatic choice comes first if it is not a listed part.
  choices(bass) {
    const rows = this.partsOn(bass).map(part => [this.isChoice(part) ? AUTO : part.key, rowOf(part)]);
    const listed = rows.some(([value]) => value === AUTO);
    return this.found("chosen") && !listed ? [[AUTO, `All chosen: ${this.says()}`], ...rows] : rows;
  }

  // True if the automatic choice is exactly this whole part.
  isChoice({key}) {
    const {notes, chosen} = this.part(Number(key));
    return notes === chosen && chosen === this.found("chosen");
  }

  // Tells which channels play, and why.
  says() {
    const played = this.parts().filter(({chosen}) => chosen);
    if (!played.length) return `${WORDS.noBass}: choose a part`;
    const channels = [...new Set(played.map(({channel}) => channel))].sort((a, b) => a - b), why = WORDS.reasons[this.found("why")];
    const maximum = channels.slice(0, -1).join(", ");
    return maximum ? `channels ${maximum} and ${channels.at(-1)} play (${why})` : `channel ${channels[0]} plays (${why})`;
  }

  // A line for each remark about the file and the automatic choice.
  choiceRemarks() {
    const get = (row, name, k) => this.kernels.get("REMARK", this.found("remarks") + row * RECORDS.REMARK.bytes, name, k);
    const rows = Array.from({length: this.found("remarks_count")}, (_, row) =>
      ({code: get(row, "code"), numbers: NUMBERS.map(k => get(row, "numbers", k))}));
    const called = rows.filter(({code}) => code === N.CALLED), names = [...new Set(called.map(({numbers: [key]}) => this.bassName(key)))];
    return rows.filter(row => row.code !== N.CALLED || row === called[0]).map(({code, numbers}) => {
      const of = WORDS.remarks[code];
      if (code === N.CALLED) return sentence(of, [names.length, names.map(name => `"${name}"`).join(", ")]);
      if (code === N.ONLY_PART || code === N.LOWEST_PART) return sentence(of, [reported(this.part(numbers[0]))]);
      return sentence(of, code === N.DOUBLES ? numbers.map(number => number + 1) : numbers).replace(/; --.*/, "");
    });
  }

  // The name that calls a part bass.
  bassName(key) {
    const {name, track} = this.part(key), instrument = this.smf.instruments[track - 1];
    return !isBass(name) && isBass(instrument) ? instrument : name;
  }

  // --- messages ---

  putSwitches(keys) {
    const table = this.kernels.bytes.subarray(this.switches, this.switches + KEYS);
    table.fill(0);
    for (const key of keys) table[key] = 1;
  }

  // The messages of a value of `choices` for `bass`, without program changes: their address and number, the number of
  // another instrument's key switches that were left out, and of low notes that were raised.
  fitted(which, bass) {
    this.choose(which);
    const {kernels, fitting} = this, at = this.found("played"), count = this.withoutPrograms(at);
    if (this.take || !count) return {at, count, leftOut: 0, raised: 0};
    this.putSwitches(bass.switches);
    kernels.fill("FITTING", fitting, {
      rows: at, count, rate: this.rate, lowest: bass.range[0], highest: bass.range[1], switches: this.switches,
      end: kernels.get("PLAYED", at + (count - 1) * RECORDS.PLAYED.bytes, "frame"), memory: this.workspace,
    });
    const left = this.call("leave_switches", fitting), leftOut = kernels.get("FITTING", fitting, "left_out");
    return {at, count: left, leftOut, raised: this.call("raise_notes", fitting)};
  }

  // Drops the program changes among the messages at an address; returns how many are left.
  withoutPrograms(at) {
    const {bytes} = this.kernels, size = RECORDS.PLAYED.bytes, [status] = RECORDS.PLAYED.fields.status;
    let kept = 0;
    for (let k = 0; k < this.found("played_count"); k++) {
      if ((bytes[at + k * size + status] & 0xf0) === PROGRAM) continue;
      if (kept < k) bytes.copyWithin(at + kept * size, at + k * size, at + (k + 1) * size);
      kept++;
    }
    return kept;
  }

  // The messages of a value of `choices`, on `bass` and without program changes: frame, status and two bytes of data of
  // each.
  messages(which, bass) {
    const {at, count} = this.fitted(which, bass), {bytes, view} = this.kernels, {fields, bytes: size} = RECORDS.PLAYED;
    const [[frame], [status], [first], [second]] = ["frame", "status", "first", "second"].map(name => fields[name]);
    const found = new Int32Array(4 * count);
    for (let k = 0, row = at; k < count; k++, row += size)
      found.set([view.getInt32(row + frame, true), bytes[row + status], bytes[row + first], bytes[row + second]], 4 * k);
    return found;
  }
}

// Lowest to highest note.
const rangeOf = ({lowest, highest}) => [...new Set([lowest, highest])].map(note => WORDS.notes[note]).join(" to ");
const notesOf = ({notes}) => `${notes} note${notes === 1 ? "" : "s"}`;

// A part's description in a remark.
function reported(part) {
  const {port, channel, name, drums, programs} = part, kind = drums ? "drums" : programs.length ? `program ${programs.join(" ")}` : "no program";
  return `${port > 1 ? `port ${port} ` : ""}channel ${channel}${name ? ` "${name}"` : ""} (${kind}, ${notesOf(part)}, ${rangeOf(part)})`;
}

// A part in the list.
function rowOf(part) {
  const {port, channel, name, notes, switches, why} = part, range = notes ? `, ${rangeOf(part)}` : "";
  const keys = switches ? `, ${switches} key switch${switches === 1 ? "" : "es"}` : "";
  const place = port > 1 ? `Port ${port}, channel ${channel}` : `Channel ${channel}`;
  return `${place}${name ? `, ${name}` : ""}: ${notesOf(part)}${keys}${range} (${why})`;
}
