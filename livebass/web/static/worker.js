// Builds basses in a memory of its own, each at addresses that are free in the audio thread, and hands their bytes
// over: the audio thread only copies them.
import {Engine, N} from "./engine.js";
import {Maker} from "./maker.js";

// The messages of a worker, which go to the page.
/** @type {(message: object, moved?: Transferable[]) => void} */
const answer = /** @type {any} */ (postMessage);
/** @type {WebAssembly.Module} */
let module;
let home = 0; // where basses may begin
const taken = new Map(); // address of a bass: [where its memory begins, where it ends]
const sizes = new Map(); // of basses built before, by file, tier, rate and length of an impulse response

// Where `size` bytes are free; beyond everything if the size is not known yet.
function place(size) {
  const used = [...taken.values()].sort((a, b) => a[0] - b[0]);
  let at = home;
  for (const [begin, end] of used) {
    if (size && begin - at >= size) return at;
    at = Math.max(at, end);
  }
  return at;
}

function build({id, name, file, tier, rate, response}) {
  const key = `${name} ${tier} ${rate} ${response?.length}`, at = place(sizes.get(key));
  const engine = new Engine(module); // new: the memory of the last one was all this bass's
  const {bass, end} = engine.build(file, tier, rate, at, response);
  taken.set(bass, [at, end]);
  sizes.set(key, end - at);
  const image = engine.memory.buffer.slice(at, end);
  answer({id, built: {bass, at, image}}, [image]);
  return [engine, bass];
}

// Plays for a while: browsers compile what is played often a second time, better, for all instances of a module.
function warm(engine, bass, rate, ms) {
  engine.begin(rate);
  engine.setField("next_bass", bass);
  const end = Date.now() + ms;
  for (let k = 0; Date.now() < end; k++) {
    if (k % 40 === 0) for (let s = 0; s < 4; s++) engine.send(N.NOW, 0x90, 28 + 5 * s + k / 40 % 5, 120);
    engine.play(128);
  }
}

// Makes the last note of a string again, or a pluck of the first string, on a bass as new.
function again({id, file, tier, rate, response, recalled, pluck, before, frames, heard}) {
  const engine = new Engine(module), {bass} = engine.build(file, tier, rate, home, response);
  const made = recalled ? engine.again(bass, recalled, before, frames) : engine.pluck(bass, pluck, before, frames, heard);
  answer({id, built: made}, [made.rows.buffer, made.slots.buffer, made.sound.buffer]);
}

onmessage = ({data}) => {
  if (data.module) {
    module = data.module;
    home = new Engine(module).home;
    answer({id: data.id});
  } else if (data.free) {
    taken.delete(data.free);
  } else {
    try {
      if (data.recalled || data.pluck) {
        again(data);
        return;
      }
      if (data.make) {
        const made = new Maker(module, data.bench).make(data.file, data.make, data.names);
        answer({id: data.id, built: made}, [made.file]);
        return;
      }
      if (data.samples) {
        const cut = new Engine(module).cutResponse(data.samples, data.rate, data.normalized);
        answer({id: data.id, built: cut}, [cut.buffer]);
        return;
      }
      const [engine, bass] = build(data);
      if (data.warm) warm(engine, bass, data.rate, data.warm);
    } catch (error) {
      answer({id: data.id, error: /** @type {Error} */ (error).message});
    }
  }
};
