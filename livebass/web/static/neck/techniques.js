// The playing techniques: strokes and ways to play, each a button.
import {$, PAGE, chosenBass, make, setPressed} from "../pages/page.js";
import {showControl} from "../bench/controls.js";
import {player} from "../audio/player.js";
import {state} from "../pages/state.js";

export const LONG_PRESS = 400; // ms

// Strokes, by key switches
export const STROKES = PAGE.buttons.filter(button => button.strikes)
  .map((stroke, k) => ({...stroke, button: chip("strokes", stroke.name, k + 1)}));
// Ways to play, each set by a controller's value or a held key switch, as in MIDI. A way is on while it is latched, or
// held by a finger or a key; `sent` is its state in the bass.
/** @type {Way[]} */
export const WAYS = PAGE.buttons.filter(button => !button.strikes).map((way, k) => ({
  ...way, button: chip("ways", way.name, (k + STROKES.length + 1) % 10), holds: new Set(), latched: false, sent: false,
}));

/** @param {"strokes" | "ways"} place @param {string} name @param {number} digit */
function chip(place, name, digit) {
  const button = make("button", {type: "button"}, name, " ", make("small", {textContent: digit}));
  button.setAttribute("aria-label", `${name}, key ${digit}`);
  setPressed(button, false);
  $(place).append(button);
  return button;
}

export const isOn = (/** @type {Way} */ way) => way.latched || way.holds.size > 0;

// The number of a technique's controller, or else of its key; undefined if the bass's key map has none.
export function numberOf(/** @type {PlayButton} */ {symbol, value}) {
  const {keys, controllers} = chosenBass();
  return value ? controllers[symbol] : keys[symbol];
}

// --- ways ---

// Tells the bass whether a way is on, if that has changed and the bass can take it.
function tellWay(/** @type {Way} */ way) {
  const on = isOn(way), number = numberOf(way);
  if (on === way.sent || !player.sounding || number === undefined) return;
  if (way.everywhere) player.changeEverywhere([number, on ? way.value : 0]);
  else player.changeBy(way.value ? [0xb0, number, on ? way.value : 0] : [on ? 0x90 : 0x80, number, 64]);
  way.sent = on;
}

function showWay(/** @type {Way} */ way) {
  setPressed(way.button, isOn(way));
  tellWay(way);
}

function latch(/** @type {Way} */ way, /** @type {boolean} */ on) {
  way.latched = on;
  showWay(way);
}

export function hold(/** @type {Way} */ way, /** @type {string} */ id) {
  way.holds.add(id);
  showWay(way);
}

export function letGoOf(/** @type {string} */ id) {
  for (const way of WAYS) if (way.holds.delete(id)) showWay(way);
}

export function letGoOfAll() {
  for (const way of WAYS) for (const id of [...way.holds]) letGoOf(id);
}

export function unlatchAll() { for (const way of WAYS) latch(way, false); }

// Ends all sound, and resets all controllers.
export function panic() {
  player.change({panic: true});
  for (const way of WAYS) way.sent &&= !way.value;
}

// --- strokes ---

function showStroke(/** @type {Stroke | undefined} */ chosen) {
  state.stroke = chosen;
  for (const one of STROKES) setPressed(one.button, one === chosen);
}

function tellStroke() {
  const number = state.stroke && numberOf(state.stroke);
  if (!player.sounding || number === undefined) return;
  for (const status of [0x90, 0x80]) player.changeBy([status, number, 64]);
  state.sentStroke = state.stroke;
}

export function pluckWith(/** @type {Stroke} */ chosen) {
  showStroke(chosen);
  tellStroke();
}

const strokeOf = (/** @type {string | undefined} */ symbol) => STROKES.find(one => one.symbol === symbol);

// A bass begins with its own stroke.
export function takeOwnStroke(/** @type {Bass} */ bass) {
  showStroke(strokeOf(bass.stroke));
  state.sentStroke = state.stroke;
  player.change({parameter: [...PAGE.parameters.technique.event, 0]});
  for (const one of [...STROKES, ...WAYS]) one.button.disabled = numberOf(one) === undefined;
}

// Takes stroke and ways from the values of a plugin's parameters.
export function takePlayed(/** @type {Record<string, number>} */ played) {
  const chosen = STROKES.find(({stroke}) => stroke === played.technique);
  if (chosen) pluckWith(chosen);
  for (const way of WAYS) if (way.symbol in played) latch(way, played[way.symbol] > 0);
}

// Shows the present playing, set by the page or by key switches and controllers from MIDI.
function showPlaying(/** @type {Playing} */ {on, pluckedWith, values}) {
  for (const way of WAYS) {
    const now = on[way.symbol];
    if (now === way.sent) continue;
    way.sent = way.latched = now;
    if (!now) way.holds.clear();
    showWay(way);
  }
  const found = strokeOf(pluckedWith);
  if (found !== state.sentStroke) {
    state.sentStroke = found;
    showStroke(found);
  }
  for (const [symbol, value] of Object.entries(values)) showControl(/** @type {ControlName} */ (symbol), value);
}

// --- the buttons ---

for (const stroke of STROKES) stroke.button.onclick = () => pluckWith(stroke);
for (const way of WAYS) {
  const {button} = way;
  /** @type {number | undefined} */
  let since; // ms, when the press began
  let before = false; // it was on
  button.onpointerdown = e => {
    if (e.button) return;
    [since, before] = [e.timeStamp, way.latched];
    latch(way, true);
  };
  // The end of a press, anywhere: switches off a way that was on, or was held long.
  button.onpointerup = button.onpointerleave = e => {
    if (since === undefined) return;
    if (before || e.timeStamp - since >= LONG_PRESS) latch(way, false);
    since = undefined;
  };
  button.onpointercancel = () => { // it was the beginning of a scroll
    if (since !== undefined) latch(way, before);
    since = undefined;
  };
  button.onclick = e => { if (!e.detail) latch(way, !way.latched); }; // by Enter, or by a screen reader
  button.oncontextmenu = e => e.preventDefault();
}

player.on("sounds", () => { // tells the choices made while nothing sounded
  WAYS.forEach(tellWay);
  if (state.stroke !== state.sentStroke) tellStroke();
});
player.on("silent", panic);
player.on("playing", showPlaying);
