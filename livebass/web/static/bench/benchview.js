// The bench on the page: its sliders and buttons. The worker builds the changed bass; it is heard from the
// next note on.
import {Bench, SLOTS, sameValues} from "./bench.js";
import {CONTROLS, moveControl, movedControls} from "./controls.js";
import {layOut, showNeck} from "../neck/neck.js";
import {$, PAGE, bassCalled, chooseBass, chosenBass, make, save, say, setPressed} from "../pages/page.js";
import {imageOf, player} from "../audio/player.js";
import {isUnplayable} from "../audio/workshop.js";
import {offerRiff} from "../score/riff.js";
import {takePlayed} from "../neck/techniques.js";
import {see} from "../neck/view.js";

const GROUPS = ["Neck", "Strings", "Pickups", "Hand"];
const HOLD_TO_RESET = 600; // ms
const LONGEST_COPY = 250; // ms that the next bass waits for the last one to reach the audio thread
const WIDE = "(min-width: 46.01rem) and (min-height: 26.01rem)"; // here the bench is open at first
export const PHONE = "(max-width: 46rem), (max-height: 26rem)"; // here it is not, and one of its sliders is in sight
export const shown = {also: () => {}}; // called when the sliders of another bass are there
export const PRESET = /\.toml$/i; // names of files for takePreset
export const benches = new Map(); // by the name of their bass
export const bench = () => benches.get($("bass").value);

// Makes the benches and everything that does not depend on the bass; opens the page's link.
export function makeBench() {
  for (const bass of PAGE.basses) if (bass.bench) benches.set(bass.name, new Bench(bass, PAGE));
  for (const slot of SLOTS) $(`slot-${slot}`).onclick = () => onBench(() => bench().choose(slot));
  $("undo").onclick = () => onBench(() => bench().undo());
  $("redo").onclick = () => onBench(() => bench().redo());
  $("reset").onclick = () => onBench(() => bench().reset());
  $("newer").onclick = () => onBench(() => { bench().revision = undefined; });
  $("open-preset").onclick = () => $("preset-file").click();
  $("preset-file").onchange = () => {
    const [file] = $("preset-file").files || [];
    $("preset-file").value = "";
    if (file) takePreset(file);
  };
  $("save").onclick = saveBench;
  $("skip").onclick = () => {
    $("bench-fold").open = true;
    /** @type {HTMLElement | null} */ ($("bench-controls").querySelector("input"))?.focus();
  };
  const wide = matchMedia(WIDE), embedded = document.body.classList.contains("embed");
  const fold = () => { $("bench-fold").open = wide.matches || embedded; };
  wide.addEventListener("change", fold); // for example, a phone is turned
  fold();
  addEventListener("hashchange", takeLink);
  player.labelOf = name => benches.get(name)?.link() ?? name;
  player.fileOf = changedImage;
}

// --- its sliders ---

// Shows the chosen bass's sliders.
export function showBench() {
  $("bench").hidden = !bench();
  $("one-row").replaceChildren();
  $("bench-controls").replaceChildren();
  if (!bench()) return;
  for (const group of GROUPS) {
    const rows = [...bench().controls.values()].filter(control => control.group === group);
    if (!rows.length) continue;
    $("bench-controls").append(make("fieldset", {}, make("legend", {textContent: group}), ...rows.map(makeSlider)));
  }
  shown.also();
  showValues();
}

// Makes a row of the bench: a slider with its name and value.
function makeSlider({symbol, name, help, minimum, maximum, step}) {
  const id = `bench-${symbol}`, slider = make("input", {type: "range", id, min: minimum, max: maximum, step});
  const label = make("label", {htmlFor: id, textContent: name}), value = make("output", {htmlFor: id});
  const row = make("div", {className: "control", title: help}, label, value, slider);
  slider.dataset.symbol = symbol;
  const reset = () => moveSlider(symbol, 0, true);
  slider.oninput = () => moveSlider(symbol, +slider.value, false);
  slider.onchange = () => onBench(() => bench().settle());
  slider.onkeydown = e => { if (e.key === "Delete" || e.key === "Backspace") reset(); };
  row.ondblclick = reset;
  let held;
  label.onpointerdown = () => { held = setTimeout(reset, HOLD_TO_RESET); };
  label.onpointerup = label.onpointerleave = label.onpointercancel = () => clearTimeout(held);
  label.oncontextmenu = e => e.preventDefault();
  return row;
}

// Passes a slider's value to the bench; `done`: a step of its own, else all is one step until the slider is released.
function moveSlider(symbol, value, done) {
  onBench(() => {
    bench().set(symbol, value);
    if (done) bench().settle();
  });
}

// A value as text: the slider's result on this bass, or else its change.
function benchText(symbol, value) {
  const {step, unit, ownUnit, points} = bench().controls.get(symbol), comes = bench().comesTo(symbol, value);
  if (points.length) return points[Math.round(value)];
  if (symbol === "fret" && !value) return "none";
  if (symbol === "fret_height" && !bench().value("fret")) return "choose a fret";
  const digits = Math.max(0, Math.ceil(-Math.log10(step) - 1e-9));
  if (comes === undefined) return `${unit && value > 0 ? "+" : ""}${value.toFixed(digits)} ${unit}`.trimEnd().replace("-", "−");
  const exact = unit === "%" ? Math.max(0, 2 - Math.floor(Math.log10(Math.abs(comes) || 1))) : digits;
  return `${comes.toFixed(exact)} ${ownUnit}`.trimEnd().replace("-", "−");
}

function showValues() {
  const b = bench(), count = Object.keys(b.values).length;
  for (const slider of /** @type {NodeListOf<HTMLInputElement>} */ ($("bench").querySelectorAll("input[data-symbol]"))) {
    const {symbol = ""} = slider.dataset, row = /** @type {HTMLElement} */ (slider.parentElement), value = b.value(symbol), changed = symbol in b.values;
    if (document.activeElement !== slider || Math.abs(+slider.value - value) > +slider.step / 2 + 1e-9) slider.value = String(value);
    row.classList.toggle("changed", changed);
    /** @type {HTMLElement} */ (row.querySelector("output")).textContent = benchText(symbol, value);
    slider.ariaValueText = benchText(symbol, value) + (changed ? `, the preset has ${benchText(symbol, 0)}` : "");
  }
  for (const slot of SLOTS) setPressed($(`slot-${slot}`), b.slot === slot);
  $("undo").disabled = !b.before.length;
  $("redo").disabled = !b.after.length;
  $("reset").disabled = !count;
  $("newer").hidden = b.revision === undefined;
  $("bench-count").textContent = count ? `${count} change${count === 1 ? "" : "s"}` : "";
}

// The bench's changes in words, such as ", Action 1.20 mm".
export function changesText() {
  const b = bench(), changed = b ? [...b.controls.values()].filter(({symbol}) => symbol in b.values) : [];
  return changed.map(({name, symbol}) => `, ${name} ${benchText(symbol, b.value(symbol))}`).join("");
}

// --- changes become sound ---

// Carries out a change on the bench, shows it, and starts building the new bass.
export function onBench(act) {
  const before = bench().link();
  act();
  showValues();
  if (bench().moving === undefined) keepLink();
  building.wanted ||= bench().link() !== before;
  buildWanted();
}

// A bass is being built; another one is wanted
export const building = {now: false, wanted: false};

// Builds the bench's bass and hands it over; of the wishes that come meanwhile, only the newest is built next.
async function buildWanted() {
  if (building.now || !player.ready) return;
  building.now = true;
  while (building.wanted) {
    building.wanted = false;
    await player.prepare($("bass").value).built.catch(() => {}); // reported in prepare()
    if (player.node) await Promise.race([player.put(), new Promise(done => setTimeout(done, LONGEST_COPY))]); // none is taken in a pause
  }
  building.now = false;
}

// The image of a bass, changed by its bench. A neck that cannot be played throws, after the bench went back to one that
// can; that one is built next.
async function changedImage(/** @type {string} */ name) {
  const own = benches.get(name);
  if (!own) return (await imageOf(name)).file;
  const {slot, values, file} = own, wanted = {...values};
  try {
    const made = await imageOf(name, file, own.moved());
    own.played[slot] = wanted;
    showChanged(own, made);
    return made.file;
  } catch (error) {
    if (isUnplayable(error)) await goBack(own, wanted, /** @type {Error} */ (error));
    throw error;
  }
}

// Moves a bench, whose values `wanted` have no playable neck, back to values that have, and says what stops it.
async function goBack(own, wanted, /** @type {Error} */ {message}) {
  const {bass, slot, file} = own, isWanted = () => own.slot === slot && sameValues(own.values, wanted);
  const found = await own.lastPlayable(wanted, values => imageOf(bass.name, file, own.moved(values)).then(() => true, () => false));
  if (!isWanted()) return; // somebody has moved it meanwhile
  own.stopAt(found);
  building.wanted = true;
  if (own === bench()) {
    showValues();
    keepLink();
    const {name} = found.symbol ? own.controls.get(found.symbol) : {name: ""};
    say(found.symbol ? `${name} stops at ${benchText(found.symbol, own.value(found.symbol))}: beyond it ${message}.`
      : `This neck cannot be played: ${message}. The bass is ${own.changed ? "as it was" : "the preset's"}.`);
  }
  setTimeout(buildWanted); // unless it is building already
}

// Moves a bass's crowns (m from the open strings) and pickups (m from the saddle) to their changed places.
function showChanged(own, {heights, rests, places}) {
  const {bass} = own, {strings, pickups} = bass;
  strings.forEach((string, i) => Object.assign(string, {heights: heights[i], rests: rests[i]}));
  see.needed = true;
  if (!places.some((place, k) => Math.abs(place - pickups[k].position) > 1e-9)) return;
  places.forEach((place, k) => { pickups[k].position = place; });
  if (bass !== chosenBass()) return;
  showNeck();
  layOut();
}

// --- links, files ---

// Chooses a bass and sets its bench.
export function chooseBench(name, values, revision = undefined) {
  chooseBass(name);
  onBench(() => {
    bench().revision = revision;
    bench().setAll(values);
  });
}

// Puts the bass, if it is not the page's first one, and its changes from the preset into the page's address: it is then
// there again after a reload.
export function keepLink() {
  const hash = bench()?.changed || bench()?.revision !== undefined || (bench() && chosenBass() !== PAGE.basses[0]) ? `#${bench().link()}` : "";
  if (hash !== location.hash) history.replaceState(null, "", hash || location.href.split("#")[0]);
}

// Takes bass and values from the page's address; an invalid link is reported and changes nothing.
export function takeLink() {
  const {hash} = location;
  try {
    if (/^#(case|story)=/.test(hash)) return; // cases.js and story.js do
    const {name, values, played, ignored = [], revision} = Bench.fromLink(hash, benches);
    if (!name || (name === $("bass").value && bench().link() === hash.slice(1))) return;
    ignored.push(...[...new URLSearchParams(location.search).keys()].filter(key => key !== "embed").map(key => key.slice(0, 40)));
    const reported = ["The bass is as the link says.", wasMade(hash, revision), ignored.length ? `Ignored: ${ignored.join(", ")}.` : ""];
    take(name, values, played, revision);
    if (!document.body.classList.contains("embed")) say(reported.filter(Boolean).join(" "));
    offerRiff(hash);
  } catch (error) {
    say(`${/** @type {Error} */ (error).message}. The bass is unchanged.`);
  }
}

// Whether a link was made on this very bass, in a sentence if not; a link may leave open where it was made.
function wasMade(/** @type {string} */ hash, /** @type {number | undefined} */ revision) {
  if (revision !== undefined) return "It has changed since, and plays as it did: Update takes the new one.";
  const requested = new URLSearchParams(hash.slice(1)), made = requested.get("made"), now = bassCalled(requested.get("like") || "")?.made;
  return made === null || made === now ? "" : "It was made on another version of this bass, and may sound different now.";
}

// Takes a bass, its slider values, and the parameters of the playing.
function take(name, values, played, revision = undefined) {
  chooseBench(name, values, revision);
  for (const symbol of CONTROLS) if (symbol in played) moveControl(symbol, played[symbol]);
  takePlayed(played);
}

// Opens a preset that this page or a plugin saved.
export async function takePreset(file) {
  try {
    const {name, values, played} = Bench.fromToml(await file.text(), benches);
    take(name, values, played);
    say(`The bass is as ${file.name} says.`);
  } catch (error) {
    say(`${file.name}: ${/** @type {Error} */ (error).message}. The bass is as it was.`);
  }
}

function saveBench() {
  const name = `${bench().bass.name}-bench.toml`;
  save(new Blob([bench().toml(movedControls())], {type: "application/toml"}), name);
  say(`Saved: livebass play -p ./${name} plays it.`);
}
