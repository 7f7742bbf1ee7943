// The pictures: strings over the neck, the last string from the side, the last note, and the spectrum.
import {$, PAGE, makeButton, noteName, setPressed} from "../pages/page.js";
import {player} from "../audio/player.js";
import {Pictures} from "./pictures.js";
import {pitchOf} from "./pitch.js";
import {See} from "./see.js";

/** @typedef {"side" | "note" | "spectrum"} Picture */
/** @type {[Picture, string][]} */
const PICTURES = [["side", "Side"], ["note", "Last note"], ["spectrum", "Spectrum"]];

const canvases = {neck: $("strings"), side: $("side"), note: $("note"), spectrum: $("spectrum"), both: $("both")};
export const see = new See(PAGE.sight, note => player.emit("reported", note), note => player.emit("kept", note));
export const pictures = new Pictures(canvases, see);
player.on("started", () => { see.rate = player.context.sampleRate; });
player.on("sight", data => player.giveBack(see.take(data)));

// Draws what has changed.
export function draw() {
  pictures.draw(player.analyser);
  const text = `×${pictures.magnified}`;
  if ($("zoom-text").textContent !== text) $("zoom-text").textContent = text;
}

$("zoom").oninput = () => {
  pictures.zoom = +$("zoom").value;
  see.needed = true;
};
pictures.zoom = +$("zoom").value;

// Shows the sounding note and its error in cents.
export function showPitch(/** @type {AnalyserNode} */ analyser) {
  const sound = new Float32Array(analyser.fftSize);
  analyser.getFloatTimeDomainData(sound);
  const hertz = pitchOf(sound, analyser.context.sampleRate);
  see.needed = true;
  $("pitch").textContent = "";
  if (!hertz) return;
  const note = 69 + 12 * Math.log2(hertz / 440), nearest = Math.round(note), cents = Math.round(100 * (note - nearest));
  const off = `${cents < 0 ? "−" : "+"}${Math.abs(cents)} cents`;
  $("pitch").textContent = `${noteName(nearest)} ${off}, ${hertz.toFixed(1)} Hz`;
}

// Chooses the picture shown if there is no room for three.
export function choosePicture(/** @type {Picture} */ chosen) {
  for (const [id] of PICTURES) {
    $(`${id}-figure`).classList.toggle("chosen", id === chosen);
    setPressed(/** @type {Element} */ (tabs.querySelector(`[data-picture="${id}"]`)), id === chosen);
  }
  see.needed = true;
}

const tabs = /** @type {Element} */ (document.querySelector(".tabs"));
for (const [id, name] of PICTURES) {
  const tab = makeButton(name, {onclick: () => choosePicture(id)});
  tab.dataset.picture = id;
  tabs.append(tab);
}
choosePicture("side");
for (const query of ["(prefers-color-scheme: light)", "(forced-colors: active)"])
  matchMedia(query).addEventListener("change", () => { see.needed = true; });
