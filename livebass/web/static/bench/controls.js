// Sliders and switches, one per parameter of the playing; its default value changes nothing on the bass.
import {$, PAGE, chosenBass} from "../pages/page.js";
import {player} from "../audio/player.js";

/** @type {Record<ControlName, (value: number) => string>} */
const TEXTS = {
  gain: value => value > PAGE.parameters.gain.minimum ? `${value} dB` : "silent",
  tone: value => value < 0 ? "darker" : value > 0 ? "brighter" : "its own",
  blend: value => value < 0 ? "to the neck" : value > 0 ? "to the bridge" : "its own",
  pluck_position: value => value < 0 ? "to the bridge" : value > 0 ? "to the neck" : "its own",
  velocity_curve: value => value < 0 ? "softer touch" : value > 0 ? "harder touch" : "its own",
  hand_position: value => value ? `fret ${(chosenBass()?.capo || 0) + value}` : "free",
  avoid_open: value => value ? "yes" : "no",
  humanise_time: value => value ? `up to ${value} ms late` : "off",
  humanise_force: value => value ? `by up to ${value} dB` : "off",
  compression: value => knobText("compression", value),
  drive: value => knobText("drive", value),
  clean_blend: value => knobText("clean_blend", value),
  eq_bass: value => bandText("eq_bass", value),
  eq_low_mid: value => bandText("eq_low_mid", value),
  eq_low_mid_frequency: value => choiceText("eq_low_mid_frequency", value),
  eq_high_mid: value => bandText("eq_high_mid", value),
  eq_high_mid_frequency: value => choiceText("eq_high_mid_frequency", value),
  eq_treble: value => bandText("eq_treble", value),
  cabinet: value => choiceText("cabinet", value),
  limiter: value => choiceText("limiter", value),
};
export const CONTROLS = /** @type {ControlName[]} */ (Object.keys(TEXTS));
const EFFECTS = CONTROLS.slice(CONTROLS.indexOf("compression"));

// An effect's strength; a knob at 0 keeps the bass's own.
function knobText(/** @type {string} */ symbol, /** @type {number} */ value) {
  const all = value || Number(chosenBass()?.effects[symbol] || 0);
  return all ? `${Math.round(100 * all)} %` : "off";
}

// A band of the equaliser.
function bandText(/** @type {string} */ symbol, /** @type {number} */ value) {
  const all = value || Number(chosenBass()?.effects[symbol] || 0);
  return all ? `${all > 0 ? "+" : ""}${all} dB` : "flat";
}

// A choice by name; the first one is the bass's own.
function choiceText(/** @type {string} */ symbol, /** @type {number} */ value) {
  const own = chosenBass()?.effects[symbol];
  return value || own === undefined ? PAGE.parameters[symbol].points[value] : typeof own === "number" ? `${own} Hz` : own;
}

const isSwitch = (/** @type {ControlName} */ symbol) => $(symbol).type === "checkbox";
const valueOf = (/** @type {ControlName} */ symbol) => isSwitch(symbol) ? Number($(symbol).checked) : +$(symbol).value;

function show(/** @type {ControlName} */ symbol, /** @type {number} */ value) {
  if (isSwitch(symbol)) $(symbol).checked = value > 0.5;
  else $(symbol).value = String(value);
  sayControl(symbol);
}

function tellParameter(/** @type {ControlName} */ symbol) {
  player.change({parameter: [...PAGE.parameters[symbol].event, valueOf(symbol)]});
}

function sayControl(/** @type {ControlName} */ symbol) {
  const text = $(`${symbol}-text`).textContent = TEXTS[symbol](valueOf(symbol));
  if (!isSwitch(symbol)) $(symbol).ariaValueText = text;
}

// Shows what depends on the chosen bass: the strength of its effects, its frets, and a blend if a string has two pickups.
export function sayOwn() {
  const {strings, pickups, frets} = chosenBass(), {maximum} = PAGE.parameters.hand_position, hand = $("hand_position"), over = (/** @type {number} */ i) => pickups.filter(pickup => pickup.strings.includes(i));
  EFFECTS.forEach(sayControl);
  if (+hand.value > frets) moveControl("hand_position", frets);
  else sayControl("hand_position");
  hand.max = String(Math.min(maximum, frets));
  /** @type {HTMLElement} */ ($("blend").parentElement).hidden = !strings.some((_, i) => over(i).length > 1);
}

// Moves a control and tells the bass.
export function moveControl(/** @type {ControlName} */ symbol, /** @type {number} */ value) {
  show(symbol, value);
  tellParameter(symbol);
}

// Moves a slider to the value that a controller gave its parameter.
export function showControl(/** @type {ControlName} */ symbol, /** @type {number} */ value) {
  const slider = $(symbol), within = Math.min(+slider.max, Math.max(+slider.min, value));
  if (Math.abs(within - +slider.value) > +slider.step / 2 + 1e-9) show(symbol, within);
}

// The values that change something on the bass, by symbol, as links and presets have them.
export function movedControls() {
  const moved = CONTROLS.filter(symbol => valueOf(symbol) !== PAGE.parameters[symbol].defaultValue);
  return Object.fromEntries(moved.map(symbol => [symbol, valueOf(symbol)]));
}

for (const symbol of CONTROLS) {
  const {minimum, maximum, defaultValue, unit, whole} = PAGE.parameters[symbol], slider = $(symbol);
  if (!isSwitch(symbol)) Object.assign(slider, {min: minimum, max: maximum, step: whole || unit ? 1 : 0.01, value: defaultValue});
  slider.oninput = () => moveControl(symbol, valueOf(symbol));
  slider.ondblclick = () => { if (!isSwitch(symbol)) moveControl(symbol, defaultValue); };
  sayControl(symbol);
}
player.on("started", () => CONTROLS.forEach(tellParameter));
