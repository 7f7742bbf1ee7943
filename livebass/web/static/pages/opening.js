// The page's first seconds: a hard note on the chosen bass, slow and silent, before anybody has touched anything.
import {tell} from "../neck/line.js";
import {chosenBass} from "./page.js";
import {player} from "../audio/player.js";
import {goTo, move, showSlowly} from "../neck/replay.js";
import {state} from "./state.js";
import {pictures, see} from "../neck/view.js";

const NOTE = {string: 0, fret: 3, velocity: 127};
const STILL = 0.0005; // s after the first hit, of the still

// Shows the note; a still of it where motion is not wanted.
export async function openMoving() {
  const bass = chosenBass(), {string, fret, velocity} = NOTE, note = bass.strings[string].note + fret;
  const file = () => player.fileOf(bass.name); // a link's neck that cannot be played has been replaced the second time
  const made = await file().catch(file).then(file => move({performed: {string, note, velocity}}, file)).catch(() => undefined);
  if (!made || player.sounding || state.early.length || see.replay || bass !== chosenBass()) return;
  const {hits} = showSlowly(made);
  state.repeats = true;
  if (!pictures.still.matches) return;
  state.rolling = false;
  goTo((hits[0]?.frame ?? made.frame) - made.first + STILL * player.context.sampleRate);
  tell("This string is computed, not recorded. Press it, or press Replay to see it move.");
}
