// MIDI files on the page: which notes they hold, and who plays them.
"use strict";

const BASSES = {first: 32, last: 39}; // programs of General MIDI, from 0
const DRUMS = 9; // the channel of drums, from 0
const MOST_SONG = 4 << 20; // bytes of a file

class Song {
  // Reads a Standard MIDI File, an ArrayBuffer. Throws an Error with one line for what is none.
  constructor(buffer) {
    if (buffer.byteLength > MOST_SONG) throw new Error(`has ${(buffer.byteLength / 1e6).toFixed(1)} MB; allowed are 4`);
    this.view = new DataView(buffer);
    const [kind, size] = this.chunk(0);
    if (kind !== "MThd" || size < 6) throw new Error("is no MIDI file");
    const tracks = this.view.getUint16(10), division = this.view.getUint16(12);
    this.events = []; // {tick, order, midi} of channels, {tick, order, tempo}
    this.names = new Map(); // of channels, by the track that they are in
    let at = 8 + size;
    for (let track = 0; track < tracks && at + 8 <= buffer.byteLength; track++) {
      const [name, length] = this.chunk(at);
      if (name === "MTrk") this.readTrack(at + 8, Math.min(buffer.byteLength, at + 8 + length), track);
      at += 8 + length;
    }
    this.events.sort((a, b) => a.tick - b.tick || a.order - b.order);
    this.time(division);
    if (!this.events.some(({midi}) => midi && (midi[0] & 0xf0) === 0x90)) throw new Error("has no notes");
  }

  chunk(at) {
    if (at + 8 > this.view.byteLength) throw new Error("is no MIDI file");
    return [String.fromCharCode(...Array.from({length: 4}, (_, k) => this.view.getUint8(at + k))), this.view.getUint32(at + 4)];
  }

  readTrack(at, end, track) {
    let tick = 0, status = 0, title = "";
    const byte = () => {
      if (at >= end) throw new Error(`track ${track + 1} ends in the middle of a message`);
      return this.view.getUint8(at++);
    };
    const number = () => {
      let value = 0, part;
      do {
        part = byte();
        value = value << 7 | part & 0x7f;
      } while (part & 0x80);
      return value;
    };
    while (at < end) {
      tick += number();
      let first = byte();
      if (first >= 0x80) {
        status = first < 0xf0 ? first : status;
      } else {
        if (!status) throw new Error(`track ${track + 1} begins with no message`);
        at--;
        first = status;
      }
      const order = this.events.length;
      if (first === 0xff) {
        const kind = byte(), length = number(), text = at;
        at += length;
        if (at > end) throw new Error(`track ${track + 1} ends in the middle of a message`);
        if (kind === 0x51 && length === 3) {
          const tempo = this.view.getUint16(text) << 8 | this.view.getUint8(text + 2);
          this.events.push({tick, order, tempo}); // us a quarter note
        } else if (kind === 3) {
          title = new TextDecoder().decode(new Uint8Array(this.view.buffer, text, length));
        }
      } else if (first >= 0xf0) {
        at += number();
      } else {
        const midi = [first, byte()];
        if (![0xc0, 0xd0].includes(first & 0xf0)) midi.push(byte());
        this.events.push({tick, order, midi});
        if (!this.names.has(first & 15) || title) this.names.set(first & 15, title);
      }
    }
  }

  // Gives each event its time, s.
  time(division) {
    let tempo = 500000, tick = 0, seconds = 0;
    const frames = division & 0x8000 ? (256 - (division >> 8)) * (division & 255) : 0; // ticks a second
    for (const event of this.events) {
      seconds += (event.tick - tick) * (frames ? 1 / frames : tempo / 1e6 / (division || 1));
      tick = event.tick;
      event.seconds = seconds;
      if (event.tempo) tempo = event.tempo;
    }
    this.length = seconds;
  }

  // What the channels play: {channel, name, program, notes}, those with notes.
  parts() {
    const found = new Map();
    for (const {midi} of this.events) {
      if (!midi) continue;
      const channel = midi[0] & 15, part = found.get(channel) || {channel, name: this.names.get(channel) || "", program: 0, notes: 0};
      found.set(channel, part);
      if ((midi[0] & 0xf0) === 0xc0 && !part.notes) part.program = midi[1];
      if ((midi[0] & 0xf0) === 0x90 && midi[2] > 0) part.notes++;
    }
    return [...found.values()].filter(part => part.notes).sort((a, b) => a.channel - b.channel);
  }

  // The channel of the bass: by its program, by its name, or the only one but the drums; undefined: nobody can tell.
  bass() {
    const parts = this.parts(), others = parts.filter(part => part.channel !== DRUMS);
    const is = [part => part.program >= BASSES.first && part.program <= BASSES.last, part => /bass/i.test(part.name)];
    for (const by of is) {
      const found = others.find(by);
      if (found) return found.channel;
    }
    return parts.length === 1 ? parts[0].channel : undefined;
  }

  // The messages of a channel, on channel 1 and without program changes: {seconds, midi}.
  messages(channel) {
    return this.events.filter(({midi}) => midi && (midi[0] & 15) === channel && (midi[0] & 0xf0) !== 0xc0)
      .map(({seconds, midi}) => ({seconds, midi: [midi[0] & 0xf0, ...midi.slice(1)]}));
  }
}

// 32 bits a sample, mono: a WAV file of blocks of Float32Array at a rate (Hz).
function wavOf(blocks, rate) {
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
