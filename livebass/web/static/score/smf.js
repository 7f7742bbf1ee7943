// Reads Standard MIDI Files as livebass/smf.py does: from bytes to messages with ticks. Harmless damage gives a
// warning; other damage is an Error with track and byte.
import {decodeTexts, shownName} from "./names.js";
import {RULE} from "../rule.js";

const CHUNK_HEAD = 8; // bytes: name and length
const META = {text: 0x01, trackName: 0x03, instrument: 0x04, channel: 0x20, port: 0x21, end: 0x2f, tempo: 0x51, metre: 0x58};
export const NOTE_OFF = 0x80;
export const NOTE_ON = 0x90;
export const CONTROL = 0xb0;
export const PROGRAM = 0xc0;
export const PRESSURE = 0xd0;
export const WHEEL = 0xe0;
const NO_CHANNEL = -1;

// A Map's list for a key; a new one if it has none.
export function listOf(map, key) {
  if (!map.has(key)) map.set(key, []);
  return map.get(key);
}

export const plural = count => count > 1 ? "s" : "";

// True if `word` stands at `at`.
const standsAt = (data, word, at) => [...word].every((letter, k) => data[at + k] === letter.charCodeAt(0));

// The first place of `word` that lies entirely from `from` to `to`; -1: nowhere.
function findWord(data, word, from, to = data.length) {
  for (let at = from; (at = data.indexOf(word.charCodeAt(0), at)) >= 0 && at + word.length <= to; at++)
    if (standsAt(data, word, at)) return at;
  return -1;
}

const bigEndian = bytes => bytes.reduce((value, byte) => value * 256 + byte, 0);

// True if a chunk may begin at `at`: a track, or four printable characters and a length that fits the file.
function isChunk(data, at) {
  if (standsAt(data, "MTrk", at)) return true;
  const fits = at + CHUNK_HEAD <= data.length && at + CHUNK_HEAD + bigEndian(data.subarray(at + 4, at + CHUNK_HEAD)) <= data.length;
  return fits && data.subarray(at, at + 4).every(byte => byte >= 0x20 && byte < 0x7f);
}

// A cursor over `data` from `at` to `end`. Its errors name `place` and the byte.
class ByteCursor {
  constructor(data, at, end, place) {
    this.data = data;
    this.at = at;
    this.end = end;
    this.place = place;
  }

  fail(what, at = this.at) {
    return new Error(`${this.place}, byte ${at}: ${what}`);
  }

  // Moves past `count` bytes; returns their beginning. `what` names them in errors.
  skip(count, what) {
    if (this.at + count > this.end)
      throw this.fail(`${what} of ${count} bytes, ${this.end - this.at} left: the file is truncated or damaged`);
    this.at += count;
    return this.at - count;
  }

  take(count, what) {
    const from = this.skip(count, what);
    return this.data.subarray(from, from + count);
  }

  byte(what) {
    return this.data[this.skip(1, what)];
  }

  // Reads a variable-length quantity of at most 4 bytes.
  number(what) {
    const start = this.at;
    for (let k = 0, value = 0; k < 4; k++) {
      const byte = this.byte(what);
      value = value << 7 | byte & 0x7f;
      if (byte < 0x80) return value;
    }
    throw this.fail(`${what} longer than 4 bytes`, start);
  }
}

// The contents of a track, as far as read.
class SmfTrack {
  constructor(number) {
    this.number = number; // from 0
    this.at = 0; // the next byte to read
    this.ended = false; // by its End of Track
    this.tick = 0; // of the last event read
    this.port = 0;
    this.ports = new Set(); // that the track sets
    this.prefix = NO_CHANNEL;
    this.messages = []; // {tick, frame, track, port, line, kind, channel, a, b}; lines.js sets frame and line; no b: the
                        // message has one byte of data
    this.exclusive = []; // {tick, port, data}
    this.tempos = []; // {tick, tempo}, us per quarter note
    this.metres = []; // {tick, quarters}: the length of a bar from there on
    this.names = []; // {channel or NO_CHANNEL, kind of meta event, bytes}
    this.texts = [];
    this.oddities = []; // [text, with {} for their number, and the byte]
  }

  // Reads up to the End of Track, which may be missing.
  read(cursor) {
    let running = 0;
    while (cursor.at < cursor.end && !this.ended) {
      this.tick += cursor.number("delta time");
      const start = cursor.at, status = cursor.byte("event");
      if (status === 0xff) {
        const kind = cursor.byte("meta event");
        this.takeMeta(kind, cursor.take(cursor.number("meta event length"), "meta event"), start);
      } else if (status === 0xf0 || status === 0xf7) {
        const data = cursor.take(cursor.number("system exclusive length"), "system exclusive");
        if (status === 0xf0)
          this.exclusive.push({tick: this.tick, port: this.port, data: data.at(-1) === 0xf7 ? data.subarray(0, -1) : data});
      } else if (status > 0xef) {
        cursor.skip(RULE.systemCommon[status] || 0, "system message");
        this.oddities.push(["skipped {} system message{s} that files cannot have", start]);
      } else {
        if (status < 0x80) {
          if (!running) throw cursor.fail(`data byte 0x${hexByte(status)} without a status byte before it`, start);
          cursor.at = start;
        } else {
          running = status;
          this.prefix = NO_CHANNEL;
        }
        this.takeMessage(running, cursor, start);
      }
    }
    this.at = cursor.at;
    if (this.ports.size === 1) // it holds for the whole track, wherever it stands
      for (const message of [...this.messages, ...this.exclusive]) message.port = this.port;
    return this;
  }

  takeMeta(kind, data, start) {
    if (kind === META.end) {
      this.ended = true;
    } else if (kind === META.tempo) {
      if (data.length === 3 && data.some(byte => byte)) this.tempos.push({tick: this.tick, tempo: bigEndian(data)});
      else this.oddities.push(["ignored {} tempo event{s} of 0 us or other than 3 bytes", start]);
    } else if (kind === META.metre && data.length > 1 && data[0] && data[1] < 8) {
      this.metres.push({tick: this.tick, quarters: 4 * data[0] / 2 ** data[1]});
    } else if (kind === META.text && this.tick === 0) {
      this.texts.push(data);
    } else if (kind === META.trackName || kind === META.instrument) {
      if (!this.names.some(name => name.channel === this.prefix && name.kind === kind))
        this.names.push({channel: this.prefix, kind, bytes: data});
    } else if (kind === META.channel && data.length && data[0] < RULE.channels) {
      this.prefix = data[0];
    } else if (kind === META.port && data.length) {
      this.port = data[0];
      this.ports.add(this.port);
    }
  }

  takeMessage(status, cursor, start) {
    const kind = status & 0xf0, one = kind === PROGRAM || kind === PRESSURE, at = cursor.skip(one ? 1 : 2, "message");
    const a = cursor.data[at], b = one ? undefined : cursor.data[at + 1];
    if (a > 0x7f || b > 0x7f) this.oddities.push(["took {} data byte{s} above 0x7F for 0x7F", start]);
    this.messages.push({
      tick: this.tick, frame: 0, track: this.number, port: this.port, line: 0, kind, channel: status & 0x0f,
      a: Math.min(a, 0x7f), b: b === undefined ? undefined : Math.min(b, 0x7f),
    });
  }
}

const hexByte = byte => byte.toString(16).toUpperCase().padStart(2, "0");
const byTick = lists => lists.length === 1 ? lists[0] : lists.flat().sort((a, b) => a.tick - b.tick);

// The content of a Standard MIDI File, a Uint8Array. Ticks count from the file's start.
export class Smf {
  constructor(data) {
    this.warnings = []; // lines about harmless damage
    this.kind = this.count = 0; // of the file; number of tracks in its header
    const file = this.readHeader(this.withoutRest(data)), odd = new Map(), tracks = this.readTracks(file, odd);
    this.warnOf(odd, tracks.length);
    const played = this.played(tracks);
    this.messages = byTick(played.map(track => track.messages)); // by tick, track and place in the track
    this.tempos = byTick(played.map(track => track.tempos));
    this.metres = byTick(played.map(track => track.metres));
    this.exclusive = byTick(played.map(track => track.exclusive));
    this.endTick = played.reduce((end, track) => Math.max(end, track.tick), 0);
    this.channelNames = new Map(); // by "track channel", both from 0, from channel prefixes
    this.texts = new Set(); // at tick 0, beside the names
    this.takeNames(played);
  }

  // The file without its surroundings: RIFF, or stray bytes before the header.
  withoutRest(data) {
    if (!data.length) throw new Error("the file is empty (0 bytes)");
    const inner = standsAt(data, "RIFF", 0) && standsAt(data, "RMID", 8) ? inRiff(data) : data;
    const start = findWord(inner, "MThd", 0, Math.min(inner.length, RULE.mostBefore));
    if (start < 0) throw new Error("not a Standard MIDI File (it does not begin with MThd)");
    if (start > 0) this.warnings.push(`skipped ${start} bytes before the header`);
    return inner.subarray(start);
  }

  // Reads the header; returns a cursor after it.
  readHeader(data) {
    const file = new ByteCursor(data, 4, data.length, "header"), size = bigEndian(file.take(4, "header length"));
    if (size < 6) throw new Error(`header, byte 4: the header's length must be 6 or more, not ${size}`);
    const body = file.take(size, "header");
    const [kind, count, division] = [0, 2, 4].map(k => bigEndian(body.subarray(k, k + 2)));
    [this.kind, this.count] = [kind, count];
    if (this.kind > 2)
      throw new Error(`its type must be 0 (one track), 1 (tracks together) or 2 (patterns), not ${this.kind}`);
    this.takeDivision(division);
    return file;
  }

  // Sets ticksPerQuarter, or 0 and ticksPerSecond [numerator, denominator].
  takeDivision(word) {
    this.ticksPerQuarter = word & 0x8000 ? 0 : word;
    if (word === 0) throw new Error("header, byte 12: ticks per quarter note must be from 1 to 32767, not 0");
    if (this.ticksPerQuarter) return;
    const frames = 256 - (word >> 8), ticks = word & 0xff, rate = RULE.smpteRates[frames];
    if (!rate || !ticks) {
      const rule = "24, 25, 29 or 30 frames of 1 to 255 ticks";
      throw new Error(`header, byte 12: the time code must be ${rule}, not ${frames} of ${ticks}`);
    }
    this.ticksPerSecond = [rate[0] * ticks, rate[1]];
  }

  // Reads all tracks; `odd` collects the places of harmless oddities, by kind.
  readTracks(file, odd) {
    const tracks = [], behind = file.at;
    const note = (what, at) => listOf(odd, what).push(`${file.place}, byte ${at}`);
    while (this.seekTrack(file, tracks.length + 1, note)) {
      const track = readNextTrack(file, tracks.length);
      track.oddities.forEach(([what, at]) => note(what, at));
      tracks.push(track);
    }
    if (tracks.length) return tracks;
    file.at = behind;
    file.take(4, "chunk name");
    throw file.fail("no track chunk (MTrk) behind it: the file is damaged");
  }

  // Moves to the next track chunk, past other chunks and stray bytes. False if there is none, or another file comes
  // first.
  seekTrack(file, number, note) {
    file.place = `track ${number} of ${Math.max(number, this.count)}`;
    const {data} = file;
    let {at} = file;
    while (isChunk(data, at) && !standsAt(data, "MThd", at) && !standsAt(data, "MTrk", at))
      at += CHUNK_HEAD + bigEndian(data.subarray(at + 4, at + CHUNK_HEAD));
    if (!standsAt(data, "MTrk", at)) {
      const another = findWord(data, "MThd", file.at);
      at = findWord(data, "MTrk", file.at, another >= 0 ? another : data.length);
      if (at >= 0) note("skipped {} run{s} of stray bytes", file.at);
    }
    if (at < 0 || at + CHUNK_HEAD > file.end) return false;
    file.at = at;
    return true;
  }

  warnOf(odd, tracks) {
    for (const [what, places] of odd) {
      const count = what.replace("{}", places.length).replace("{s}", plural(places.length));
      const where = `${places.length > 1 ? "first at " : ""}${places[0]}`;
      this.warnings.push(what.includes("{}") ? `${count} (${where})` : what);
    }
    if (tracks < this.count) this.warnings.push(`has ${tracks} of the ${this.count} tracks that its header promises`);
    else if (tracks > this.count)
      this.warnings.push(`has ${tracks} tracks, not ${this.count} as its header says: plays all`);
  }

  // The tracks to play; in a file of patterns, which follow each other, the first with messages.
  played(tracks) {
    if (this.kind !== 2 || tracks.length < 2) return tracks;
    const played = Math.max(0, tracks.findIndex(track => track.messages.length));
    this.warnings.push(`has ${tracks.length} patterns (type 2): plays number ${played + 1}`);
    return tracks.map((track, number) => number === played ? track : new SmfTrack(number));
  }

  takeNames(tracks) {
    const names = tracks.flatMap(({number, names}) => names.map(name => ({number, ...name})));
    const texts = tracks.flatMap(track => track.texts);
    const decoded = decodeTexts([...names.map(name => name.bytes), ...texts]).map(shownName);
    const title = (number, kind) =>
      decoded[names.findIndex(name => name.number === number && name.kind === kind && name.channel === NO_CHANNEL)] || "";
    this.instruments = tracks.map(({number}) => title(number, META.instrument)); // by name; "": it has none
    this.names = tracks.map(({number}) => title(number, META.trackName) || this.instruments[number]);
    names.forEach(({number, channel}, k) => {
      if (channel !== NO_CHANNEL) this.channelNames.set(`${number} ${channel}`, decoded[k]);
    });
    decoded.slice(names.length).forEach(text => this.texts.add(text));
  }
}

// The Standard MIDI File in a RIFF file: its chunk "data".
function inRiff(data) {
  for (let at = 12; at + CHUNK_HEAD <= data.length;) {
    const size = bigEndian(data.slice(at + 4, at + CHUNK_HEAD).reverse()), from = at + CHUNK_HEAD;
    if (standsAt(data, "data", at)) return data.subarray(from, from + size);
    at = from + size + size % 2;
  }
  throw new Error("RIFF file without a chunk of MIDI data: the file is truncated or damaged");
}

// Reads the track chunk at `file`'s place, and moves `file` past it. A track ends with its chunk or, if the chunk's
// length cannot be right, at its End of Track or the next track's beginning.
function readNextTrack(file, number) {
  const {data} = file, start = file.at + CHUNK_HEAD, end = start + bigEndian(data.subarray(start - 4, start));
  let track;
  if (end === file.end || isChunk(data, end)) {
    track = new SmfTrack(number).read(new ByteCursor(data, start, end, file.place));
    file.at = track.ended && standsAt(data, "MTrk", track.at) ? track.at : end;
  } else {
    track = readToItsMark(file, start, end, number);
    file.at = track.at;
  }
  if (file.at !== end) {
    const off = file.at < end ? `${end - file.at} bytes shorter` : `${file.at - end} bytes longer`;
    track.oddities.push([`${file.place} is ${off} than it says`, start - CHUNK_HEAD]);
  }
  return track;
}

// Reads a track from `start` whose chunk has a wrong end, `end`.
function readToItsMark(file, start, end, number) {
  const {data} = file, following = findWord(data, "MTrk", start), limit = following >= 0 ? following : file.end;
  try {
    const track = new SmfTrack(number).read(new ByteCursor(data, start, limit, file.place));
    if (track.ended || following >= 0 || end > file.end) return track;
  } catch {
    if (end > file.end) {
      file.at = start;
      file.take(end - start, "chunk"); // throws: cut off within an event
    }
  }
  return new SmfTrack(number).read(new ByteCursor(data, start, end, file.place));
}
