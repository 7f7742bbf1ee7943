// The paper's cases: plucks of its string without the player model, shown slowly, with sound if wanted.
import {$, PAGE, chooseBass, makeButton, say} from "./page.js";
import {player} from "./player.js";
import {AFTER, BEFORE, showSlowly} from "./replay.js";
import {see} from "./view.js";
import {workshop} from "./workshop.js";

const HEARD = 1.5; // s
/** @type {{source?: AudioBufferSourceNode}} */
export const heardCase = {}; // the case that sounds

export const paperBass = () => PAGE.basses.find(({cases}) => cases.length);

// Shows a case on the bass with its bench settings.
export async function showCase(/** @type {Case} */ {apex, place, width, tier, says}, heard = true) {
  const {name} = /** @type {Bass} */ (paperBass());
  chooseBass(name);
  if (heard) await player.sound();
  const {context} = player, rate = context.sampleRate, file = await player.fileOf(name);
  const [before, frames, length] = [BEFORE, AFTER, heard ? HEARD : 0].map(seconds => Math.round(seconds * rate));
  const made = await workshop.ask({pluck: {apex, place, width}, file, tier, rate, before, frames, heard: length}, [file]);
  see.rate = rate;
  see.note.fret = 0;
  showSlowly(made);
  $("case-said").textContent = says;
  if (!heard || !player.analyser) return;
  heardCase.source?.stop();
  const buffer = new AudioBuffer({length, sampleRate: rate});
  buffer.copyToChannel(made.sound, 0);
  heardCase.source = new AudioBufferSourceNode(context, {buffer});
  heardCase.source.connect(player.analyser);
  heardCase.source.start();
}

const failed = (/** @type {Error} */ error) => say(`The case cannot be shown: ${error.message}`);

// Shows the case in the page's address, if there is one; it is silent until somebody asks for sound.
export function showLinked() {
  const symbol = new URLSearchParams(location.hash.slice(1)).get("case");
  if (symbol === null) return;
  const one = paperBass()?.cases.find(one => one.symbol === symbol);
  if (one) showCase(one, false).catch(failed);
  else say(`The link names no case of this page: case=${symbol.slice(0, 20)}.`);
}

for (const one of paperBass()?.cases || [])
  $("case-said").before(makeButton(one.title, {id: `case-${one.symbol}`, onclick: () => showCase(one).catch(failed)}));
$("cases").hidden = !paperBass();
addEventListener("hashchange", () => { if (player.ready) showLinked(); });
