// Names of tracks, as livebass/tracknames.py reads them: what their bytes say, and whether they call the track a bass.
import {RULE} from "./rule.js";

const WORDS = Object.fromEntries(Object.entries(RULE.words).map(([kind, words]) => [kind, new RegExp(words, "iu")]));
const LATIN_LETTERS = /^[\x20-\x7e]/;
const CONTROLS_OF_C1 = /[\x80-\x9f]/; // browsers read bytes so that these encodings do not have

const plainName = name => name.normalize("NFKC").replaceAll("İ", "I").replaceAll("ı", "i");
export const isOther = name => WORDS.other.test(plainName(name));
export const isDrums = name => WORDS.drums.test(plainName(name));
export const isBass = name => WORDS.bass.test(plainName(name)) && !isOther(name);

// The text of bytes in an encoding; undefined if they are none.
function textIn(bytes, encoding) {
  try {
    return new TextDecoder(encoding, {fatal: true, ignoreBOM: true}).decode(bytes);
  } catch {
    return undefined;
  }
}

const latin1 = bytes => Array.from(bytes, byte => String.fromCharCode(byte)).join("");

// True if bytes, in this encoding, have a word for an instrument in letters that ASCII does not have.
function tells(bytes, encoding) {
  const text = textIn(bytes, encoding);
  if (text === undefined || CONTROLS_OF_C1.test(text)) return false;
  const name = plainName(text), found = name.match(WORDS.bass);
  return WORDS.telling.test(name) || (found !== null && !LATIN_LETTERS.test(found[0]));
}

// The texts of one file, which are of one encoding: UTF-8, one in which a text names an instrument, or Latin-1.
export function decodeTexts(all) {
  const texts = all.map(bytes => textIn(bytes, "utf-8"));
  const doubtful = all.filter((_, k) => texts[k] === undefined);
  const encoding = RULE.encodings.find(one => doubtful.some(bytes => tells(bytes, one)));
  const decoder = encoding && new TextDecoder(encoding, {ignoreBOM: true});
  return texts.map((text, k) => text ?? (decoder ? decoder.decode(all[k]) : latin1(all[k])));
}

// The printable text of a meta event, cut to the longest name.
export function shownName(text) {
  const letters = [...text.replace(/[\p{C}\p{Z}]/gu, " ").trim()];
  return letters.length <= RULE.longestName ? letters.join("") : `${letters.slice(0, RULE.longestName - 3).join("")}...`;
}
