// A song from a MIDI file, played on the page's bass.
import {$, chosenBass, isPressed, say, setPressed} from "./page.js";
import {PRESET, benches, takePreset} from "./benchview.js";
import {player} from "./player.js";
import {AUTO, Song} from "./song.js";
import {state} from "./state.js";
import {isTab, openTab, pauseTab} from "./tab.js";

const AHEAD = 0.15, LOOK_EVERY = 30; // s of a song sent ahead; ms between looks

// Opens a MIDI file and chooses its bass part.
export async function openSong(/** @type {File} */ file) {
  stopSong();
  const song = state.song = new Song(await file.arrayBuffer(), player.context.sampleRate);
  showParts();
  $("part").selectedIndex = Math.max(0, [...$("part").options].findIndex(({value}) => value === AUTO));
  $("roll").disabled = $("loop").disabled = false;
  const minutes = Math.floor(song.length / 60), seconds = String(Math.floor(song.length % 60)).padStart(2, "0");
  const lines = [`${file.name}, ${minutes}:${seconds}: ${song.says()}`, ...song.remarks];
  $("song-text").textContent = lines.map(line => `${line}.`).join("\n");
}

// Opens a MIDI file or a tablature, or a preset if there is a bench for it.
function tryToOpen(/** @type {File} */ file) {
  if (PRESET.test(file.name) && benches.size) takePreset(file);
  else (isTab(file) ? openTab : openSong)(file).catch(error => { $("song-text").textContent = `${file.name}: ${error.message}`; });
}

// Lists the song's parts for the present bass; its key switches are not notes.
export function showParts() {
  if (!state.song) return;
  const chosen = $("part").value;
  $("part").replaceChildren(...state.song.choices(chosenBass()).map(([value, text]) => new Option(text, value)));
  if ([...$("part").options].some(({value}) => value === chosen)) $("part").value = chosen;
  $("parts").hidden = $("part").options.length < 2;
}

// Plays the song once the sound runs; a stop or another press before that cancels it.
async function rollSong() {
  pauseTab();
  /** @type {Roll} */
  const roll = state.rolls = {messages: [], sent: 0, from: 0};
  showRoll();
  try {
    await player.sound();
    if (state.rolls !== roll) return;
    putPart(); // takes a moment
    roll.from = player.context.currentTime + 0.1;
    roll.timer = setInterval(sendSong, LOOK_EVERY);
    sendSong();
  } catch (error) {
    stopSong();
    throw error;
  }
}

function showRoll() {
  $("roll").textContent = state.rolls ? "Stop song" : "Play";
  setPressed($("roll"), !!state.rolls);
}

// Takes the chosen part's messages, from the song's present place on.
function takePart() {
  const {song, rolls} = state;
  putPart();
  if (!song || !rolls) return;
  const now = (player.context.currentTime - rolls.from) * song.rate;
  rolls.sent = rolls.messages.filter(({frame}) => frame < now).length;
}

// Adapts the part to the present bass: switch keys of another may be notes on it. The number of messages stays.
export function putPart() {
  if (state.song && state.rolls) state.rolls.messages = state.song.messages($("part").value, chosenBass());
}

// Sends the next moments' messages; starts again at the end of a loop.
function sendSong() {
  const {song, rolls} = state;
  if (!song || !rolls) return;
  const until = player.context.currentTime + AHEAD - rolls.from, {messages} = rolls;
  while (rolls.sent < messages.length && messages[rolls.sent].frame <= until * song.rate) {
    const {frame, midi} = messages[rolls.sent++];
    player.send(0, midi, undefined, Math.round(rolls.from * song.rate) + frame);
  }
  if (rolls.sent < messages.length || until < song.length + AHEAD) return;
  if (isPressed($("loop"))) Object.assign(rolls, {from: rolls.from + Math.max(1, song.length), sent: 0});
  else stopSong();
}

function stopSong() {
  const {rolls} = state;
  state.rolls = undefined;
  showRoll();
  if (rolls?.timer === undefined) return;
  clearInterval(rolls.timer);
  setTimeout(() => player.change({panic: true}), 1000 * AHEAD); // also ends notes sent ahead
}

$("open").onclick = () => $("song-file").click();
$("song-file").onchange = () => {
  const [file] = $("song-file").files || [];
  if (file) tryToOpen(file);
  $("song-file").value = "";
};
$("part").onchange = () => {
  if (!state.rolls) return;
  player.change({panic: true});
  takePart();
};
$("roll").onclick = () => {
  if (state.rolls) stopSong();
  else rollSong().catch(error => say(error.message));
};
$("loop").onclick = () => setPressed($("loop"), !isPressed($("loop")));
addEventListener("dragover", e => e.preventDefault());
addEventListener("drop", e => {
  e.preventDefault();
  const [file] = e.dataTransfer?.files || [];
  if (file) tryToOpen(file);
});
player.on("ends", stopSong);
