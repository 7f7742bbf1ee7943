// Share: a link with the bass, its bench, the playing, the last notes, and the moment of the last note that is shown.
import {bench} from "../bench/benchview.js";
import {movedControls} from "../bench/controls.js";
import {doneBy, tell} from "../neck/line.js";
import {$, ADDRESS, chosenBass, say} from "./page.js";
import {player} from "../audio/player.js";
import {hold, said} from "../neck/pull.js";
import {pullText, readPull} from "../neck/pulled.js";
import {goTo, kept, keepPull, move, showSlowly} from "../neck/replay.js";
import {SHOWN} from "../neck/see.js";
import {riffParts} from "../score/riff.js";
import {state} from "./state.js";
import {STROKES, numberOf} from "../neck/techniques.js";
import {see} from "../neck/view.js";

const MOMENT = /^(\d)\.(\d{1,3})\.(\d{1,3})\.(-?\d{1,6})$/; // string, key, velocity, µs after the release
const SAME = 2e-6; // m between a link's pull and one that the bass allows

// The parts of a link for the moment that a replay shows: of the riff's last note, which plays alone from rest, whatever
// rang before (`rang`); or of a pull.
/** @returns {Record<string, string | number>} */
function momentParts(/** @type {string | undefined} */ riff) {
  const {note, replay} = kept, last = riff?.split("_").at(-1)?.split("."), micros = Math.round(1000 * see.moment);
  if (!note || !see.replay || see.replay !== replay) return {};
  if (note.pulled) return {pulled: `${pullText(note.pulled)}.${micros}`};
  if (!last || !note.recalled) return {};
  return {moment: [note.recalled.string, last[1], last[2], micros].join("."), ...note.recalled.notes > 1 && {rang: 1}};
}

// The parts of a link beside the bench.
/** @returns {Record<string, string | number>} */
function parts() {
  const riff = riffParts();
  return {
    ...movedControls(), ...riff, made: chosenBass().made, ...chosenBass().revision && {revision: bench().revision ?? chosenBass().revision},
    ...momentParts(riff.riff),
  };
}

// Copies a link: an address that others can open, or else the part after its #.
async function copyLink() {
  const more = parts(), link = bench().link(more), text = ADDRESS ? `${ADDRESS}#${link}` : link;
  const how = ADDRESS ? "" : ' Others open it with livebass page --link and the link in quotes: this page has no public address.';
  const alone = more.rang ? " Its moment shows the last note alone, from rest: before it the string still rang." : "";
  const what = `${more.riff ? "The link is copied, with your last notes." : "The link is copied."}${alone}`;
  try {
    if (ADDRESS && navigator.share) await navigator.share({title: document.title, url: text});
    else await navigator.clipboard.writeText(text).then(() => say(`${what}${how}`));
  } catch {
    say(`The browser copies nothing; the link is ${text}.${how}`, true);
  }
}

// Shows the moment that a link names, by its text from the # on, silently and still; returns whether it names one.
export function showLinkedMoment(/** @type {string} */ hash) {
  const requested = new URLSearchParams(hash.slice(1)), pulled = requested.get("pulled"), moment = requested.get("moment");
  if (pulled === null && moment === null) return false;
  const made = pulled === null ? linkedNote(requested, moment || "") : linkedPull(pulled);
  made.catch((/** @type {Error} */ error) => say(`The link's moment is not shown: ${error.message}.`));
  return true;
}

async function linkedNote(/** @type {URLSearchParams} */ requested, /** @type {string} */ text) {
  const [string, note, velocity, micros] = (MOMENT.exec(text) || []).slice(1).map(Number), bass = chosenBass();
  const stroke = STROKES.find(({symbol}) => symbol === requested.get("stroke")), key = stroke && numberOf(stroke);
  const first = key === undefined ? [] : [0x90, 0x80].map(status => [status, key, 64]);
  if (!bass.strings[string] || note > 127 || velocity > 127) throw new Error(`it cannot be read: ${text.slice(0, 30)}`);
  const made = await move({performed: {string, note, velocity, first}}, await player.fileOf(bass.name));
  const replay = showStill(bass, made, micros);
  if (!replay) return;
  const rang = requested.get("rang") ? " It plays alone, from rest; before it the string still rang." : "";
  tell(`A friend's note, in its first ${SHOWN.after} s: ${doneBy(replay)}.${rang}`);
}

async function linkedPull(/** @type {string} */ text) {
  const [, pull, micros] = /^(.*)\.(-?\d{1,6})$/.exec(text) || [], pulled = readPull(pull || ""), bass = chosenBass();
  if (!pulled || !bass.strings[pulled.string] || pulled.fret > bass.frets) throw new Error(`it cannot be read: ${text.slice(0, 30)}`);
  const {held, ...taken} = await hold(bass, pulled.string, pulled.fret), {place, apex} = held.grip(pulled.place, pulled.apex);
  if (Math.max(Math.abs(place - pulled.place), Math.abs(apex - pulled.apex)) > SAME) throw new Error("nobody pulls this string so far there");
  const replay = showStill(bass, await move({pulled}, taken.file), Number(micros));
  if (!replay) return;
  keepPull({...taken, heights: {[pulled.string]: bass.strings[pulled.string].heights}, pulled}, replay);
  tell(`A friend's pull, ${said(pulled)}: ${doneBy(replay)}.`);
}

// Shows a moment of a motion, if nobody has done anything else meanwhile; returns its replay.
function showStill(/** @type {Bass} */ bass, /** @type {Motion} */ made, /** @type {number} */ micros) {
  if (player.sounding || see.replay || bass !== chosenBass()) return undefined;
  const replay = showSlowly(made);
  state.rolling = false;
  goTo(made.frame - made.first + Math.round(micros / 1e6 * see.rate));
  return replay;
}

$("link").onclick = $("send").onclick = copyLink; // the second is in sight on phones, where the bench is folded
