// Records the sound as a WAV file.
import {$, save, say, setPressed} from "../pages/page.js";
import {player} from "./player.js";
import {wavOf} from "../score/song.js";
import {state} from "../pages/state.js";

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
