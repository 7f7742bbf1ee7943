// The page: joins its parts, starts them, and draws the strings' motion.
import {$, PAGE, say} from "./page.js";
import "../audio/power.js";
import "../audio/meters.js";
import "../neck/techniques.js";
import "../neck/hands.js";
import "../neck/keys.js";
import "../score/songs.js";
import "../audio/recording.js";
import "../audio/response.js";
import "../audio/midi.js";
import "../neck/clip.js";
import "../neck/pull.js";
import "./inside.js";
import "../bench/one.js";
import "../bench/fretmap.js";
import {showSavedBass} from "../bench/bass.js";
import {makeBench, takeLink} from "../bench/benchview.js";
import {chooseLinked, showLinked} from "./cases.js";
import {lacking, lackingSound} from "./files.js";
import {player} from "../audio/player.js";
import {openMoving} from "./opening.js";
import {goOn, showButtons} from "../neck/replay.js";
import {state} from "./state.js";
import {showLinkedMoment} from "./share.js";
import {showLinkedStory} from "./story.js";
import "./recorded.js";
import {draw, pictures, see, showPitch} from "../neck/view.js";
import {watch} from "./watch.js";

const PITCH_EVERY = 120; // ms
const RESTED = 20000; // ms after the page was opened
const FULL = 0.7; // load of the audio thread at which pictures are dropped, to leave the machine to the sound
const SHED = 100; // ms from one picture to the next then
const last = {pitch: 0, picture: 0}; // times of the last ones, ms

// Shows the sound heard now, at the screen's rate; draws nothing while nothing changes.
function look(/** @type {number} */ now) {
  requestAnimationFrame(look);
  const {analyser, sounding} = player;
  if (PAGE.watching) see.follow(state.watched, now);
  if (sounding) {
    player.giveBack(see.follow(player.heardFrame(), now));
    if (analyser && now - last.pitch > PITCH_EVERY) {
      last.pitch = now;
      showPitch(analyser);
    }
  }
  if (see.replay) goOn(now);
  else see.fade(now, pictures.still.matches);
  if (!sounding || state.late < FULL || now - last.picture >= SHED) {
    last.picture = now;
    draw();
  }
  showButtons();
}

// Has the page's files kept for use without a network: what it needs now, the rest once it has rested.
async function keepForLater() {
  await navigator.serviceWorker?.register("offline.js");
  const {active} = await navigator.serviceWorker.ready;
  setTimeout(() => active?.postMessage("keep"), RESTED);
}

function notice(/** @type {string} */ text) {
  $("lacks").textContent = text;
  $("lacks").hidden = false;
}

function begin() {
  if (!player.isMute) player.start().catch(() => {}); // reported where it happened
  if (!showLinked(requested) && !showLinkedStory() && !showLinkedMoment(requested)) openMoving();
}

const requested = location.hash; // taking it changes it
makeBench();
showSavedBass();
takeLink();
chooseLinked(requested);
if (PAGE.offline && isSecureContext) keepForLater().catch(() => {}); // it needs the network then
const lack = lacking(), mute = lackingSound();
if (PAGE.watching) {
  watch(PAGE.watching);
} else if (lack) {
  notice(lack);
} else {
  player.isMute = mute !== undefined;
  if (mute) notice(mute);
  player.load().then(begin, error => say(`The page cannot be opened: ${error.message}`, true));
}
requestAnimationFrame(look);
