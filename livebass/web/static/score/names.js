// Track names, as livebass/score/tracknames.py reads them: their text, and whether they name a bass.
import {WORDS} from "../words.js";

const PATTERNS = Object.fromEntries(Object.entries(WORDS.names).map(([kind, words]) => [kind, new RegExp(words, "iu")]));
const LATIN_LETTERS = /^[\x20-\x7e]/;
const CONTROLS_OF_C1 = /[\x80-\x9f]/; // browsers' reading of bytes that these encodings do not have

const plainName = name => name.normalize("NFKC").replaceAll("İ", "I").replaceAll("ı", "i");
const GAME_TRACK = new RegExp(`^(?:${WORDS.game.track})$`, "u");
// True if tracks of these names are a chart for a music game.
export const isGame = names => names.filter(name => GAME_TRACK.test(name)).length >= WORDS.game.minimum;
export const isOther = name => PATTERNS.other.test(plainName(name));
export const isDrums = name => PATTERNS.drums.test(plainName(name));
export const isBass = name => PATTERNS.bass.test(plainName(name)) && !isOther(name);

// The text of bytes in an encoding; undefined if they are invalid in it.
function textIn(bytes, encoding) {
  try {
    return new TextDecoder(encoding, {fatal: true, ignoreBOM: true}).decode(bytes);
  } catch {
    return undefined;
  }
}

const latin1 = bytes => Array.from(bytes, byte => String.fromCharCode(byte)).join("");

// True if bytes, in this encoding, contain a word for an instrument with non-ASCII letters.
function tells(bytes, encoding) {
  const text = textIn(bytes, encoding);
  if (text === undefined || CONTROLS_OF_C1.test(text)) return false;
  const name = plainName(text), found = name.match(PATTERNS.bass);
  return PATTERNS.telling.test(name) || (found !== null && !LATIN_LETTERS.test(found[0]));
}

// Decodes all texts of a file in one encoding: UTF-8, one in which a text names an instrument, or Latin-1.
export function decodeTexts(all) {
  const texts = all.map(bytes => textIn(bytes, "utf-8"));
  const doubtful = all.filter((_, k) => texts[k] === undefined);
  const encoding = WORDS.encodings.find(one => doubtful.some(bytes => tells(bytes, one)));
  const decoder = encoding && new TextDecoder(encoding, {ignoreBOM: true});
  return texts.map((text, k) => text ?? (decoder ? decoder.decode(all[k]) : latin1(all[k])));
}

// A meta event's printable text, cut to the longest name.
export function shownName(text) {
  const letters = [...text.replace(/[\p{C}\p{Z}]/gu, " ").trim()];
  return letters.length <= WORDS.longestName ? letters.join("") : `${letters.slice(0, WORDS.longestName - 3).join("")}...`;
}
