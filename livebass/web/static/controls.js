// Sliders, one per parameter; its usual value changes nothing on the bass.
import {$, PAGE, chosenBass} from "./page.js";
import {player} from "./player.js";

/** @type {Record<ControlName, (value: number) => string>} */
const TEXTS = {
  gain: value => value > PAGE.parameters.gain.least ? `${value} dB` : "silent",
  tone: value => value < 0 ? "darker" : value > 0 ? "brighter" : "its own",
  pluck_position: value => value < 0 ? "to the bridge" : value > 0 ? "to the neck" : "its own",
  compression: value => knobText("compression", value),
  drive: value => knobText("drive", value),
};
export const CONTROLS = /** @type {ControlName[]} */ (Object.keys(TEXTS));

// An effect's strength; a knob at 0 keeps the bass's own.
function knobText(/** @type {string} */ symbol, /** @type {number} */ value) {
  const all = value || chosenBass()?.effects[symbol];
  return all ? `${Math.round(100 * all)} %` : "off";
}

function tellParameter(/** @type {ControlName} */ symbol) {
  const {number, effect} = PAGE.parameters[symbol], value = +$(symbol).value;
  player.change(effect < 0 ? {parameter: [number, value]} : {effect: [effect, value]});
}

function sayControl(/** @type {ControlName} */ symbol) {
  $(symbol).ariaValueText = $(`${symbol}-text`).textContent = TEXTS[symbol](+$(symbol).value);
}

// Shows the strength of the chosen bass's effects.
export function sayEffects() {
  sayControl("compression");
  sayControl("drive");
}

// Moves a slider and tells the bass.
export function moveControl(/** @type {ControlName} */ symbol, /** @type {number} */ value) {
  $(symbol).value = String(value);
  sayControl(symbol);
  tellParameter(symbol);
}

// Moves a slider to the value that a controller gave its parameter.
export function showControl(/** @type {ControlName} */ symbol, /** @type {number} */ value) {
  const slider = $(symbol), within = Math.min(+slider.max, Math.max(+slider.min, value));
  if (Math.abs(within - +slider.value) <= +slider.step / 2 + 1e-9) return;
  slider.value = String(within);
  sayControl(symbol);
}

for (const symbol of CONTROLS) {
  const {least, most, usual, unit} = PAGE.parameters[symbol], slider = $(symbol);
  Object.assign(slider, {min: least, max: most, step: unit ? 1 : 0.01, value: usual});
  slider.oninput = () => moveControl(symbol, +slider.value);
  slider.ondblclick = () => moveControl(symbol, usual);
  sayControl(symbol);
}
player.on("started", () => CONTROLS.forEach(tellParameter));
