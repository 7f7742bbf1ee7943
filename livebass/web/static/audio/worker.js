// Builds basses in its own memory, each at addresses that are free in the audio thread, and hands over their bytes: the
// audio thread only copies them.
import {Engine, pieces} from "./engine.js";
import {N, RECORDS, UNPLAYABLE} from "./kernels.js";
import {fretText} from "../neck/places.js";

// The messages of a worker, which go to the page.
/** @type {(message: object, moved?: Transferable[]) => void} */
const answer = /** @type {any} */ (postMessage);
/** @type {Engine} */
let engine; // for one job after another: browsers are slow to free the memory of a new one for each
let mapped = 0; // the bass of the last `buzz`
const taken = new Map(); // address of a bass: [begin of its memory, end]
const names = []; // of basses built before: versions of one carry on each other's notes
const rooms = new Map(); // bytes for a bass, by name, tier, rate and length of an impulse response
const MORE = 1 / 64; // of a room: lower necks need more, as strings lie on frets, and versions of a bass take turns in two rooms

// The first place with `size` free bytes, and the free bytes there.
function place(size) {
  const used = [...taken.values()].sort((a, b) => a[0] - b[0]);
  let at = engine.home;
  for (const [begin, end] of used) {
    if (begin - at >= size) return {at, room: begin - at};
    at = Math.max(at, end);
  }
  return {at, room: Infinity};
}

function build({id, name, file, tier, rate, response}) {
  const key = `${name} ${tier} ${rate} ${response?.length}`, known = rooms.get(key) ?? 0, guess = Math.max(0, ...rooms.values());
  if (!names.includes(name)) names.push(name);
  let bass, at, room, size, kept = known || guess;
  do { // it may turn out to be larger
    ({at, room} = place(kept));
    engine.clear();
    bass = engine.build(file, tier, rate, at, response, 1 + names.indexOf(name));
    size = pieces(engine.end - at);
    kept = size <= known ? known : pieces(size * (1 + MORE));
  } while (kept > room);
  taken.set(bass, [at, at + kept]);
  rooms.set(key, kept);
  engine.reserve(at + size);
  const packed = engine.pack(at, at + size);
  answer({id, built: {bass, at, size, ...packed}}, [packed.image]);
  return bass;
}

// Plays for a while: browsers recompile busy code better, for all instances of a module.
function warm(bass, rate, ms) {
  engine.begin(rate);
  engine.setField("next_bass", bass);
  const end = Date.now() + ms;
  for (let k = 0; Date.now() < end; k++) {
    if (k % 40 === 0) for (let s = 0; s < 4; s++) engine.send(N.NOW, 0x90, 28 + 5 * s + k / 40 % 5, 120);
    engine.play(128);
  }
}

// Makes a motion on a new bass: a string's last note again, a note that somebody would play, a string that a hand pulled,
// or a pluck of the first string without a player.
function move({id, file, tier, rate, response, recalled, performed, pluck, pulled, before, frames, heard, changed}) {
  const fresh = () => {
    engine.clear();
    return engine.build(file, tier, rate, engine.home, response);
  };
  const bass = fresh(), how = {before, frames, heard, changed};
  let made;
  if (pluck) {
    made = engine.pluck(bass, pluck, how);
  } else if (pulled) {
    made = engine.letGo(bass, pulled, how);
  } else if (recalled) {
    made = engine.again(bass, recalled, how);
  } else {
    const found = engine.perform(bass, performed, rate);
    if (!found) throw new Error("the note does not sound on this string");
    made = engine.again(fresh(), found, how);
  }
  answer({id, built: made}, [made.rows.buffer, made.across.buffer, made.slots.buffer, made.sound.buffer]);
}

// Returns what a hand needs to pull a string: as `hold` of the engine, with the player's hardest pluck and farthest pull
// (m).
function hold({hold: {string, fret, note}, file, tier, rate}) {
  engine.clear();
  const bass = engine.build(file, tier, rate, engine.home), held = engine.hold(bass, string, fret);
  const farthest = engine.get("PERFORMER", engine.get("BASS", bass, "performer"), "player.greatest_apex");
  return {...held, farthest, hardest: engine.hardest(bass, string, note, rate)};
}

// Returns what notes do at frets of a new bass: `buzz` of the engine. Without a file: of the bass of the message before,
// which was of this kind, too.
function buzz({buzz: notes, file, tier, rate}) {
  if (file) {
    engine.clear();
    mapped = engine.build(file, tier, rate, engine.home);
  }
  return engine.buzz(mapped, notes, rate);
}

// Returns the image of a bass's instrument file as changed by the sliders; also the heights of the bass's crowns (m from
// each open string), the frets at which a string frets out, each with the higher one that it lies on, and the pickups'
// places (m from the saddle). Throws an Error, one line, for a file of another kind,
// and for a neck that cannot be played. `neck`: its strings and frets, as the bass has them.
function change({change: values, file, neck}) {
  engine.clear();
  const get = (name, k) => engine.get("CHANGE", at, name, k);
  const at = engine.add(RECORDS.CHANGE.bytes), given = engine.add(file.byteLength);
  engine.bytes.set(new Uint8Array(file), given);
  engine.fill("CHANGE", at, {file: given, size: file.byteLength, memory: engine.end});
  for (const [k, value] of values) engine.set("CHANGE", at, "value", value, k);
  if (Number(engine.x.lb_measure_change(BigInt(at))) !== N.GOOD) throw new Error("not a bass of this version");
  engine.add(get("bytes"));
  const state = Number(engine.x.lb_make_change(BigInt(at)));
  const record = at + N.BENCH_PLACE;
  const of = (name, k) => engine.get("BENCH", record, name, k);
  if (state !== N.MADE) {
    const above = `stands ${(1000 * of("fault_height")).toFixed(2)} mm above string ${neck.strings[of("fault_string")].name} at rest`;
    const error = new Error(`${state === N.CROWN_ABOVE ? fretText(neck, of("fault_string"), of("fault_place")) : "the board"} ${above}`);
    error.name = UNPLAYABLE;
    throw error;
  }
  const heights = [], rests = [], frets = of("frets");
  neck.strings.forEach((_, i) => {
    const string = record + RECORDS.BENCH.fields.string[0] + i * RECORDS.BENCH_STRING.bytes;
    const [first, count, length] = ["frets", "frets_count", "length"].map(name => engine.get("BENCH_STRING", string, name));
    const number = k => engine.view.getFloat64(of("numbers") + 8 * k, true);
    heights.push(Array.from({length: count}, (_, k) => number(first + 2 * k + 1)));
    const ends = Array.from({length: count}, (_, k) => length - number(first + 2 * k)), of_string = {};
    for (let fret = 1; fret <= frets; fret++) {
      const note = of("notes") + RECORDS.NOTE.bytes * (i * (frets + 1) + fret), read = name => engine.get("NOTE", note, name);
      let on = 1 + ends.indexOf(read("length")), steepest = 0; // over a board the string ends at the place it lies on
      for (let k = 0, at = read("obstacles"); k < read("obstacles_count"); k++, at += 2) {
        const [x, height] = [0, 1].map(own => engine.view.getFloat64(of("lists") + 8 * (at + own), true));
        if (height > steepest * (read("length") - x)) [on, steepest] = [fret + 1 + k, height / (read("length") - x)];
      }
      if (on > fret) of_string[fret] = on;
    }
    rests.push(of_string);
  });
  const places = Array.from({length: of("pickups")}, (_, k) => of("position", k));
  return {file: engine.memory.buffer.slice(get("made"), get("made") + 8 * get("words")), heights, rests, places};
}

onmessage = ({data}) => {
  if (data.module) {
    engine = new Engine(data.module);
    answer({id: data.id});
  } else if (data.free) {
    taken.delete(data.free);
  } else {
    try {
      if (data.recalled || data.performed || data.pluck || data.pulled) {
        move(data);
        return;
      }
      if (data.hold) {
        answer({id: data.id, built: hold(data)});
        return;
      }
      if (data.buzz) {
        answer({id: data.id, built: buzz(data)});
        return;
      }
      if (data.change) {
        const made = change(data);
        answer({id: data.id, built: made}, [made.file]);
        return;
      }
      if (data.samples) {
        engine.clear();
        const cut = engine.cutResponse(data.samples, data.rate, data.normalized);
        answer({id: data.id, built: cut}, [cut.buffer]);
        return;
      }
      const bass = build(data);
      if (data.warm) warm(bass, data.rate, data.warm);
    } catch (error) {
      const {message, name} = /** @type {Error} */ (error);
      answer({id: data.id, error: message, kind: name});
    }
  }
};
