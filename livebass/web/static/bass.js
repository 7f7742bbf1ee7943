// The chosen bass: the whole page shows it, and the audio thread plays it.
import {$, chosenBass} from "./page.js";
import {keepLink, showBench} from "./benchview.js";
import {sayEffects} from "./controls.js";
import {letGo} from "./hands.js";
import {layOut, showNeck} from "./neck.js";
import {player} from "./player.js";
import {backToNow, forget} from "./replay.js";
import {putPart, showParts} from "./songs.js";
import {takeOwnStroke} from "./techniques.js";
import {see} from "./view.js";

export function showBass() {
  forget();
  if (see.replay) backToNow();
  const bass = chosenBass();
  $("about").textContent = bass.about;
  sayEffects();
  takeOwnStroke(bass);
  see.setBass(bass);
  showNeck();
  layOut();
  showBench();
}

$("bass").onchange = () => {
  letGo();
  showBass();
  showParts();
  putPart();
  keepLink();
  player.choose($("bass").value);
};
