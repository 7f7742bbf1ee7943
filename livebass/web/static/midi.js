// MIDI keyboards and basses connected to the browser, and the button that ends all notes.
import {$} from "./page.js";
import {letGo} from "./hands.js";
import {player} from "./player.js";
import {panic, unlatchAll} from "./techniques.js";

async function connectMidi() {
  const access = await navigator.requestMIDIAccess();
  const listen = () => {
    const inputs = [...access.inputs.values()];
    for (const input of inputs) input.onmidimessage = e => player.send(e.timeStamp, [...e.data || []]);
    $("midi-text").textContent = inputs.length ? `MIDI from ${inputs.map(input => input.name).join(", ")}.`
      : "No MIDI device is connected. Plug one in now, and the page hears it.";
  };
  access.onstatechange = listen;
  listen();
}

$("midi").onclick = () => {
  if (player.ready) player.sound().catch(() => {});
  connectMidi().catch(error => { $("midi-text").textContent = `The browser gives no MIDI: ${error.message}`; });
};
if (!navigator.requestMIDIAccess) {
  $("midi").hidden = true;
  $("midi-text").textContent = "This browser has no Web MIDI: play with keys, mouse or fingers. Chrome and Edge have it, Firefox on https and localhost.";
}
$("panic").onclick = () => {
  letGo();
  unlatchAll();
  panic();
};
