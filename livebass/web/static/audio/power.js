// The button that stops the sound; every note starts it.
import {$} from "../pages/page.js";
import {player} from "./player.js";

function showPower() { $("power").hidden = !player.sounding; }

player.on("sounds", showPower);
player.on("silent", showPower);
$("power").onclick = () => player.stop();
