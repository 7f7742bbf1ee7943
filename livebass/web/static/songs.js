// A song from a MIDI file, played on the page's bass.
import {$, chosenBass, isPressed, say, setPressed} from "./page.js";
import {PRESET, benches, takePreset} from "./benchview.js";
import {player} from "./player.js";
import {AUTO, Song} from "./song.js";
import {state} from "./state.js";
import {isTab, openTab, pauseTab} from "./tab.js";

const SOON = 0.1; // s until a song begins

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
  const roll = state.rolls = {begun: false};
  showRoll();
  try {
    await player.sound();
    if (state.rolls !== roll) return;
    const {currentTime, sampleRate} = player.context;
    roll.begun = true;
    playPart({from: Math.round((currentTime + SOON) * sampleRate)});
  } catch (error) {
    stopSong();
    throw error;
  }
}

// Hands the chosen part to the audio thread, for the present bass: switch keys of another may be notes on it.
function playPart(/** @type {object} */ how) {
  const {song} = state;
  if (!song || !state.rolls?.begun) return;
  const messages = Int32Array.from(song.messages($("part").value, chosenBass())
    .flatMap(({frame, midi: [status, first = 0, second = 0]}) => [frame, status, first, second]));
  const length = Math.max(1, Math.round(song.length * song.rate));
  player.playSong({messages, length, loops: isPressed($("loop")), ...how});
}

export const putPart = () => playPart({goesOn: true});

function showRoll() {
  $("roll").textContent = state.rolls ? "Stop song" : "Play";
  setPressed($("roll"), !!state.rolls);
}

function stopSong() {
  const {rolls} = state;
  endSong();
  if (!rolls?.begun) return;
  player.playSong(null);
  player.change({panic: true});
}

function endSong() {
  state.rolls = undefined;
  showRoll();
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
  putPart();
};
$("roll").onclick = () => {
  if (state.rolls) stopSong();
  else rollSong().catch(error => say(error.message));
};
$("loop").onclick = () => {
  setPressed($("loop"), !isPressed($("loop")));
  player.loopSong(isPressed($("loop")));
};
addEventListener("dragover", e => e.preventDefault());
addEventListener("drop", e => {
  e.preventDefault();
  const [file] = e.dataTransfer?.files || [];
  if (file) tryToOpen(file);
});
player.on("ends", stopSong);
player.on("songEnded", endSong);
player.on("sight", ({notes}) => { if (state.rolls && notes.length) player.emit("struck"); });
