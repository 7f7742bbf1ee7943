// Watches the bass of `livebass play`, which plays elsewhere: this page only shows its strings.
import {$, PAGE, say} from "./page.js";
import {showBass} from "../bench/bass.js";
import {state} from "./state.js";
import {see} from "../neck/view.js";

// Follows the bass until `play` ends; its next start has another address.
export async function watch(/** @type {string} */ address) {
  document.body.classList.add("watching");
  $("neck").inert = true;
  try {
    await takeAnswer(await fetch(address));
  } catch { /* it ended, as it does below */ }
  say("play has ended. Its next start with --watch prints another address.", true);
}

// Takes the messages of an answer until it ends; livebass/web/watch.py defines their layout.
async function takeAnswer(/** @type {Response} */ answer) {
  if (!answer.ok || !answer.body) throw new Error(answer.statusText);
  const reader = answer.body.getReader(), decoder = new TextDecoder();
  let rest = new Uint8Array(0);
  for (;;) {
    const {done, value} = await reader.read();
    if (done) return;
    const all = new Uint8Array(rest.length + value.length);
    all.set(rest);
    all.set(value, rest.length);
    let at = 0;
    while (all.length >= at + 8) {
      const view = new DataView(all.buffer, at), text = view.getUint32(0, true), end = at + 8 + text + view.getUint32(4, true);
      if (all.length < end) break;
      takeSeen(JSON.parse(decoder.decode(all.subarray(at + 8, at + 8 + text))), all.slice(at + 8 + text, end).buffer);
      at = end;
    }
    rest = all.subarray(at);
  }
}

function takeSeen(/** @type {Seen} */ {frame, rate, contacts, notes, bass}, /** @type {ArrayBuffer} */ sight) {
  if (bass) {
    PAGE.basses = [bass];
    $("bass").replaceChildren(new Option(bass.title, bass.name));
    showBass();
    say(`${bass.title} plays, in livebass play.`);
  }
  see.rate = rate;
  state.watched = frame;
  see.take({sight, frame, contacts, notes});
}
