// Share: a link with the bass, its bench, the playing, the last notes, and the moment of the last note that is shown.
import {bench} from "../bench/benchview.js";
import {movedControls} from "../bench/controls.js";
import {$, ADDRESS, chosenBass, say} from "./page.js";
import {player} from "../audio/player.js";
import {goTo, kept, move, showSlowly} from "../neck/replay.js";
import {riffParts} from "../score/riff.js";
import {state} from "./state.js";
import {STROKES, numberOf} from "../neck/techniques.js";
import {see} from "../neck/view.js";

const MOMENT = /^(\d)\.(\d{1,3})\.(\d{1,3})\.(-?\d{1,6})$/; // string, key, velocity, µs after the release

// The parts of a link beside the bench. The last note of the riff is the one that a replay shows.
function parts() {
  const riff = riffParts(), last = riff.riff?.split("_").at(-1)?.split("."), {note} = kept;
  const shown = last && note?.recalled && see.replay && see.replay === kept.replay;
  return {
    ...movedControls(), ...riff, made: chosenBass().made, ...chosenBass().revision && {revision: bench().revision ?? chosenBass().revision},
    ...shown && {moment: [note.recalled.string, last[1], last[2], Math.round(1000 * see.moment)].join(".")},
  };
}

// Copies a link: an address that others can open, or else the part after its #.
async function copyLink() {
  const said = parts(), link = bench().link(said), text = ADDRESS ? `${ADDRESS}#${link}` : link;
  const others = `This page has no public address: others open the link with livebass page --link "${link}".`;
  const how = ADDRESS ? "" : ` ${others}`;
  const what = said.riff ? "The link is copied, with your last notes." : "The link is copied.";
  try {
    if (ADDRESS && navigator.share) await navigator.share({title: document.title, url: text});
    else await navigator.clipboard.writeText(text).then(() => say(`${what}${how}`));
  } catch {
    say(`The browser copies nothing; the link is ${text}.${how}`, true);
  }
}

// Shows the moment that a link names, by its text from the # on, silently and still; returns whether it names one.
export function showLinkedMoment(/** @type {string} */ hash) {
  const requested = new URLSearchParams(hash.slice(1)), text = requested.get("moment");
  if (text === null) return false;
  const [string, note, velocity, micros] = (MOMENT.exec(text) || []).slice(1).map(Number), bass = chosenBass();
  const stroke = STROKES.find(({symbol}) => symbol === requested.get("stroke")), key = stroke && numberOf(stroke);
  const first = key === undefined ? [] : [0x90, 0x80].map(status => [status, key, 64]);
  const show = async () => {
    if (!bass.strings[string] || note > 127 || velocity > 127) throw new Error(`it cannot be read: ${text.slice(0, 30)}`);
    const made = await move({performed: {string, note, velocity, first}}, await player.fileOf(bass.name));
    if (player.sounding || see.replay || bass !== chosenBass()) return;
    showSlowly(made);
    state.rolling = false;
    goTo(made.frame - made.first + Math.round(micros / 1e6 * see.rate));
  };
  show().catch((/** @type {Error} */ error) => say(`The link's moment is not shown: ${error.message}.`));
  return true;
}

$("link").onclick = copyLink;
