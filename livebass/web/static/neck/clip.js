// Saves the replay as a picture, or as a clip: the note at speed, then slowly, with a tick for each contact.
import {$, ADDRESS, busy, chosenBass, make, save, say} from "../pages/page.js";
import {player} from "../audio/player.js";
import {noteText} from "./places.js";
import {HEARD, goTo, slowness} from "./replay.js";
import {hear, hush, tick} from "../audio/sounds.js";
import {state} from "../pages/state.js";
import {pictures, see} from "./view.js";

const POSTER = {width: 1600, height: 1000}; // px
// Kinds of video, the first that a browser records: phones and messengers take H.264 in MP4. Without codecs some browsers
// put VP9 into MP4, which few programs open
const KINDS = ["video/mp4;codecs=avc1.42E01E,mp4a.40.2", "video/mp4;codecs=avc1,mp4a.40.2", "video/mp4;codecs=avc1,opus", "video/webm", "video/mp4"];
const CLIP = {rate: 30, shortest: 3, longest: 12}; // pictures a second; s of the slow part

function titleOf() {
  const {string, fret = 0} = see.note, bass = chosenBass();
  return `${bass.title}, ${noteText(bass, string, fret)}, ${see.moment.toFixed(2)} ms after the release`;
}

// The line at a poster's foot: what it shows, and where it comes from.
function footOf() {
  const marks = see.other ? "Bright: the changed bass. Blue: the same pluck before. " : "";
  const shows = `Above, from the front, motion magnified ${pictures.magnified} times; below, from the side, and the hits`;
  return `${marks}${shows} by time. Computed by livebass, not recorded. ${ADDRESS}`.trimEnd();
}

const fileName = (/** @type {string} */ ending) => `livebass-${$("bass").value}-${see.moment.toFixed(1)}ms.${ending}`;

function savePicture() {
  const sheet = make("canvas", POSTER);
  pictures.poster(sheet, titleOf(), footOf());
  sheet.toBlob(blob => { if (blob) save(blob, fileName("png")); });
}

// Calls draw(part) for `seconds`, with the part of the time that has passed, once a picture.
async function during(/** @type {number} */ seconds, /** @type {(part: number) => void} */ draw) {
  const began = performance.now();
  for (let part = 0; part < 1 && see.replay;) {
    part = Math.min(1, (performance.now() - began) / 1000 / seconds);
    draw(part);
    await new Promise(done => setTimeout(done, 1000 / CLIP.rate));
  }
}

async function saveClip() {
  const {replay} = see, sheet = make("canvas", POSTER);
  const kind = KINDS.find(type => MediaRecorder.isTypeSupported(type));
  if (!replay || !kind) throw new Error("the browser records no video");
  await player.sound();
  const {context} = player, sound = context.createMediaStreamDestination();
  const silence = new ConstantSourceNode(context, {offset: 0}); // without it recorders leave silent parts out
  silence.connect(sound);
  silence.start();
  const tracks = [...sheet.captureStream(CLIP.rate).getTracks(), ...sound.stream.getTracks()];
  const recorder = new MediaRecorder(new MediaStream(tracks), {mimeType: kind, videoBitsPerSecond: 6e6});
  /** @type {Blob[]} */
  const parts = [];
  recorder.ondataavailable = ({data}) => parts.push(data);
  const ended = new Promise(done => { recorder.onstop = done; });
  const slow = Math.min(CLIP.longest, Math.max(CLIP.shortest, replay.length / context.sampleRate * slowness()));
  state.rolling = false;
  $("clip").disabled = true;
  const show = (/** @type {number} */ frame) => {
    const met = goTo(frame);
    pictures.poster(sheet, titleOf(), footOf());
    return met;
  };
  show(0);
  recorder.start();
  const heard = hear([replay.sound.slice(0, HEARD * context.sampleRate)], sound);
  await during(heard, part => show(part * heard * context.sampleRate));
  hush();
  await during(slow, part => { for (const hit of show(part * (replay.length - 1))) tick(hit, sound); });
  recorder.stop();
  silence.stop();
  await ended;
  if (!see.replay) return;
  $("clip").disabled = false;
  if (!parts.some(part => part.size)) throw new Error("this machine is too slow");
  const [type] = kind.split(";");
  save(new Blob(parts, {type}), fileName(type.slice(6)));
}

$("picture").onclick = savePicture;
$("clip").onclick = () => busy($("clip"), saveClip()).catch(error => say(`The clip cannot be recorded: ${error.message}`));
$("clip").hidden = !window.MediaRecorder || !HTMLCanvasElement.prototype.captureStream;
