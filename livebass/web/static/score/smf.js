// Reads Standard MIDI Files by the kernels, in whose memory their rows stay; names and remarks become texts.
import {N, RECORDS} from "../audio/kernels.js";
import {decodeTexts, shownName} from "./names.js";
import {NUMBERS, sentence} from "./sentences.js";
import {WORDS} from "../words.js";

// The content of a Standard MIDI File, a Uint8Array. Ticks count from the file's start. Throws an Error with one line,
// which names track and byte, for any other or too damaged bytes.
export class Smf {
  constructor(kernels, data) {
    const given = kernels.add(data.length), at = kernels.add(RECORDS.SMF.bytes);
    this.kernels = kernels;
    this.at = at; // of its SMF
    kernels.bytes.set(data, given);
    kernels.fill("SMF", at, {data: given, size: data.length});
    const error = Number(kernels.x.lb_measure_smf(BigInt(at)));
    if (error) throw new Error(sentence(WORDS.errors[error], NUMBERS.map(k => kernels.get("SMF", at, "file.numbers", k))));
    kernels.set("SMF", at, "memory", kernels.add(kernels.get("SMF", at, "room")));
    kernels.x.lb_fill_smf(BigInt(at));
    this.ticksPerQuarter = this.reported("per_quarter"); // or 0 and ticksPerSecond [numerator, denominator]
    this.ticksPerSecond = [this.reported("per_second"), this.reported("per_second", 1)];
    this.endTick = this.reported("end");
    this.warnings = this.rows("REMARK", get => sentence(WORDS.remarks[get("code")], NUMBERS.map(k => get("numbers", k))));
    this.metres = this.rows("METER", get => ({tick: get("tick"), quarters: 4 * get("over") / get("under")}));
    this.instruments = /** @type {string[]} */ ([]); // of the tracks by name; "": it has none
    this.names = /** @type {string[]} */ ([]); // the instrument's if a track has no own
    this.channelNames = new Map(); // by "track channel", both from 0, from channel prefixes
    this.texts = new Set(); // at tick 0, beside the names
    this.takeNames();
  }

  reported(name, k = 0) { return this.kernels.get("SMF", this.at, `file.${name}`, k); }

  // What `make` makes of each row of a kind; its argument returns a field of the row.
  rows(record, make) {
    const {kernels} = this, kind = N.ROWS[record], begin = kernels.get("SMF", this.at, "rows", kind);
    return Array.from({length: kernels.get("SMF", this.at, "count", kind)}, (_, row) =>
      make((name, k) => kernels.get(record, begin + row * RECORDS[record].bytes, name, k)));
  }

  // A copy of the bytes of a row.
  bytes(get) {
    const from = this.kernels.get("SMF", this.at, "data") + get("at");
    return this.kernels.bytes.slice(from, from + get("size"));
  }

  takeNames() {
    const rows = this.rows("TEXT", get => ({track: get("track"), channel: get("channel"), kind: get("kind"), bytes: this.bytes(get)}));
    const names = rows.filter(({kind}) => kind === N.META_TRACK_NAME || kind === N.META_INSTRUMENT);
    const texts = rows.filter(({kind}) => kind === N.META_TEXT), count = this.reported("tracks");
    const decoded = decodeTexts([...names, ...texts].map(({bytes}) => bytes)).map(shownName);
    const titles = kind => {
      const found = Array(count).fill("");
      names.forEach((name, k) => { if (name.kind === kind && name.channel === N.NO_CHANNEL) found[name.track] = decoded[k]; });
      return found;
    };
    this.instruments = titles(N.META_INSTRUMENT);
    this.names = titles(N.META_TRACK_NAME).map((title, track) => title || this.instruments[track]);
    names.forEach(({track, channel}, k) => { if (channel !== N.NO_CHANNEL) this.channelNames.set(`${track} ${channel}`, decoded[k]); });
    this.texts = new Set(decoded.slice(names.length));
  }
}
