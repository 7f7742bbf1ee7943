// Recorded, computed: a note of a real bass, and the same note of a preset; one spectrum over the other, and both can be
// heard.
import {read} from "./files.js";
import {$, PAGE, say, setPressed} from "./page.js";
import {imageOf, player} from "../audio/player.js";
import {move} from "../neck/replay.js";
import {hearBy} from "../audio/sounds.js";
import {pictures, see} from "../neck/view.js";

const WINDOW = 32768; // frames of a spectrum, from the attack on
const LOUDNESS = 0.07; // rms that both notes get over these frames
/** @type {{sounds?: Promise<Float32Array<ArrayBuffer>[]>}} */
const made = {}; // recorded, computed

// A sound as loud as the other one, from its attack on.
function levelled(/** @type {Float32Array<ArrayBuffer>} */ sound) {
  const maximum = sound.reduce((maximum, x) => Math.max(maximum, Math.abs(x)), 0);
  const from = sound.subarray(sound.findIndex(x => Math.abs(x) > maximum / 10));
  const square = from.subarray(0, WINDOW).reduce((sum, x) => sum + x * x, 0) / WINDOW;
  return from.map(x => x * LOUDNESS / Math.sqrt(square));
}

// The levels (dB) of a sound's first frames, as an analyser gives them.
async function spectrumOf(/** @type {Float32Array<ArrayBuffer>} */ sound) {
  const context = new OfflineAudioContext(1, WINDOW, player.context.sampleRate);
  const buffer = new AudioBuffer({length: sound.length, sampleRate: context.sampleRate});
  buffer.copyToChannel(sound, 0);
  const source = new AudioBufferSourceNode(context, {buffer});
  const analyser = new AnalyserNode(context, {fftSize: WINDOW, smoothingTimeConstant: 0});
  source.connect(analyser).connect(context.destination);
  source.start();
  await context.startRendering();
  const levels = new Float32Array(analyser.frequencyBinCount);
  analyser.getFloatFrequencyData(levels);
  return levels;
}

// Reads the recording, has the worker compute the note, and draws both.
async function makeBoth(/** @type {RecordedNote} */ {bass, string, note, velocity}) {
  const {context} = player, sound = (await context.decodeAudioData(await read("recorded/note.flac"))).getChannelData(0);
  const computed = await move({performed: {string, note, velocity}, heard: sound.length}, (await imageOf(bass)).file);
  const both = [sound, computed.sound].map(levelled);
  pictures.both = await Promise.all(both.map(spectrumOf));
  see.needed = true;
  return both;
}

// Makes the two notes, if they are not there.
async function both(/** @type {RecordedNote} */ note) {
  await player.sound();
  made.sounds ||= makeBoth(note);
  return made.sounds;
}

if (PAGE.recorded) {
  const note = PAGE.recorded;
  const plays = (/** @type {HTMLButtonElement} */ button, /** @type {number[]} */ which) => {
    setPressed(button, false);
    button.onclick = () => {
      $("recorded").hidden = false;
      $("recorded").scrollIntoView({block: "nearest"});
      hearBy(button, async () => {
        const sounds = await both(note);
        return which.map(k => sounds[k]);
      }).catch(error => {
        made.sounds = undefined;
        say(`The notes cannot be compared: ${error.message}`);
      });
    };
  };
  $("recorded-text").textContent = note.says;
  plays(/** @type {HTMLButtonElement} */ ($("real")), [0, 1]);
  plays($("hear-recorded"), [0]);
  plays($("hear-computed"), [1]);
}
