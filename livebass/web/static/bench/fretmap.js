// The fret map: what one pluck does at every string and fret of the bass on the bench, beside the map before it. The
// same as `livebass map`.
import {changesText} from "./benchview.js";
import {fretText, hitText, noteText} from "../neck/places.js";
import {$, PAGE, chosenBass, make, say} from "../pages/page.js";
import {player} from "../audio/player.js";
import {workshop} from "../audio/workshop.js";

const FRETS = 6; // of one message to the worker, which then has time for the bench
const KEPT = 2; // maps beside each other
const FULL = 55; // % of the colour in the cell with most contacts: its text stays readable
/** @type {{title: string, bass: Bass, strings: FretRow[]}[]} */
const maps = [];
const work = {number: 0, goes: false}; // of the newest map; whether it is being computed

/**
 * Computes the map of the chosen bass; undefined if another one was wanted meanwhile. `progress` gets the part done.
 * @param {(part: number) => void} progress
 * @returns {Promise<{title: string, bass: Bass, strings: FretRow[]} | undefined>}
 */
async function mapNeck(progress) {
  const number = ++work.number, bass = chosenBass(), {velocity, seconds, rate} = PAGE.map;
  const title = `${bass.title}${changesText()}`, file = await player.fileOf(bass.name), strings = [];
  const rests = bass.strings.map(string => ({...string.rests}));
  for (const [i, {name, note}] of bass.strings.entries()) {
    /** @type {FretCell[]} */
    const cells = [];
    for (let fret = 0; fret <= bass.frets; fret += FRETS) {
      const frets = Array.from({length: Math.min(FRETS, bass.frets + 1 - fret)}, (_, k) => fret + k), copy = file.slice(0);
      const buzz = {string: i, open: note, frets, velocity, frames: Math.round(seconds * rate)};
      const found = await workshop.ask({buzz, file: copy, tier: PAGE.tier, rate}, [copy]);
      if (number !== work.number) return undefined;
      cells.push(...found.map((each, k) => {
        const cell = {...each, last: each.last / rate, on: rests[i][fret + k] ?? fret + k};
        return {...cell, title: cellTitle(bass, i, cell, fret + k)};
      }));
      progress((i + cells.length / (bass.frets + 1)) / bass.strings.length);
    }
    strings.push({name, cells});
  }
  return {title, bass, strings};
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

function showState(/** @type {boolean} */ goes, text = "") {
  work.goes = goes;
  $("map-neck").textContent = goes ? "Stop" : "Map the neck";
  $("map-text").textContent = text;
}

$("map-neck").onclick = async () => {
  if (work.goes) {
    work.number++;
    showState(false);
    return;
  }
  showState(true, "0 %");
  try {
    const made = await mapNeck(part => showState(true, `${Math.round(100 * part)} %`));
    if (!made) return; // it was stopped
    maps.unshift(made);
    maps.splice(KEPT);
    show();
  } catch (error) {
    say(`The neck cannot be mapped: ${/** @type {Error} */ (error).message}`);
  }
  showState(false);
};
const {velocity, seconds} = PAGE.map;
$("map-hint").textContent = `Contacts in ${seconds} s of a note at velocity ${velocity}; an arrow shows where a string lies that frets out. Change the bench and map again: both maps stay.`;
