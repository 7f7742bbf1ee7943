// The button that starts and stops the sound.
import {$, bassCalled, say, setPressed} from "./page.js";
import {player} from "./player.js";

function showPower() {
  $("power").textContent = player.sounding ? "Stop" : "Start";
  setPressed($("power"), player.sounding);
  document.body.classList.toggle("sounding", player.sounding);
}

player.on("sounds", showPower);
player.on("silent", showPower);
player.on("stopped", () => say(""));
player.on("plays", name => say(`${bassCalled(name).title} plays.`));
$("power").onclick = () => { // errors are reported where they happen
  (player.sounding ? player.stop() : player.sound()).catch(() => {});
};
