// A song from a MIDI file, played on the page's bass.
import {$, busy, chosenBass} from "../pages/page.js";
import {PRESET, benches, takePreset} from "../bench/benchview.js";
import {player} from "../audio/player.js";
import {AUTO, Song} from "./song.js";
import {state} from "../pages/state.js";
import {closeTab, isTab, openTab} from "./tab.js";
import {Transport} from "./transport.js";
import {WORDS} from "../words.js";

const opened = {name: "", lines: /** @type {string[]} */ ([])}; // the last file that could be read, "": none; what its song says

// Opens a MIDI file and chooses its bass part.
export async function openSong(/** @type {File} */ file) {
  const kernels = await player.kernels();
  const song = new Song(await file.arrayBuffer(), player.context.sampleRate, kernels);
  closeTab();
  state.song = song;
  showParts();
  $("part").selectedIndex = Math.max(0, [...$("part").options].findIndex(({value}) => value === AUTO));
  $("roll").disabled = $("loop").disabled = $("transport").hidden = false;
  transport.open(song.bars(), song.length);
  const minutes = Math.floor(song.length / 60), seconds = String(Math.floor(song.length % 60)).padStart(2, "0");
  opened.lines = [`${file.name}, ${minutes}:${seconds}: ${song.says()}`, ...song.remarks];
  saySong();
}

// Says what the song is, and what of its chosen part the present bass leaves out.
function saySong() {
  if (!state.song) return;
  const {leftOut: count} = state.song.fitted($("part").value, chosenBass());
  const left = count ? [`${count} key switch${count === 1 ? "" : "es"} of another instrument left out`] : [];
  $("song-text").textContent = [...opened.lines, ...left].map(line => `${line}.`).join("\n");
}

// Takes the song off the page: a tablature has come in its place.
function closeSong() {
  transport.pause(0);
  state.song = undefined;
  $("roll").disabled = $("loop").disabled = $("parts").hidden = $("transport").hidden = true;
  $("song-text").textContent = "";
}

// Opens a MIDI file or a tablature, or a preset if there is a bench for it. After a file that cannot be read, what was
// open stays open.
async function tryToOpen(/** @type {File} */ file) {
  if (PRESET.test(file.name) && benches.size) return takePreset(file);
  try {
    await busy($("open"), (isTab(file) ? openTab : openSong)(file));
    if (isTab(file)) closeSong();
    opened.name = file.name;
  } catch (error) {
    const stays = opened.name ? `. ${opened.name} stays open` : "";
    $("song-text").textContent = `${file.name}: ${/** @type {Error} */ (error).message}${stays}`;
  }
}

// Lists the song's parts for the present bass; its key switches are not notes.
export function showParts() {
  if (!state.song) return;
  const chosen = $("part").value;
  $("part").replaceChildren(...state.song.choices(chosenBass()).map(([value, text]) => new Option(text, value)));
  if ([...$("part").options].some(({value}) => value === chosen)) $("part").value = chosen;
  $("parts").hidden = $("part").options.length < 2;
}

// The chosen part's messages for the present bass: switch keys of another may be notes on it.
const messages = () => state.song?.messages($("part").value, chosenBass()) ?? new Int32Array();

const transport = new Transport({messages, quiet: () => player.change({panic: true})}, $("roll"), $("loop"));
$("transport").append(transport.back, transport.next, transport.where, ...transport.labels);

export const putPart = () => {
  saySong();
  transport.replace();
};

$("song-file").accept += `,${WORDS.endings.midi}`;
$("open").onclick = () => $("song-file").click();
$("song-file").onchange = () => {
  const [file] = $("song-file").files || [];
  if (file) tryToOpen(file);
  $("song-file").value = "";
};
$("part").onchange = () => {
  if (state.rolls) player.change({panic: true});
  putPart();
};
addEventListener("dragover", e => e.preventDefault());
addEventListener("drop", e => {
  e.preventDefault();
  const [file] = e.dataTransfer?.files || [];
  if (file) tryToOpen(file);
});
player.on("sight", ({notes}) => { if (state.rolls && notes.length) player.emit("struck"); });
