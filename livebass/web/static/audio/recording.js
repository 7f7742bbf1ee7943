// Records the sound as a WAV file.
import {$, save, say, setPressed} from "../pages/page.js";
import {player} from "./player.js";
import {state} from "../pages/state.js";

// A mono WAV file, 32 bits per sample, of blocks of Float32Array at a rate (Hz).
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

// Takes a part of the recording; the last one makes the file.
function takePart(/** @type {{taped: Float32Array<ArrayBuffer>, last?: boolean}} */ {taped, last}) {
  state.tape?.push(taped);
  if (!last || !state.tape) return;
  save(wavOf(state.tape, player.context.sampleRate), `livebass-${$("bass").value}.wav`);
  state.tape = undefined;
}

async function record() {
  show(true);
  try {
    await player.sound();
  } catch (error) {
    show(false);
    throw error;
  }
  if (!recording()) return; // it was pressed again
  state.tape = [];
  player.record(true);
}

function stop() {
  if (!recording()) return;
  if (state.tape) player.record(false);
  show(false);
}

const recording = () => $("record").textContent !== "Record";

function show(/** @type {boolean} */ on) {
  setPressed($("record"), on);
  $("record").textContent = on ? "Stop and save" : "Record";
}

$("record").onclick = () => {
  if (recording()) stop();
  else record().catch(error => say(error.message));
};
player.on("taped", takePart);
player.on("ends", stop);
