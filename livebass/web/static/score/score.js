// Events in playing order, each note with its end, cleaned as in livebass/score/score.py; and low keys that are notes,
// distinguished from key switches as in livebass/score/low_keys.py.
import {isNote, keyOf, roundedToEven} from "./lines.js";
import {RULE} from "../rule.js";
import {NOTE_OFF, NOTE_ON, listOf} from "./smf.js";
import {middleOf} from "./spread.js";

const noteOffOf = (line, channel, a, frame, b) =>
  ({tick: 0, frame, track: 0, port: 0, line, kind: NOTE_OFF, channel, a, b});

// Returns the events with exactly one note-off per note; in each frame, controllers come first and note-ons last.
export function cleaned(events, end, rate) {
  const strokes = new Map(), clean = [], brief = Math.max(1, roundedToEven(RULE.brief * rate));
  for (const event of events) {
    if (isNote(event)) listOf(strokes, keyOf(event)).push(event);
    if (event.kind !== NOTE_OFF) clean.push(event);
  }
  for (const ofKey of strokes.values()) {
    const {line, channel, a} = ofKey[0];
    for (const [frame, velocity] of noteEnds(ofKey, end, brief)) clean.push(noteOffOf(line, channel, a, frame, velocity));
  }
  const rank = ({kind}) => kind === NOTE_ON ? 2 : kind === NOTE_OFF ? 1 : 0;
  return clean.sort((a, b) => a.frame - b.frame || rank(a) - rank(b));
}

// One key's note-ons and note-off velocities, by frame: {frame, ons, offs}.
function momentsOf(strokes) {
  /** @type {{frame: number, ons: number, offs: number[]}[]} */
  const moments = [];
  for (const {frame, kind, b} of strokes) {
    if (moments.at(-1)?.frame !== frame) moments.push({frame, ons: 0, offs: []});
    const last = moments[moments.length - 1];
    if (kind === NOTE_ON) last.ons++;
    else last.offs.push(b);
  }
  return moments;
}

// The [frame, release velocity] of the ends of one key's notes. A note-off ends the oldest held note, unless the key
// was struck again since and another note-off follows.
function noteEnds(strokes, end, brief) {
  const moments = momentsOf(strokes), ends = [];
  let held = 0, struck = 0;
  moments.forEach(({frame, ons, offs}, k) => {
    const offsNext = k + 1 < moments.length && moments[k + 1].offs.length > 0, early = Math.min(offs.length, held);
    held -= early;
    if (early && !(held && (ons || offsNext))) {
      ends.push([Math.max(frame, struck + brief), offs[early - 1]]);
      held = 0;
    }
    if (!ons) return;
    if (ends.length && ends.at(-1)[0] > frame) ends.at(-1)[0] = frame;
    const late = Math.min(offs.length - early, held + ons);
    held += ons - late;
    struck = frame;
    if (late && !(held && offsNext)) {
      ends.push([frame + brief, offs[early + late - 1]]);
      held = 0;
    }
  });
  if (held) ends.push([Math.max(end, struck + brief), RULE.release]);
  return ends;
}

// A take's events unchanged, with a note-off at frame `end` for each key still down.
export function endedTake(events, end) {
  const down = new Set(), at = Math.max(end, events.at(-1)?.frame || 0);
  for (const {kind, channel, a} of events) {
    if (kind === NOTE_ON) down.add(channel * 128 + a);
    else if (kind === NOTE_OFF) down.delete(channel * 128 + a);
  }
  const offs = [...down].sort((a, b) => a - b).map(key => [Math.floor(key / 128), key % 128]);
  return [...events, ...offs.map(([channel, a]) => noteOffOf(channel, channel, a, at, RULE.release))];
}

// The events with one channel per line: its own, or a free one if another line has it.
export function onChannels(events, {lines, zone}) {
  const channels = new Map(), all = Array.from({length: RULE.channels}, (_, channel) => channel);
  const order = [...new Set(events.map(event => event.line))].sort((a, b) => zone.has(b) - zone.has(a) || a - b);
  for (const line of order) {
    const own = lines[line].channel, taken = new Set(channels.values());
    channels.set(line, [own, ...all].find(channel => !taken.has(channel)) ?? own);
  }
  return events.map(event => {
    const channel = channels.get(event.line);
    return event.channel === channel ? event : {...event, channel};
  });
}

// The events without the key switches of another instrument, beyond the range of `bass`: brief keys just before a longer
// note, or, far from all notes, keys held while notes begin.
export function withoutForeignSwitches(events, bass, rate) {
  const [lowest, highest] = bass.range, switches = new Set(bass.switches), {short, most, far} = RULE.low;
  const strokes = strokesOf(events).filter(({key}) => key >= lowest || !switches.has(key));
  const isNear = ({key}) => key >= lowest && key <= highest, notes = strokes.filter(isNear);
  const beyond = strokes.filter(stroke => !isNear(stroke)), overlap = RULE.overlap * rate;
  if (!notes.length || !beyond.length) return events;
  const usual = middleOf(notes.map(({begin, end}) => end - begin)), keys = notes.map(({key}) => key);
  const least = keys.reduce((a, b) => Math.min(a, b)) - far, greatest = keys.reduce((a, b) => Math.max(a, b)) + far;
  const begins = Float64Array.from(notes, ({begin}) => begin);
  const found = beyond.filter(({begin, end, key}) => {
    const brief = end - begin < short * usual, isFar = key < least || key > greatest;
    const until = isFar ? Math.max(end - overlap, begin + overlap) : begin + overlap;
    const following = notes.slice(countBelow(begins, begin, false), countBelow(begins, until, false));
    return (brief || isFar) && following.some(note => note.end > end + overlap || !brief);
  });
  if (found.length < most * beyond.length) return events;
  const pressed = new Set(found.map(({begin, key}) => `${begin} ${key}`));
  const released = new Set(found.map(({end, key}) => `${end} ${key}`));
  return events.filter(({kind, frame, a}) => !(kind === NOTE_ON ? pressed : kind === NOTE_OFF ? released : new Set()).has(`${frame} ${a}`));
}

// Moves a foreign file's low keys, which would switch on `bass`, {range, switches}, up by octaves, if they are notes;
// else returns the same array of events.
export function withLowNotes(events, bass, rate) {
  const [lowest] = bass.range, switches = new Set(bass.switches);
  if (!areNotes(strokesOf(events), lowest, switches, rate)) return events;
  return events.map(event => {
    const raised = event.a - 12 * Math.floor((event.a - lowest) / 12);
    const moves = isNote(event) && event.a >= RULE.low.deepest && event.a < lowest && switches.has(event.a) && !switches.has(raised);
    return moves ? {...event, a: raised} : event;
  });
}

// {begin, end, key} of each note, by first frame; without a note-off a note ends with the last event.
function strokesOf(events) {
  const begun = new Map(), found = [], last = events.at(-1)?.frame || 0;
  for (const {kind, channel, a, frame} of events) {
    const line = listOf(begun, channel * 128 + a);
    if (kind === NOTE_ON) {
      line.push({begin: frame, end: last, key: a});
      found.push(line.at(-1));
    } else if (kind === NOTE_OFF) {
      line.splice(0).forEach(stroke => { stroke.end = frame; });
    }
  }
  return found.sort((a, b) => a.begin - b.begin || a.end - b.end || a.key - b.key);
}

// How many of the sorted `values` are less than `value`, or with `orSame` equal to it.
export function countBelow(values, value, orSame) {
  let from = 0, to = values.length;
  while (from < to) {
    const half = (from + to) >> 1;
    if (values[half] < value || (orSame && values[half] === value)) from = half + 1;
    else to = half;
  }
  return from;
}

// True if most low switch keys look like notes: as long as the others, and each alone.
function areNotes(strokes, lowest, switches, rate) {
  const low = strokes.filter(({key}) => key >= RULE.low.deepest && key < lowest && switches.has(key));
  const others = strokes.filter(({key}) => !switches.has(key) || key >= lowest);
  if (!low.length || !others.length) return low.length > 0;
  if (low.length === 1 && low[0].begin < others[0].begin) return false; // a switch before the first note
  const usual = middleOf(others.map(({begin, end}) => end - begin)), overlap = RULE.overlap * rate;
  const long = strokes.filter(({begin, end}) => end - begin > overlap);
  const begins = Float64Array.from(long, ({begin}) => begin).sort(), ends = Float64Array.from(long, ({end}) => end).sort();
  const like = low.filter(({begin, end}) => {
    if (end - begin < RULE.low.short * usual) return false;
    return end - begin <= overlap ||
      countBelow(begins, end - overlap, false) - countBelow(ends, begin + overlap, true) <= 1; // itself
  });
  return like.length >= RULE.low.most * low.length;
}
