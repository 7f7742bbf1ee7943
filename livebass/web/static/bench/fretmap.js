// The fret map: what one pluck does at every string and fret of the bass on the bench, beside the map before it. The
// same as `livebass map`.
import {changesText} from "./benchview.js";
import {fretText, hitText, noteText} from "../neck/places.js";
import {$, PAGE, chosenBass, make, say} from "../pages/page.js";
import {player} from "../audio/player.js";
import {Workshop} from "../audio/workshop.js";

const FRETS = 6; // of one message to a worker, between two steps of the progress
const MOST = 4; // workers
const KEPT = 2; // maps beside each other
const FULL = 55; // % of the colour in the cell with most contacts: its text stays readable
/** @type {{title: string, bass: Bass, strings: FretRow[]}[]} */
const maps = [];
/** @type {Workshop[]} */
let team = []; // computes the newest map; empty: none is being computed

// The workers of a map: of half the browser's cores, as the sound comes first.
const newTeam = () => Array.from({length: Math.max(1, Math.min(MOST, navigator.hardwareConcurrency >> 1))}, () => new Workshop());

function endTeam() {
  for (const shop of team) shop.close();
  team = [];
}

/**
 * Computes the map of the chosen bass; undefined if it was stopped. `progress` gets the part done.
 * @param {(part: number) => void} progress
 * @returns {Promise<{title: string, bass: Bass, strings: FretRow[]} | undefined>}
 */
async function mapNeck(progress) {
  const bass = chosenBass(), {velocity, seconds, rate} = PAGE.map, title = `${bass.title}${changesText()}`;
  const shops = team = newTeam(), file = await player.fileOf(bass.name);
  const rests = bass.strings.map(string => ({...string.rests})); // as the bass has just been made
  const strings = bass.strings.map(({name}) => ({name, cells: /** @type {FretCell[]} */ ([])}));
  const firsts = Array.from({length: Math.ceil((bass.frets + 1) / FRETS)}, (_, k) => FRETS * k);
  const pieces = bass.strings.flatMap(({note}, string) => firsts.map(first => ({string, note, first}))), count = pieces.length;
  let done = 0;
  const help = async (/** @type {Workshop} */ shop) => {
    await shop.open(/** @type {WebAssembly.Module} */ (player.module));
    const given = [file.slice(0)]; // with the first message only: the worker keeps the bass
    for (let piece; team === shops && (piece = pieces.shift());) {
      const {string, note, first} = piece, [copy] = given;
      const frets = Array.from({length: Math.min(FRETS, bass.frets + 1 - first)}, (_, k) => first + k);
      const buzz = {string, open: note, frets, velocity, frames: Math.round(seconds * rate)};
      const found = await shop.ask({buzz, file: copy, tier: PAGE.tier, rate}, given.splice(0));
      if (team !== shops) return;
      frets.forEach((fret, k) => {
        const cell = {...found[k], last: found[k].last / rate, on: rests[string][fret] ?? fret};
        strings[string].cells[fret] = {...cell, title: cellTitle(bass, string, cell, fret)};
      });
      progress(++done / count);
    }
  };
  await Promise.all(shops.map(help));
  return team === shops ? {title, bass, strings} : undefined;
}

function cellText(/** @type {FretCell} */ {contacts, on}, /** @type {number} */ fret, /** @type {Bass} */ {capo}) {
  return on !== fret ? `→${capo + on}` : contacts ? String(contacts) : "·";
}

/** @param {Bass} bass @param {number} string @param {Omit<FretCell, "title">} cell @param {number} fret */
function cellTitle(bass, string, {contacts, hardest, last, on}, fret) {
  const where = noteText(bass, string, fret);
  if (on !== fret) return `${where}: frets out, it lies on ${fretText(bass, string, on)}`;
  if (!contacts) return `${where}: no contact`;
  return `${where}: ${contacts} contact${contacts === 1 ? "" : "s"}, hardest at ${hitText(bass, hardest || 0)}, the last after ${Math.round(1000 * last)} ms`;
}

// The tables, the newest first, in colours up to the most contacts of both.
function show() {
  const most = Math.max(1, ...maps.flatMap(({strings}) => strings.flatMap(({cells}) => cells.map(({contacts}) => contacts))));
  $("maps").replaceChildren(...maps.map(({title, bass, strings}) => {
    const head = make("tr", {}, make("th", {scope: "col", textContent: bass.fretless ? "semitone" : "fret"}));
    strings[0].cells.forEach((_, fret) => head.append(make("th", {scope: "col", textContent: fret ? bass.capo + fret : "open"})));
    const rows = [...strings].reverse().map(({name, cells}) => make("tr", {}, make("th", {scope: "row", textContent: name}), ...cells.map((cell, fret) => {
      const made = make("td", {textContent: cellText(cell, fret, bass), title: cell.title});
      made.className = cell.on === fret ? "" : "choked";
      made.style.setProperty("--part", `${Math.round(FULL * cell.contacts / most)}%`);
      return made;
    })));
    return make("table", {}, make("caption", {textContent: title}), make("thead", {}, head), make("tbody", {}, ...rows));
  }));
}

function showState(text = "") {
  $("map-neck").textContent = text ? "Stop" : "Map the neck";
  $("map-text").textContent = text;
}

$("map-neck").onclick = async () => {
  if (team.length) {
    endTeam();
    showState();
    return;
  }
  showState("0 %");
  try {
    const made = await mapNeck(part => showState(`${Math.round(100 * part)} %`));
    if (!made) return; // it was stopped
    maps.unshift(made);
    maps.splice(KEPT);
    show();
  } catch (error) {
    say(`The neck cannot be mapped: ${/** @type {Error} */ (error).message}`);
  }
  endTeam();
  showState();
};
const {velocity, seconds} = PAGE.map;
$("map-hint").textContent = `Contacts in ${seconds} s of a note at velocity ${velocity}; an arrow shows where a string lies that frets out. Change the bench and map again: both maps stay.`;
