// Replays the last note: its motion, repeated from its string's events, shown slowly and saved as a picture or a clip.
import {$, PAGE, chosenBass, make, save, say} from "./page.js";
import {player} from "./player.js";
import {state} from "./state.js";
import {enlarge, see} from "./view.js";
import {workshop} from "./workshop.js";

export const BEFORE = 0.005; // s shown before the release ...
export const AFTER = 0.1; // ... and after it
const POSTER = {width: 1600, height: 1000}; // px
const CLIP = {rate: 30, shortest: 3, longest: 12}; // pictures a second; s

// Asks the audio thread for the string's events; the worker repeats the motion from them.
async function showAgain() {
  const {recalled, bass} = await player.recall(see.note.string);
  if (!recalled) {
    say("That string's motion cannot be made again: play it from rest.");
    return;
  }
  const {file, response} = /** @type {{file: ArrayBuffer, response?: Float64Array}} */ (player.basses.get(bass));
  const rate = player.context.sampleRate, copy = file.slice(0);
  const how = {tier: PAGE.tier, rate, response, before: Math.round(BEFORE * rate), frames: Math.round(AFTER * rate)};
  showSlowly(await workshop.ask({recalled, file: copy, ...how}, [copy, recalled.told]));
}

// Shows a motion from the worker slowly, from its beginning.
export function showSlowly(/** @type {Motion} */ made) {
  if (!see.replay) state.usualZoom = see.zoom;
  const {length} = see.show(made);
  enlarge(Math.min(state.usualZoom, Math.max(1, Math.floor(see.mostZoom()))));
  Object.assign($("moment"), {max: length - 1, value: 0, disabled: false});
  setButtons(true);
  state.rolling = true;
  state.lastLook = performance.now();
  sayMoment();
}

function setButtons(/** @type {boolean} */ on) {
  $("moment").disabled = $("picture").disabled = $("clip").disabled = !on;
  $("now").hidden = !on;
}

// Advances by the time since the last picture, at the chosen speed; stops at the end.
export function goOn(/** @type {number} */ now) {
  if (state.rolling && see.replay) {
    const frames = (now - state.lastLook) / 1000 * player.context.sampleRate / slowness();
    goTo(see.replay.at + frames, now);
    state.rolling = see.replay.at < see.replay.length - 1;
    $("moment").value = String(see.replay.at);
    see.fade(now);
  }
  state.lastLook = now;
}

function goTo(/** @type {number} */ frame, /** @type {number} */ now) {
  see.goTo(frame, now);
  sayMoment();
}

const slowness = () => Math.round(10 ** +$("slow").value);

function sayMoment() {
  const text = `${see.moment.toFixed(2)} ms`;
  $("moment-text").textContent = text;
  $("moment").ariaValueText = `${text} after the release`;
}

function saySlowness() { $("slow-text").textContent = slowness() === 1 ? "as it was" : `1/${slowness()}`; }

export function backToNow() {
  state.rolling = false;
  see.leave();
  enlarge(state.usualZoom);
  setButtons(false);
  $("moment-text").textContent = "";
}

// --- a picture and a clip ---

function titleOf() {
  const {string, fret} = see.note, bass = chosenBass(), at = fret ? `, fret ${bass.capo + fret}` : "";
  const when = `${see.moment.toFixed(2)} ms after the release`;
  return `livebass: ${bass.title}, ${bass.strings[string].name} string${at}, ${when}, ${see.zoom} times enlarged`;
}

const fileName = (/** @type {string} */ ending) => `livebass-${$("bass").value}-${see.moment.toFixed(1)}ms.${ending}`;

function savePicture() {
  const sheet = make("canvas", POSTER);
  see.poster(sheet, titleOf());
  sheet.toBlob(blob => { if (blob) save(blob, fileName("png")); });
}

// Records the note from beginning to end, at the chosen speed or, if that would take too long, faster.
async function saveClip() {
  const {replay} = see, sheet = make("canvas", POSTER);
  const kind = ["video/mp4", "video/webm"].find(type => MediaRecorder.isTypeSupported(type));
  if (!replay || !kind) throw new Error("the browser records no video");
  const recorder = new MediaRecorder(sheet.captureStream(CLIP.rate), {mimeType: kind, videoBitsPerSecond: 6e6});
  /** @type {Blob[]} */
  const parts = [];
  recorder.ondataavailable = ({data}) => parts.push(data);
  const ended = new Promise(done => { recorder.onstop = done; });
  const wanted = replay.length / player.context.sampleRate * slowness();
  const seconds = Math.min(CLIP.longest, Math.max(CLIP.shortest, wanted));
  state.rolling = false;
  $("clip").disabled = true;
  recorder.start();
  const began = performance.now();
  for (let part = 0; part < 1 && see.replay;) {
    part = Math.min(1, (performance.now() - began) / 1000 / seconds);
    goTo(part * (replay.length - 1), performance.now());
    $("moment").value = String(see.replay.at);
    see.poster(sheet, titleOf());
    await new Promise(done => setTimeout(done, 1000 / CLIP.rate));
    see.fade(performance.now());
  }
  recorder.stop();
  await ended;
  if (!see.replay) return;
  $("clip").disabled = false;
  if (!parts.some(part => part.size)) throw new Error("this machine is too slow");
  save(new Blob(parts, {type: kind}), fileName(kind.slice(6)));
}

$("picture").onclick = savePicture;
$("clip").onclick = () => saveClip().catch(error => say(`The clip cannot be recorded: ${error.message}`));
$("clip").hidden = !window.MediaRecorder || !HTMLCanvasElement.prototype.captureStream;
$("again").onclick = () => showAgain().catch(error => say(`The note cannot be made again: ${error.message}`));
$("now").onclick = backToNow;
$("slow").oninput = saySlowness;
$("moment").oninput = () => {
  state.rolling = false;
  goTo(+$("moment").value, performance.now());
};
saySlowness();
