// Watches the bass of `livebass play`, which plays elsewhere: this page only shows what its strings do.
"use strict";

let watched = 0; // the frame until which the bass is known

// Follows the bass until `play` ends: its next start has another address.
async function watch() {
  document.body.classList.add("watching");
  $("neck").inert = true;
  try {
    await takeAnswer(await fetch(PAGE.watching));
  } catch {} // it ended, as it does below
  say("play has ended. Its next start with --watch prints another address.");
}

// Takes the messages of an answer until it ends: livebass/web/watch.py says how they are laid out.
async function takeAnswer(answer) {
  if (!answer.ok) throw new Error(answer.statusText);
  const reader = answer.body.getReader(), decoder = new TextDecoder();
  let rest = new Uint8Array(0);
  for (;;) {
    const {done, value} = await reader.read();
    if (done) return;
    const all = new Uint8Array(rest.length + value.length);
    all.set(rest);
    all.set(value, rest.length);
    let at = 0;
    for (;;) {
      if (all.length < at + 8) break;
      const view = new DataView(all.buffer, at), text = view.getUint32(0, true), end = at + 8 + text + view.getUint32(4, true);
      if (all.length < end) break;
      takeSeen(JSON.parse(decoder.decode(all.subarray(at + 8, at + 8 + text))), all.slice(at + 8 + text, end).buffer);
      at = end;
    }
    rest = all.subarray(at);
  }
}

function takeSeen({frame, rate, contacts, notes, bass}, sight) {
  if (bass) {
    PAGE.basses = [bass];
    $("bass").replaceChildren(new Option(bass.title, bass.name));
    showBass();
    say(`${bass.title} plays, in livebass play.`);
  }
  see.rate = rate;
  watched = frame;
  see.take({sight, frame, contacts, notes});
}
