// Replays the last note slowly: its motion, repeated from its string's events. After a change on the bench the same
// pluck is repeated on the changed bass, too, beside the note that was played.
import {bench} from "../bench/benchview.js";
import {contactsOf, doneBy, tell} from "./line.js";
import {$, PAGE, busy, chosenBass, say} from "../pages/page.js";
import {player} from "../audio/player.js";
import {SHOWN} from "./see.js";
import {hearBy, hush} from "../audio/sounds.js";
import {state} from "../pages/state.js";
import {see} from "./view.js";
import {workshop} from "../audio/workshop.js";

export const HEARD = 1.5; // s of a motion's sound: two are compared soon
export const RINGS = 4; // s of the sound of a string that a hand let go
const SAID_EVERY = 100; // ms between the moments that a rolling replay says
/** @type {{note?: KeptNote, replay?: Replay}} */
export const kept = {}; // the last note, with the bass that played it, and its replay

// Keeps a note while its bass is still there: its string's events and the bass's file.
async function keep(/** @type {SeenNote} */ {string, of}) {
  const made = of === undefined ? undefined : player.basses.get(of);
  if (!made || of === undefined) return;
  const recalled = await player.recall(string, of);
  if (made.name === chosenBass().name) kept.note = {...made, recalled};
}

// Keeps a pull, with its replay, as the last note.
export function keepPull(/** @type {KeptNote} */ note, /** @type {Replay} */ replay) { Object.assign(kept, {note, replay}); }

// What the worker repeats of a note.
const repeated = (/** @type {KeptNote} */ {recalled, pulled}) => pulled ? {pulled} : {recalled};

export function forget() { kept.note = undefined; }

/**
 * Has the worker make a motion and its sound.
 * @param {object} what
 * @param {ArrayBuffer} file
 * @param {number} seconds of its sound
 * @returns {Promise<Motion>}
 */
export function move(what, file, seconds = HEARD) {
  const rate = player.context.sampleRate, copy = file.slice(0);
  const [before, frames, length] = [SHOWN.before, SHOWN.after, seconds].map(time => Math.round(time * rate));
  return workshop.ask({tier: PAGE.tier, rate, before, frames, heard: length, ...what, file: copy}, [copy]);
}

// The last note, or undefined with a word why.
function lastNote() {
  if (kept.note && !kept.note.recalled && !kept.note.pulled)
    say("This string has rung through too many notes to repeat the last one. Let it fall silent, then play.");
  return kept.note?.recalled || kept.note?.pulled ? kept.note : undefined;
}

async function showAgain() {
  if (see.replay) {
    restart();
    return;
  }
  const note = lastNote();
  if (note) kept.replay = showSlowly(await move({...repeated(note), response: note.response}, note.file));
}

// Shows the same pluck on the bass as it is now, with the note that was played beside it; returns both sounds.
async function showSame() {
  const note = lastNote();
  if (!note) return [];
  const what = repeated(note), file = await player.fileOf(note.name);
  await player.sound();
  const before = await move({...what, response: note.response}, note.file);
  const now = await move({...what, response: player.response, changed: true}, file);
  showSlowly(now, {...before, heights: note.heights[before.string]});
  const [old, fresh] = [see.other, see.replay].map(replay => replay ? doneBy(replay) : contactsOf(0));
  tell(`The same pluck, in its first ${SHOWN.after} s: ${old} before, ${fresh} now.`);
  return [before.sound, now.sound];
}

// Shows a motion from the worker slowly, once, from its beginning; `other` beside it. Returns the replay.
export function showSlowly(/** @type {Motion} */ made, /** @type {Motion | undefined} */ other = undefined) {
  see.rate = player.context.sampleRate;
  const replay = see.show(made, other);
  Object.assign($("moment"), {max: replay.length - 1, disabled: false});
  $("legend").hidden = !other;
  setButtons(true);
  state.repeats = false;
  restart();
  return replay;
}

// Starts the replay from its beginning.
function restart() {
  goTo(0);
  state.rolling = true;
  state.lastLook = performance.now();
}

function setButtons(/** @type {boolean} */ on) {
  $("moment").disabled = $("picture").disabled = $("clip").disabled = !on;
  $("now").hidden = !on;
}

// Advances by the time since the last picture, at the chosen speed; stops at the end.
export function goOn(/** @type {number} */ now) {
  if (state.rolling && see.replay) {
    see.goTo(see.replay.at + (now - state.lastLook) / 1000 * player.context.sampleRate / slowness(), slowness());
    state.rolling = see.replay.at < see.replay.length - 1;
    if (!state.rolling && state.repeats) restart();
    if (!state.rolling || now - state.lastSaid >= SAID_EVERY) sayMoment();
  }
  state.lastLook = now;
}

// Goes to a frame of the replay; returns the contacts on the way.
export function goTo(/** @type {number} */ frame) {
  const met = see.goTo(frame, slowness());
  sayMoment();
  return met;
}

export const slowness = () => Math.round(10 ** +$("slow").value);

// Says the shown moment. A browser lays the page out again each time, which takes as long as the picture.
function sayMoment() {
  state.lastSaid = performance.now();
  if (see.replay) $("moment").value = String(see.replay.at);
  const text = `${see.moment.toFixed(2)} ms`;
  $("moment-text").textContent = text;
  $("moment").ariaValueText = `${text} after the release`;
}

function saySlowness() { $("slow-text").textContent = slowness() === 1 ? "as it was" : `1/${slowness()}`; }

export function backToNow() {
  state.rolling = state.repeats = false;
  see.leave();
  setButtons(false);
  $("legend").hidden = true;
  $("moment-text").textContent = "";
}

// Shows which buttons can do something. It writes only changes: a browser computes its styles again after each write.
export function showButtons() {
  const idle = !player.ready || (!kept.note && !see.replay), again = $("again"), same = $("same");
  const alike = !kept.note || !bench() || kept.note.label === player.labelOf(kept.note.name);
  if (again.disabled !== idle) again.disabled = idle;
  if (same.hidden !== alike) same.hidden = alike;
}

const failed = (/** @type {Error} */ error) => say(`The note cannot be repeated: ${error.message}`);
$("again").onclick = () => busy($("again"), showAgain()).catch(failed);
$("same").onclick = () => hearBy($("same"), showSame).catch(failed);

// Plays the same pluck on the bass as it is now; what is heard ends.
export function playSame() {
  hush();
  return hearBy($("same"), showSame);
}

$("now").onclick = backToNow;
$("slow").oninput = saySlowness;
$("moment").oninput = () => {
  state.rolling = false;
  goTo(+$("moment").value);
};
player.on("kept", keep);
player.on("struck", () => { if (see.replay && !state.rolls) backToNow(); });
saySlowness();
