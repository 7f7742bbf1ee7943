// The chosen bass: the whole page shows it, and the audio thread plays it.
import {$, bassCalled, chosenBass, saved} from "../pages/page.js";
import {bench, keepLink, showBench} from "./benchview.js";
import {sayOwn} from "./controls.js";
import {letGo} from "../neck/hands.js";
import {layOut, showNeck} from "../neck/neck.js";
import {player} from "../audio/player.js";
import {backToNow, forget} from "../neck/replay.js";
import {putPart, showParts} from "../score/songs.js";
import {takeOwnStroke} from "../neck/techniques.js";
import {see} from "../neck/view.js";

export function showBass() {
  forget();
  if (see.replay) backToNow();
  const bass = chosenBass();
  $("about").textContent = bass.about;
  sayOwn();
  takeOwnStroke(bass);
  see.setBass(bass);
  showNeck();
  layOut();
  showBench();
}

// Chooses the bass that was chosen before a reload.
export function showSavedBass() {
  const name = saved.get("bass");
  if (name && bassCalled(name)) $("bass").value = name;
  showBass();
}

$("bass").onchange = () => {
  letGo();
  showBass();
  showParts();
  putPart();
  keepLink();
  saved.set("bass", bench() ? "" : $("bass").value); // others are in the address
  player.choose($("bass").value);
};
