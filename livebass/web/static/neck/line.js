// The sentence under the neck: what the page is, what the last note did, what a replay shows.
import {$, chosenBass} from "../pages/page.js";
import {player} from "../audio/player.js";

export const tell = (/** @type {string} */ text) => { $("seen").textContent = text; };

export const contactsOf = (/** @type {number} */ count) => count === 1 ? "1 contact" : `${count} contacts`;

// Tells what a note did: "E string, fret 3: 7 contacts; it hits fret 4 hardest."
export function tellNote(/** @type {SeenNote} */ {string, fret = 0, contacts}) {
  const {strings, capo, fretless} = chosenBass();
  const where = `${strings[string].name} string, ${fret ? `fret ${capo + fret}` : "open"}`;
  if (!contacts.length) return tell(`${where}: it touches nothing. Press lower on the string to play harder.`);
  const hardest = contacts.reduce((a, b) => a.speed >= b.speed ? a : b);
  const place = fretless ? `the board ${Math.round(1000 * hardest.fret)} mm from the nut`
    : `fret ${capo + hardest.fret}`;
  return tell(`${where}: ${contactsOf(contacts.length)}; it hits ${place} hardest.`);
}

player.on("reported", tellNote);
