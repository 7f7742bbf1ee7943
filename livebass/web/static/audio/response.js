// The player's own cabinet impulse response, from an audio file.
import {$, busy, isPressed, setPressed} from "../pages/page.js";
import {player} from "./player.js";
import {state} from "../pages/state.js";
import {workshop} from "./workshop.js";

const MIN_LEVEL = 1e-3; // of the loudest channel: a channel below it is silent
const LONGEST = 1; // s
const SILENT = "has no sound that can be played";

/**
 * Reads an impulse response from an audio file, at the browser's rate: the first channel that is not silent.
 * @param {File} file
 * @returns {Promise<ResponseFile>}
 */
async function readResponse(file) {
  const sound = await player.context.decodeAudioData(await file.arrayBuffer())
    .catch(() => { throw new Error("not an audio file"); });
  const channels = Array.from({length: sound.numberOfChannels}, (_, k) => sound.getChannelData(k));
  const loudest = channels.map(samples => samples.reduce((maximum, x) => Math.max(maximum, Math.abs(x)), 0));
  const maximum = Math.max(...loudest);
  const channel = loudest.findIndex(level => level >= MIN_LEVEL * maximum);
  if (!(maximum > 0) || !Number.isFinite(maximum)) throw new Error(SILENT);
  return {name: file.name, samples: Float64Array.from(channels[channel]), channels: channels.length, channel};
}

// Cuts the response; the bass stays as loud as without it or, with the button, gets the file's level.
async function cut(/** @type {ResponseFile} */ {samples}) {
  const rate = player.context.sampleRate;
  /** @type {Float64Array} */
  const taken = await workshop.ask({samples, rate, normalized: !isPressed($("response-level"))});
  if (!taken.length) throw new Error(SILENT);
  if (taken.length > LONGEST * rate)
    throw new Error(`lasts ${(taken.length / rate).toFixed(1)} s; a response lasts ${LONGEST} s at most`);
  return taken;
}

function textOf(/** @type {ResponseFile} */ {name, channels, channel}) {
  if (channels === 1) return `Through ${name}.`;
  const which = channels === 2 ? `the ${["left", "right"][channel]} one` : `number ${channel + 1}`;
  return `Through ${name}: ${channels} channels; ${which} is played.`;
}

// Builds the bass with an audio file's impulse response, or without one of the player's own.
async function takeResponse(/** @type {ResponseFile | undefined} */ from) {
  player.response = from && await cut(from);
  state.responseFile = from;
  $("response-text").textContent = from ? textOf(from) : "";
  $("response-off").hidden = $("response-level").hidden = !from;
  await player.choose($("bass").value);
}

$("response").onclick = () => $("response-file").click();
$("response-off").onclick = () => takeResponse(undefined).catch(() => {});
$("response-level").onclick = () => {
  setPressed($("response-level"), !isPressed($("response-level")));
  if (state.responseFile) takeResponse(state.responseFile).catch(() => {});
};
$("response-file").onchange = async () => {
  const [file] = $("response-file").files || [];
  $("response-file").value = ""; // the same file may be chosen again
  if (!file || !player.ready) return;
  await busy($("response"), readResponse(file).then(takeResponse))
    .catch(error => { $("response-text").textContent = `${file.name}: ${error.message}`; });
};
