// Frets and places of the neck in words. A bass without frets has none to name: its places are so many mm from the nut.

/** @typedef {Pick<Bass, "capo" | "fretless"> & {strings: Pick<BassString, "name" | "frets">[]}} Neck */

const mm = (/** @type {number} */ place) => Math.round(1000 * place);

// A place, m from the nut or the capo.
const fromNut = (/** @type {Neck} */ {capo}, /** @type {number} */ place) => `${mm(place)} mm from the ${capo ? "capo" : "nut"}`;

/**
 * A fret under a string, counted from the nut: "fret 20"; without frets, after the words `board`, its place.
 * @param {Neck} bass
 * @param {number} string
 * @param {number} fret
 */
export const fretText = (bass, string, fret, board = "the board") =>
  bass.fretless ? `${board} ${fromNut(bass, bass.strings[string].frets[fret - 1])}` : `fret ${bass.capo + fret}`;

/**
 * What a contact hits: "fret 4", or a place of the board.
 * @param {Neck} bass
 * @param {number} fret or m from the nut
 */
export const hitText = (bass, fret) => bass.fretless ? `the board ${fromNut(bass, fret)}` : `fret ${bass.capo + fret}`;

/**
 * A string and where it is stopped: "E string, fret 3", "E string, open", "E string at 200 mm from the nut".
 * @param {Neck} bass
 * @param {number} string
 * @param {number} fret
 */
export function noteText(bass, string, fret) {
  const name = `${bass.strings[string].name} string`;
  return `${name}${bass.fretless && fret ? " " : ", "}${fret ? fretText(bass, string, fret, "at") : "open"}`;
}

/**
 * Adjacent frets: "Frets 1 to 12"; without frets their places.
 * @param {Neck} bass
 * @param {number} first
 * @param {number} last
 */
export function spanText(bass, first, last) {
  const {frets} = bass.strings[0], begin = first > 1 ? frets[first - 2] : 0;
  return bass.fretless ? `${mm(begin)} to ${mm(frets[last - 1])} mm` : `Frets ${bass.capo + first} to ${bass.capo + last}`;
}
