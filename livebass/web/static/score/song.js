// A MIDI file on the page: its parts, the bass's parts among them, and their messages. It follows
// livebass/score/choosing.py and reading.py: the page plays the same as `livebass render`.
import {Lines, frameOf, isNote} from "./lines.js";
import {isBass, isDrums, isGame, isOther} from "./names.js";
import {RULE} from "../rule.js";
import {cleaned, countBelow, endedTake, onChannels, withLowNotes, withoutForeignSwitches} from "./score.js";
import {NOTE_OFF, NOTE_ON, PROGRAM, Smf, listOf, plural} from "./smf.js";
import {areLow, middleOf} from "./spread.js";

const MOST_SONG = 4 << 20; // bytes in a file
const MOST_BARS = 5000;
export const AUTO = "auto"; // the automatic choice, among the parts
const NO_BASS = "no channel has a bass program, 33 to 40, and no track is called bass";
const partKey = ({line, track}) => `${line} ${track}`;

// A file's notes by line and track, and the chosen ones: {notes, why, elseWhy, alone, remarks, doubles}. `alone`: they are
// whole parts; other parts on their lines do not matter. `doubles`: parts left out because another one has their notes.
class Parts {
  constructor(smf, lines, notes, rate) {
    this.smf = smf;
    this.rate = rate;
    this.lines = lines;
    this.notes = notes;
    /** @type {Map<string, any[]>} */
    this.byKey = new Map();
    for (const note of notes) listOf(this.byKey, partKey(note)).push(note);
  }

  // The notes of a part.
  notesOf(key) { return listOf(this.byKey, key); }

  choose(take) {
    if (take) return {notes: this.notes, why: "a take of livebass", elseWhy: ""};
    const notes = this.notes.filter(({drums, program}) => !drums && RULE.bassPrograms.includes(program));
    if (notes.length) return this.once({notes, why: "bass program", elseWhy: "no bass program"});
    const named = this.chosenByName();
    return named ? this.once(named) : this.chosenOfZone() || this.chosenByPlace() ||
      {notes: [], why: "", elseWhy: "no bass program, not called bass"};
  }

  // The choice without parts whose notes another one of its parts has, too.
  once(choice) {
    const parts = new Map(), doubles = new Map(), kept = [], {lines, zone} = this.lines;
    for (const note of choice.notes) if (!zone.has(note.line)) listOf(parts, partKey(note)).push(note);
    if (parts.size > RULE.mostBasses) return choice;
    const line = key => parts.get(key)[0].line, track = key => parts.get(key)[0].track;
    const inOrder = (a, b) => line(a) - line(b) || track(a) - track(b);
    for (const key of [...parts.keys()].sort((a, b) => parts.get(b).length - parts.get(a).length || inOrder(a, b))) {
      const other = kept.find(one => this.hasNotes(parts.get(one), parts.get(key)));
      if (other) doubles.set(key, other);
      else kept.push(key);
    }
    if (!doubles.size) return choice;
    const place = key => `track ${track(key) + 1} (channel ${lines[line(key)].channel + 1})`;
    const told = [...doubles.keys()].sort(inOrder).map(key => `${place(key)} doubles ${place(doubles.get(key))} and is left out`);
    const notes = choice.notes.filter(note => !doubles.has(partKey(note)));
    return {...choice, notes, remarks: [...choice.remarks || [], ...told], doubles: new Set(doubles.keys())};
  }

  // True if most notes of `other` begin in `part`, too.
  hasNotes(part, other) {
    const frames = new Map(), together = RULE.together * this.rate;
    for (const {note, frame} of part) listOf(frames, note).push(frame);
    const same = other.filter(({note, frame}) => {
      const own = listOf(frames, note);
      return own[countBelow(own, frame - together, false)] <= frame + together;
    });
    return other.length >= RULE.leastSame && same.length >= RULE.same * other.length;
  }

  chosenByName() {
    const lines = new Map(); // of each track; a zone is one line
    for (const [{line, track}] of this.byKey.values()) listOf(lines, track).push(this.lines.zone.has(line) ? -1 : line);
    const alone = track => new Set(lines.get(track)).size === 1;
    const called = this.keysOf(notes => !this.areDrums(notes) && this.isCalledBass(notes[0], alone(notes[0].track)));
    if (!called.length) return undefined;
    const ascending = called.map(key => this.notesOf(key)[0]).sort((a, b) => a.track - b.track);
    const names = [...new Set(ascending.map(note => this.bassName(note)))];
    const which = names.map(name => `"${name}"`).join(", ");
    const remark = `no channel has a bass program, 33 to 40: plays the track${plural(names.length)} called ${which}`;
    return this.wholeParts(called, "called bass", "not called bass", remark);
  }

  chosenOfZone() {
    const notes = this.notes.filter(({line, program}) => this.lines.zone.has(line) && program === undefined);
    return notes.length ? {notes, why: "a channel a string, or MPE", elseWhy: "no part of that instrument"} : undefined;
  }

  chosenByPlace() {
    const melodic = this.keysOf(notes => !this.areDrums(notes) && !isDrums(this.nameOf(notes[0])));
    if (melodic.length === 1) {
      const remark = `${NO_BASS}: plays the only part, ${this.told(melodic[0])}`;
      return this.wholeParts(melodic, "the only part", "drums", remark);
    }
    const middle = key => middleOf(this.notesOf(key).map(({note}) => note)), track = key => this.notesOf(key)[0].track;
    const low = melodic.filter(key => this.isLow(this.notesOf(key)) && !isOther(this.nameOf(this.notesOf(key)[0])));
    if (!low.length) return undefined;
    const [lowest] = low.sort((a, b) => middle(a) - middle(b) || track(a) - track(b));
    const remark = `${NO_BASS}: plays the part that lies in a bass's range, ${this.told(lowest)}`;
    return this.wholeParts([lowest], "in a bass's range, the lowest", "no program, but higher", remark);
  }

  keysOf(wanted) {
    return [...this.byKey].filter(([, notes]) => wanted(notes)).map(([key]) => key);
  }

  wholeParts(keys, why, elseWhy, remark) {
    return {notes: this.notes.filter(note => keys.includes(partKey(note))), why, elseWhy, alone: true, remarks: [remark]};
  }

  areDrums(notes) {
    return notes.every(note => note.drums);
  }

  // True if notes without a program lie in a bass's range.
  isLow(notes) {
    return notes.every(({program}) => program === undefined) && areLow(notes.map(({note}) => note));
  }

  channelNameOf({line, track}) {
    return this.smf.channelNames.get(`${track} ${this.lines.lines[line].channel}`) || "";
  }

  // The name of a note's part: its channel's name, if the file has one, or its track's.
  nameOf(note) {
    return this.channelNameOf(note) || this.smf.names[note.track];
  }

  // The name that may call a part bass.
  bassName(note) {
    const name = this.nameOf(note), instrument = this.smf.instruments[note.track];
    return !isBass(name) && isBass(instrument) ? instrument : name;
  }

  // True if a part is called bass: by its channel's name, or by the name of a track in which it is `alone`.
  isCalledBass(note, alone) {
    return isBass(this.channelNameOf(note)) || (alone && isBass(this.bassName(note)));
  }

  // The parts, sorted by port, channel and track. Keys in `switches` are not notes.
  listed(choice, switches) {
    const found = [...this.byKey.keys()].map(key => this.part(key, choice, switches));
    return found.sort((a, b) => a.port - b.port || a.channel - b.channel || a.track - b.track);
  }

  // One part, with numbers from 1; how many of its notes a `choice` has, and why.
  part(key, choice = {notes: []}, switches = []) {
    const all = this.notesOf(key), keys = new Set(switches), notes = all.filter(({note}) => !keys.has(note));
    const places = choice.places ||= new Set(choice.notes.map(({place}) => place)), has = ({place}) => places.has(place);
    const {port, channel} = this.lines.lines[all[0].line], drums = this.areDrums(all), range = notes.map(({note}) => note);
    const given = values => [...new Set(values.filter(value => value !== undefined))];
    return {
      key, port: port + 1, channel: channel + 1, track: all[0].track + 1, name: this.nameOf(all[0]), drums,
      programs: given(notes.map(({program}) => program)).map(program => program + 1), banks: given(all.map(({bank}) => bank)),
      notes: notes.length, switches: all.length - notes.length, chosen: notes.filter(has).length,
      lowest: range.reduce((a, b) => Math.min(a, b), range[0] ?? 0), highest: range.reduce((a, b) => Math.max(a, b), 0),
      why: choice.why && all.some(has) ? choice.why : drums ? "drums" :
        choice.doubles?.has(key) ? "doubles another part" : choice.elseWhy || "",
    };
  }

  // A part's description in a remark.
  told(key) {
    const {port, channel, name, drums, programs, notes, lowest, highest} = this.part(key);
    const kind = drums ? "drums" : programs.length ? `program ${programs.join(" ")}` : "no program";
    const range = [...new Set([lowest, highest])].map(note => RULE.notes[note]).join(" to ");
    return `${port > 1 ? `port ${port} ` : ""}channel ${channel}${name ? ` "${name}"` : ""} (${kind}, ${notes} note${notes === 1 ? "" : "s"}, ${range})`;
  }
}

export class Song {
  // Reads a Standard MIDI File, an ArrayBuffer, for a rate (Hz), by kernels, whose memory it keeps. Throws an Error with
  // one line for anything else.
  constructor(buffer, rate, kernels) {
    if (buffer.byteLength > MOST_SONG) throw new Error(`has ${(buffer.byteLength / 1e6).toFixed(1)} MB; a song has at most 4`);
    const smf = new Smf(kernels, new Uint8Array(buffer));
    if (isGame(smf.names)) throw new Error(RULE.game.refusal);
    this.rate = rate;
    this.take = smf.texts.has(RULE.take);
    this.lines = new Lines(smf, rate, this.take);
    const {events, end} = this.lines;
    this.events = this.take ? endedTake(events, end) : cleaned(events, end, rate);
    this.parts = new Parts(smf, this.lines, this.lines.notes(this.events), rate);
    if (!this.parts.notes.length) throw new Error("has no notes");
    this.choice = this.parts.choose(this.take);
    this.remarks = [...smf.warnings, ...this.lines.remarks, ...this.choice.remarks || []];
    this.length = end / rate; // s
    this.smf = smf;
  }

  // Its bars: [begin (s), number, name]. Files without quarter notes have bars of 2 s.
  bars() {
    const {ticksPerQuarter, ticksPerSecond = [1, 1], metres, endTick} = this.smf, frame = frameOf(this.smf, this.rate);
    /** @type {[number, number, string][]} */
    const found = [];
    for (let at = 0, k = 0, quarters = 4; (at < endTick || !at) && found.length < MOST_BARS;) {
      for (; k < metres.length && metres[k].tick <= at; k++) ({quarters} = metres[k]);
      found.push([frame(at) / this.rate, found.length + 1, ""]);
      const long = ticksPerQuarter ? quarters * ticksPerQuarter : 2 * ticksPerSecond[0] / ticksPerSecond[1];
      at = Math.min(at + Math.max(1, Math.round(long)), metres[k]?.tick ?? Infinity);
    }
    return found;
  }

  // The choices on `bass`, {range, switches}: [value, text]; the automatic choice comes first if it is not a listed
  // part.
  choices(bass) {
    const parts = this.partsOn(bass), played = parts.filter(part => part.chosen);
    const rows = parts.map(part => [this.isChoice(part) ? AUTO : part.key, rowOf(part)]);
    return played.length && !rows.some(([value]) => value === AUTO) ? [[AUTO, `All chosen: ${this.says()}`], ...rows] : rows;
  }

  // The parts as they sound on `bass`: switch keys are not notes.
  partsOn(bass) {
    const raised = !this.take && this.choice.notes.length && this.areLow(bass);
    return this.parts.listed(this.choice, raised ? [] : bass.switches);
  }

  areLow(bass) {
    const events = withoutForeignSwitches(this.chosenEvents(this.choice), bass, this.rate);
    return withLowNotes(events, bass, this.rate) !== events;
  }

  // True if the choice is exactly this whole part.
  isChoice({key}) {
    const {length} = this.parts.notesOf(key);
    return this.choice.notes.length === length && this.choice.notes.every(note => partKey(note) === key);
  }

  // Tells which channels play, and why.
  says() {
    const {notes, why} = this.choice;
    if (!notes.length) return `${NO_BASS}: choose a part`;
    const channels = [...new Set(notes.map(({line}) => this.lines.lines[line].channel + 1))].sort((a, b) => a - b);
    const most = channels.slice(0, -1).join(", ");
    return most ? `channels ${most} and ${channels.at(-1)} play (${why})` : `channel ${channels[0]} plays (${why})`;
  }

  // The messages of a value of `choices`, on `bass` and without program changes: {frame, midi}.
  messages(which, bass) {
    const choice = which === AUTO ? this.choice : {notes: this.parts.notesOf(which), alone: true};
    const sent = onChannels(this.chosenEvents(choice).filter(({kind}) => kind !== PROGRAM), this.lines);
    const played = this.take ? sent : withLowNotes(withoutForeignSwitches(sent, bass, this.rate), bass, this.rate);
    return played.map(({frame, kind, channel, a, b}) => ({frame, midi: b === undefined ? [kind | channel, a] : [kind | channel, a, b]}));
  }

  // The events of the chosen notes and their lines.
  chosenEvents({notes, alone = false}) {
    const {zone, events, end} = this.lines, chosen = new Set(notes.map(({line}) => line));
    const heard = new Set([...chosen, ...[...chosen].some(line => zone.has(line)) ? zone : []]); // controllers
    if (alone && !this.take) { // other parts may share the line; their messages are not for these notes
      const keys = new Set(notes.map(partKey)), others = new Set([...this.parts.byKey.keys()].filter(key => !keys.has(key)));
      const own = events.filter(e => isNote(e) ? keys.has(partKey(e)) : heard.has(e.line) && !others.has(partKey(e)));
      return cleaned(own, end, this.rate);
    }
    const places = new Set(notes.map(({place}) => place)), ended = this.take ? heard : chosen;
    return this.events.filter((e, place) => places.has(place) ||
      (e.kind !== NOTE_ON && (e.kind === NOTE_OFF ? ended : heard).has(e.line)));
  }
}

// A part in the list.
function rowOf({port, channel, name, notes, switches, lowest, highest, why}) {
  const range = notes ? `, ${[...new Set([lowest, highest])].map(note => RULE.notes[note]).join(" to ")}` : "";
  const keys = switches ? `, ${switches} key switch${switches === 1 ? "" : "es"}` : "";
  const place = port > 1 ? `Port ${port}, channel ${channel}` : `Channel ${channel}`;
  return `${place}${name ? `, ${name}` : ""}: ${notes} note${notes === 1 ? "" : "s"}${keys}${range} (${why})`;
}

// A mono WAV file, 32 bits per sample, of blocks of Float32Array at a rate (Hz).
export function wavOf(blocks, rate) {
  const count = blocks.reduce((sum, block) => sum + block.length, 0), head = new DataView(new ArrayBuffer(58));
  const text = (at, name) => [...name].forEach((letter, k) => head.setUint8(at + k, letter.charCodeAt(0)));
  text(0, "RIFF");
  head.setUint32(4, 50 + 4 * count, true);
  text(8, "WAVEfmt ");
  head.setUint32(16, 18, true);
  head.setUint16(20, 3, true); // floating point
  head.setUint16(22, 1, true);
  head.setUint32(24, rate, true);
  head.setUint32(28, 4 * rate, true);
  head.setUint16(32, 4, true);
  head.setUint16(34, 32, true);
  text(38, "fact");
  head.setUint32(42, 4, true);
  head.setUint32(46, count, true);
  text(50, "data");
  head.setUint32(54, 4 * count, true);
  return new Blob([head, ...blocks], {type: "audio/wav"});
}
