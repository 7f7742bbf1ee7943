// The meters: level, load, dropouts, and the frets held down.
import {$, saved} from "../pages/page.js";
import {player} from "./player.js";
import {state} from "../pages/state.js";

const FLOOR = -60; // dB
const MANY = 5; // dropouts, from which the page offers to play later
const dropped = {before: 0, late: 0}; // dropouts before the sound began; reports of a thread that was late

// The dropouts heard so far, as the browser counts them; in others, the moments at which the audio thread was late.
function dropouts(/** @type {number} */ load) {
  dropped.late += Number(load > 1);
  return (player.context?.playbackStats?.underrunEvents ?? dropped.late) - dropped.before;
}

export function showMeters(/** @type {PlayReport} */ {load, peak, overload, faults, held}) {
  const level = Math.max(FLOOR, peak > 0 ? 20 * Math.log10(peak) : FLOOR), {style} = $("level");
  state.loud = Math.max(level, state.loud - 2);
  $("level").ariaValueNow = state.loud.toFixed(0);
  style.setProperty("--part", String((state.loud - FLOOR) / -FLOOR));
  $("level").classList.toggle("clipped", state.loud > 0);
  $("level-text").textContent = state.loud > FLOOR ? `${state.loud.toFixed(0)} dB` : "silent";
  state.late = Math.max(load, 0.85 * state.late);
  const busy = Math.min(1, state.late);
  $("load").ariaValueNow = (100 * busy).toFixed(0);
  $("load").style.setProperty("--part", String(busy));
  $("load-text").textContent = `${(100 * state.late).toFixed(0)} %`;
  const count = faults + dropouts(load), isOverloaded = overload > 0 || load > 1;
  $("overload").hidden = !isOverloaded;
  $("faults").textContent = isOverloaded || !count ? "" : count === 1 ? "1 dropout" : `${count} dropouts`;
  $("later").hidden = count < MANY || saved.get("latency") === "playback";
  $("neck").querySelectorAll(".on").forEach(cell => cell.classList.remove("on"));
  held.forEach((fret, string) => {
    if (fret >= 0) $("neck").querySelector(`button[data-string="${string}"][data-fret="${fret}"]`)?.classList.add("on");
  });
}

// Opens the page again with a long buffer.
$("later").onclick = () => {
  saved.set("latency", "playback");
  location.reload();
};
player.on("sounds", () => { dropped.before += dropouts(0); });
player.on("report", showMeters);
player.on("stopped", () => showMeters({load: 0, peak: 0, overload: 0, faults: 0, held: []}));
