// Finds an instrument that spreads over the channels of a track although no mode message says so, as
// livebass/score/spread.py does: a MIDI guitar with a channel a string, or an MPE keyboard with a channel a note.
import {RULE} from "../rule.js";
import {CONTROL, NOTE_OFF, NOTE_ON, PRESSURE, PROGRAM, WHEEL, listOf} from "./smf.js";

export const middleOf = values => {
  const sorted = Float64Array.from(values).sort(), half = sorted.length >> 1;
  return sorted.length % 2 ? sorted[half] : (sorted[half - 1] + sorted[half]) / 2;
};

// True if these notes lie where a bass plays.
export function areLow(keys) {
  const {lowest, highest, middle, most} = RULE.place, within = keys.filter(key => key >= lowest && key <= highest);
  return keys.length > 0 && within.length >= most * keys.length && middleOf(keys) <= middle;
}

// The lines of the lowest such instrument in a bass's range, {lines, mode}; `mode`: the messages that make it MPE, none
// for a channel a string. Undefined: there is none.
export function spreadOf(events, rate) {
  const programs = new Set(events.filter(({kind}) => kind === PROGRAM).map(({line}) => line)), playing = new Map();
  for (const {kind, line, track} of events) if (kind === NOTE_ON) playing.set(line, (playing.get(line) || new Set()).add(track));
  const ownLines = new Map(), port = line => Math.floor(line / RULE.channels); // by track
  for (const line of [...playing.keys()].sort((a, b) => a - b))
    for (const track of playing.get(line)) listOf(ownLines, track).push(line);
  const wanted = [...ownLines].sort(([a], [b]) => a - b).filter(([, own]) => own.length > 1 &&
    port(own[0]) === port(own[own.length - 1]) && own.every(line => playing.get(line).size === 1 && !programs.has(line)));
  if (!wanted.length) return undefined;
  const all = strokesOf(events, wanted.flatMap(([, own]) => own)), moved = movedOf(events);
  let found, lowest = Infinity;
  for (const [track, own] of wanted) {
    const strokes = new Map(own.map(line => [line, all.get(line)]));
    const keys = [...strokes.values()].flat().map(({key}) => key), middle = middleOf(keys);
    if (middle >= lowest || !areLow(keys) || !isOne(strokes, moved, RULE.overlap * rate)) continue;
    const mode = modeOf(strokes, track, playing);
    lowest = middle;
    found = {lines: [...new Set([...own, ...mode.map(({line}) => line)])], mode};
  }
  return found;
}

// The number of messages that bend or colour the notes of each line.
function movedOf(events) {
  const moved = new Map();
  for (const {kind, line, a} of events) {
    if (kind === WHEEL || kind === PRESSURE || (kind === CONTROL && a === RULE.spread.timbre))
      moved.set(line, (moved.get(line) || 0) + 1);
  }
  return moved;
}

// {begin, end, key} of the notes of each line, by begin; notes without end take no time.
function strokesOf(events, lines) {
  const found = new Map(lines.map(line => [line, []])), begun = new Map();
  for (const {kind, line, a, frame} of events) {
    const key = `${line} ${a}`;
    if (!found.has(line)) continue;
    if (kind === NOTE_ON) {
      begun.set(key, {begin: frame, end: frame, key: a});
      listOf(found, line).push(begun.get(key));
    } else if (kind === NOTE_OFF && begun.has(key)) {
      begun.get(key).end = frame;
      begun.delete(key);
    }
  }
  return found;
}

// True if each line has one note at a time, and either all lines together have, too, or each bends its own.
function isOne(strokes, moved, overlap) {
  const lines = [...strokes.values()];
  if (!lines.every(own => isSingle(own, overlap))) return false;
  const byTime = lines.flat().sort((a, b) => a.begin - b.begin || a.end - b.end || a.key - b.key);
  if (isSingle(byTime, overlap)) return true;
  return lines.length >= RULE.spread.leastBent && [...strokes].every(([line, own]) => (moved.get(line) || 0) >= own.length);
}

// True if most notes end when the next one begins.
function isSingle(strokes, overlap) {
  const overlapping = strokes.filter(({end}, k) => k + 1 < strokes.length && end > strokes[k + 1].begin + overlap);
  return overlapping.length <= RULE.spread.mostOverlap * strokes.length;
}

// The messages that make the lines MPE if they look like it: the first channel has no notes, and the next note takes
// another channel. None for strings, whose lowest notes rise or fall from channel to channel.
function modeOf(strokes, track, playing) {
  const lines = [...strokes.keys()], port = lines[0] - lines[0] % RULE.channels, last = lines[lines.length - 1];
  const lows = lines.map(line => Math.min(...strokes.get(line).map(({key}) => key)));
  const rises = new Set(lows.slice(1).map((low, k) => Math.sign(low - lows[k])));
  const order = lines.flatMap(line => strokes.get(line).map(stroke => ({...stroke, line})))
    .sort((a, b) => a.begin - b.begin || a.end - b.end || a.key - b.key || a.line - b.line);
  const stays = order.filter(({line}, k) => k > 0 && line === order[k - 1].line).length;
  const others = [...playing.keys()].some(line => line >= port && line <= last && !strokes.has(line));
  const likeStrings = rises.size === 1 && !rises.has(0), {leastBent, mostStaying} = RULE.spread;
  if (lines.length < leastBent || lines[0] === port || likeStrings || stays > mostStaying * order.length || others) return [];
  return [[101, 0], [100, 6], [6, last - port], [101, 127], [100, 127]].map(([a, b]) =>
    ({tick: 0, frame: 0, track, port: 0, line: port, kind: CONTROL, channel: 0, a, b}));
}
