// Sorts a MIDI file's messages into lines, as livebass/score/lines.py does: a line is a channel of a port, or of a
// track that shares its channel but has its own program. The channels of a zone are one instrument.
import {isBass} from "./names.js";
import {RULE} from "../rule.js";
import {CONTROL, NOTE_OFF, NOTE_ON, PROGRAM, listOf} from "./smf.js";
import {spreadOf} from "./spread.js";

export const isNote = ({kind}) => kind === NOTE_ON || kind === NOTE_OFF;
const sameBytes = (data, from, ...bytes) => bytes.every((byte, k) => data[from + k] === byte);

// A file's messages by line, at a rate (Hz); a take's stay as they are. Note-ons of velocity 0 become note-offs. Throws
// an Error if it lasts too long.
export class Lines {
  constructor(smf, rate, take) {
    const frame = frameOf(smf, rate), ports = [...new Set(smf.messages.map(m => m.port))].sort((a, b) => a - b);
    if (!ports.length) ports.push(0);
    const first = new Map(ports.map((port, rank) => [port, RULE.channels * rank]));
    this.lines = ports.flatMap(port => Array.from({length: RULE.channels}, (_, channel) => ({port, channel, first: first.get(port)})));
    this.events = smf.messages; // by time
    for (const event of this.events) placeEvent(event, frame(event.tick), first.get(event.port) + event.channel);
    this.exclusive = smf.exclusive.filter(({port}) => first.has(port))
      .map(({tick, port, data}) => ({frame: frame(tick), first: first.get(port), data}));
    this.zone = new Set(); // lines of one instrument
    this.basses = take ? new Set() : bassesOf(smf, this.events); // tracks that are no drums, even on channel 10
    this.remarks = [];
    this.endSoon(frame(smf.endTick), rate);
    if (take) this.zone = new Set(this.lines.keys());
    else this.sort(smf, rate);
  }

  // Sets the end, a frame: the file's, or its last note's if that is much earlier.
  endSoon(end, rate) {
    const latest = (events, least) => events.reduce((latest, event) => Math.max(latest, event.frame), least);
    const last = latest(this.events.filter(isNote), 0), rest = last + RULE.longestRest * rate;
    if (last > RULE.longest * rate)
      throw new Error(`lasts ${(last / rate / 3600).toFixed(1)} hours, more than ${RULE.longest / 3600}`);
    this.end = latest(this.events, end);
    if (this.end <= rest) return;
    this.events = this.events.filter(event => event.frame <= rest);
    const count = wanted => this.events.filter(({kind}) => kind === wanted).length;
    this.end = latest(this.events, 0) + (count(NOTE_ON) > count(NOTE_OFF) ? RULE.lastNote * rate : 0);
  }

  // Finds the zone, and the lines of tracks that share a channel; drops controller 5, which has another meaning in
  // foreign files.
  sort(smf, rate) {
    this.findZone();
    this.remarks.push(...tuningsOf(smf));
    if (!this.zone.size) this.joinSpread(rate);
    const bends = bendsByPortamento(this.events);
    if (bends)
      this.remarks.push(`ignored controller 5 (portamento time, ${bends} times): it bends only in takes of livebass`);
    this.events = this.events.filter(({kind, a}) => kind !== CONTROL || a !== RULE.portamentoTime);
    this.setApart();
    this.events = endedByOthers(this.events);
  }

  // The notes among `events`, with their programs: {place, track, line, note, program, bank, drums, frame}.
  notes(events) {
    const programs = onlyPrograms(events), banks = new Map(), kits = new Kits(this), found = [];
    let ofZone = this.programOfZone(events, programs);
    events.forEach(({frame, kind, a, b, track, line}, place) => {
      const inZone = this.zone.has(line);
      if (kind === PROGRAM) {
        programs.set(line, a);
        if (inZone) ofZone = a;
      } else if (kind === CONTROL && a === RULE.bank) {
        banks.set(line, b);
      } else if (kind === NOTE_ON) {
        const program = programs.get(line) ?? (inZone ? ofZone : undefined), bank = banks.get(line);
        found.push({place, track, line, note: a, program, bank, drums: !inZone && kits.has(line, frame, bank, track), frame});
      }
    });
    return found;
  }

  // The program common to all lines of the zone that set one; undefined: none.
  programOfZone(events, programs) {
    const zones = new Set([...programs].filter(([line]) => this.zone.has(line)).map(([, program]) => program));
    const all = events.every(({kind, line}) => kind !== PROGRAM || !this.zone.has(line) || programs.has(line));
    return zones.size === 1 && all ? [...zones][0] : undefined;
  }

  // Finds the lines that modes join into one instrument. Modes do not count if some notes on these lines have a bass
  // program and others do not.
  findZone() {
    const modes = modesOf(this.events);
    this.zone = new Set([...modes.values()].flat());
    if (!this.zone.size) return;
    const programs = this.notes(this.events).filter(note => this.zone.has(note.line) && note.program !== undefined);
    const kinds = new Set(programs.map(({program}) => RULE.bassPrograms.includes(program)));
    if (kinds.size < 2) return;
    this.zone = new Set();
    this.events = this.events.filter((_, place) => !modes.has(place));
  }

  // Makes a zone of the channels over which a track spreads one instrument.
  joinSpread(rate) {
    const one = spreadOf(this.events, rate);
    if (!one) return;
    this.zone = new Set(one.lines);
    this.events = [...one.mode, ...this.events];
    const channels = one.lines.map(line => this.lines[line].channel + 1).sort((a, b) => a - b);
    const kind = one.mode.length ? "a channel a note" : "a channel a string";
    this.remarks.push(`plays channels ${channels[0]} to ${channels.at(-1)} as one instrument, ${kind}`);
  }

  // Separates tracks that share a channel but have their own programs.
  setApart() {
    const {playing, programs} = tracksOf(this.events), own = new Map(); // the new line by "line track"
    for (const [line, tracks] of playing) {
      const sets = tracks.map(track => programs.get(`${line} ${track}`)).filter(set => set).map(set => [...set].sort().join());
      if (this.zone.has(line) || new Set(sets).size < 2) continue;
      for (const track of tracks) own.set(`${line} ${track}`, this.lines.push(this.lines[line]) - 1);
    }
    if (own.size) this.events = this.events.flatMap(event => copiesOf(event, playing, own, programs));
  }
}

// Turns a message into an event, in place: there may be a million.
function placeEvent(event, frame, line) {
  event.frame = frame;
  event.line = line;
  if (event.kind === NOTE_ON && event.b === 0) {
    event.kind = NOTE_OFF;
    event.b = RULE.release;
  }
}

// Returns a function from tick to nearest frame, for ticks in any order; ascending order is fastest. It computes in
// integers, to round as Python does.
export function frameOf(smf, rate) {
  const times = smf.ticksPerQuarter ? timesOf(smf) : undefined;
  const [over, under] = times ? [BigInt(smf.ticksPerQuarter) * 1000000n, 1n] : smf.ticksPerSecond.map(BigInt);
  let k = 0, before, found;
  return tick => {
    if (tick === before) return found;
    let time = BigInt(tick);
    if (times) {
      if (tick < times[k].tick) k = 0;
      while (k + 1 < times.length && times[k + 1].tick <= tick) k++;
      time = times[k].time + BigInt(tick - times[k].tick) * times[k].tempo;
    }
    before = tick;
    found = Number((2n * time * under * BigInt(rate) + over) / (2n * over));
    return found;
  };
}

// The start of each tempo: {tick, time, tempo}, with the time in us times ticks per quarter note.
function timesOf({tempos}) {
  let last = {tick: 0, time: 0n, tempo: BigInt(RULE.tempo)};
  const times = [last];
  for (const {tick, tempo} of tempos) {
    last = {tick, time: last.time + BigInt(tick - last.tick) * last.tempo, tempo: BigInt(tempo)};
    times.push(last);
  }
  return times;
}

// The program of each line that keeps one throughout.
function onlyPrograms(events) {
  const found = new Map();
  for (const {kind, line, a} of events)
    if (kind === PROGRAM) found.set(line, found.has(line) && found.get(line) !== a ? undefined : a);
  return new Map([...found].filter(([, program]) => program !== undefined));
}

// The lines that play drums: channel 10, unless names, banks and system exclusive messages change that.
class Kits {
  constructor({lines, exclusive, basses}) {
    this.basses = basses;
    this.lines = lines;
    this.exclusive = exclusive;
    this.taken = 0;
    this.parts = new Map(); // true or false, by line
    this.systems = new Map(); // "gs", "xg" or "", by the first line of a port
  }

  // True if a note of `line` and `track` at `frame`, in ascending order, sounds drums in `bank`.
  has(line, frame, bank, track) {
    while (this.taken < this.exclusive.length && this.exclusive[this.taken].frame <= frame)
      this.take(this.exclusive[this.taken++]);
    const {channel, first} = this.lines[line], system = this.systems.get(first);
    if (bank === RULE.gm2Drums || (RULE.xgDrums.includes(bank) && system !== "gs")) return true;
    if (bank === RULE.gm2Melodic || (system === "xg" && bank !== undefined)) return false;
    return this.parts.get(first + channel) ?? (channel === RULE.drums && !this.basses.has(track));
  }

  take({first, data}) {
    if (data[0] === 0x7e && data[2] === 0x09) this.reset(first, ""); // General MIDI
    else if (data[0] === 0x41 && sameBytes(data, 2, 0x42, 0x12)) this.takeRoland(first, data);
    else if (data[0] === 0x43 && data[2] === 0x4c) this.takeYamaha(first, data);
  }

  takeRoland(first, data) {
    if (sameBytes(data, 4, 0x40, 0x00, 0x7f)) return this.reset(first, "gs");
    if (data.length <= 7 || data[4] !== 0x40 || (data[5] & 0xf0) !== 0x10 || data[6] !== 0x15) return;
    const part = data[5] & 0x0f;
    this.parts.set(first + (part === 0 ? RULE.drums : part <= RULE.drums ? part - 1 : part), data[7] !== 0);
  }

  takeYamaha(first, data) {
    if (sameBytes(data, 3, 0x00, 0x00, 0x7e)) return this.reset(first, "xg");
    if (data.length > 6 && data[3] === 0x08 && data[4] < RULE.channels && data[5] === 0x07)
      this.parts.set(first + data[4], data[6] !== 0);
  }

  reset(first, system) {
    this.systems.set(first, system);
    for (let channel = 0; channel < RULE.channels; channel++) this.parts.delete(first + channel);
  }
}

// The tracks of one line that are called bass and play several keys: some programs give channel 10 to any instrument.
function bassesOf({names, instruments}, events) {
  const lines = new Map(), keys = new Map();
  for (const {kind, track, line, a} of events) {
    if (kind !== NOTE_ON) continue;
    lines.set(track, (lines.get(track) || new Set()).add(line));
    keys.set(track, (keys.get(track) || new Set()).add(a));
  }
  return new Set([...lines.keys()].filter(track => lines.get(track).size === 1 && keys.get(track).size >= RULE.melodic &&
    (isBass(names[track]) || isBass(instruments[track]))));
}

// The places of messages that give channels a meaning, and the lines of each.
function modesOf(events) {
  const modes = new Map(), selected = new Map(), most = RULE.channels; // [high, low] of the RPN, by port
  const span = (from, to) => Array.from({length: Math.max(0, to - from)}, (_, k) => from + k);
  events.forEach(({kind, channel, a, b, line}, place) => {
    if (kind !== CONTROL) return;
    const port = line - channel;
    let [high, low] = selected.get(port) || [127, 127];
    if (a === 101) high = b;
    else if (a === 100) low = b;
    else if (a === 98 || a === 99 || a === 121) high = low = 127;
    else if (a === 126 && b > 1) modes.set(place, span(line, port + Math.min(channel + b, most)));
    else if (a === 6 && high === 0 && low === 6 && b > 1) {
      const members = Math.min(b, most - 1), first = channel === 0 ? port : port + most - 1 - members;
      modes.set(place, [line, ...span(first, first + members + 1)]);
    }
    selected.set(port, [high, low]);
  });
  return modes;
}

// The tracks with notes on each line, ascending, and the programs by "line track".
function tracksOf(events) {
  const found = new Map(), programs = new Map();
  for (const {kind, track, line, a} of events) {
    if (kind === NOTE_ON) {
      if (!found.has(line)) found.set(line, new Set());
      found.get(line).add(track);
    } else if (kind === PROGRAM) {
      const key = `${line} ${track}`;
      programs.set(key, (programs.get(key) || new Set()).add(a));
    }
  }
  const playing = new Map([...found].map(([line, tracks]) => [line, [...tracks].sort((a, b) => a - b)]));
  return {playing, programs};
}

// Returns the event on its line or on its track's own line. An event of a track without notes goes to all tracks on the
// channel; a program also to tracks without their own.
function copiesOf(event, playing, own, programs) {
  const {kind, track: from, line} = event;
  const tracks = (playing.get(line) || []).filter(track => own.has(`${line} ${track}`));
  if (!tracks.length) return [event];
  const shared = !tracks.includes(from);
  return tracks.filter(track => track === from || shared || (kind === PROGRAM && !programs.has(`${line} ${track}`)))
    .map(track => ({...event, line: own.get(`${line} ${track}`)}));
}

export const keyOf = ({line, a}) => line * 128 + a; // identifies a note among all lines

// Returns the events with note-offs on the lines of the notes they end: a note without a note-off is ended by one for
// the same key on another line that ends nothing there.
function endedByOthers(events) {
  const left = new Map(), wanting = new Map(), held = new Map(), channels = new Map(); // note-offs less note-ons; ...
  const add = (map, key, count) => map.set(key, (map.get(key) || 0) + count);
  for (const event of events) {
    channels.set(event.line, event.channel);
    if (isNote(event)) add(left, keyOf(event), event.kind === NOTE_OFF ? 1 : -1);
  }
  for (const [key, count] of left) if (count < 0) listOf(wanting, key % 128).push(Math.floor(key / 128));
  if (!wanting.size || ![...left.values()].some(count => count > 0)) return events;
  return events.map(event => {
    if (!isNote(event)) return event;
    const key = keyOf(event);
    if (event.kind === NOTE_ON) {
      add(held, key, 1);
    } else if (held.get(key)) {
      add(held, key, -1);
    } else {
      const other = wanting.get(event.a)?.find(line => held.get(line * 128 + event.a));
      if (other === undefined) return event;
      add(held, other * 128 + event.a, -1);
      return {...event, line: other, channel: channels.get(other)};
    }
    return event;
  });
}

// Counts the messages of controller 5 that would bend notes in livebass.
function bendsByPortamento(events) {
  const ready = new Set();
  let bends = 0;
  for (const {kind, a, b, line} of events) {
    if (kind !== CONTROL || a !== RULE.portamentoTime) continue;
    if (b < RULE.bendStarts) ready.add(line);
    else if (ready.has(line)) bends++;
  }
  return bends;
}

// Returns one text line per kind of tuning by system exclusive messages, which livebass ignores.
function tuningsOf({exclusive}) {
  const signed = cents => `${cents < 0 ? "-" : "+"}${roundedToEven(Math.abs(cents))}`;
  const tunings = [...new Set(exclusive.map(({data}) => centsOf(data)).filter(cents => cents))], lines = [];
  if (tunings.length === 1) lines.push(`ignored a master tuning of ${signed(tunings[0])} cents (system exclusive)`);
  else if (tunings.length)
    lines.push(`ignored ${tunings.length} master tunings (system exclusive), ${signed(Math.min(...tunings))} to ${signed(Math.max(...tunings))} cents`);
  if (exclusive.some(({data}) => (data[0] === 0x7e || data[0] === 0x7f) && data[2] === 0x08))
    lines.push("ignored a tuning of single notes (system exclusive)");
  return lines;
}

// The nearest whole number, as in Python: a half rounds to even.
export const roundedToEven = value => value % 1 === 0.5 ? 2 * Math.round(value / 2) : Math.round(value);

// The cents of a master tuning: fine, coarse, GS or XG; 0: another message.
function centsOf(data) {
  const nibbles = bytes => bytes.reduce((value, byte) => value << 4 | byte & 0x0f, 0);
  if (data[0] === 0x7f && data[2] === 0x04 && data.length >= 6) {
    if (data[3] === 0x03) return (data[4] + 128 * data[5] - 8192) / 8192 * 100;
    if (data[3] === 0x04) return 100 * (data[5] - 64);
  }
  if (data[0] === 0x41 && sameBytes(data, 2, 0x42, 0x12, 0x40, 0x00, 0x00) && data.length >= 11)
    return (nibbles(data.subarray(7, 11)) - 1024) / 10;
  if (data[0] === 0x43 && sameBytes(data, 2, 0x4c, 0x00, 0x00, 0x00) && data.length >= 10)
    return (nibbles(data.subarray(6, 10)) - 1024) / 10;
  return 0;
}
