// MIDI keyboards and basses connected to the browser, and the button that ends all notes.
import {$, busy} from "../pages/page.js";
import {letGo} from "../neck/hands.js";
import {player} from "./player.js";
import {panic, unlatchAll} from "../neck/techniques.js";

/** @type {Map<string, Set<string>>} */
const sounding = new Map(); // by input: "channel note" of each note that it holds

function take(/** @type {MIDIInput} */ {id}, /** @type {MIDIMessageEvent} */ {timeStamp, data}) {
  const midi = [...data || []], [status, note, velocity] = midi;
  const notes = sounding.get(id), key = `${status & 0xf} ${note}`;
  if ((status & 0xf0) === 0x90 && velocity) notes?.add(key);
  else if ((status & 0xe0) === 0x80) notes?.delete(key);
  player.send(timeStamp, midi);
}

// Ends the notes of inputs that are gone.
function endLost(/** @type {MIDIInput[]} */ inputs) {
  for (const [id, notes] of sounding) {
    if (inputs.some(input => input.id === id)) continue;
    for (const key of notes) {
      const [channel, note] = key.split(" ").map(Number);
      player.send(performance.now(), [0x80 | channel, note, 0]);
    }
    sounding.delete(id);
  }
}

async function connectMidi() {
  const access = await navigator.requestMIDIAccess();
  const listen = () => {
    const inputs = [...access.inputs.values()].filter(({state}) => state !== "disconnected");
    endLost(inputs);
    for (const input of inputs) {
      if (!sounding.has(input.id)) sounding.set(input.id, new Set());
      input.onmidimessage = e => take(input, e);
    }
    $("midi-text").textContent = inputs.length ? `MIDI from ${inputs.map(input => input.name).join(", ")}.`
      : "No MIDI device is connected. Plug one in now, and the page hears it.";
  };
  access.onstatechange = listen;
  listen();
}

$("midi").onclick = () => {
  if (player.ready) player.sound().catch(() => {});
  busy($("midi"), connectMidi()).catch(error => { $("midi-text").textContent = `The browser gives no MIDI: ${error.message}`; });
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
