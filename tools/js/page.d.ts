// What the modules of livebass/web/static hand one another, and what the export of the page tells them.

// --- elements, by their ids ---

type ControlName = "gain" | "tone" | "blend" | "pluck_position" | "velocity_curve" | "hand_position" | "avoid_open"
  | "humanise_time" | "humanise_force" | "compression" | "drive"
  | "clean_blend" | "eq_bass" | "eq_low_mid" | "eq_low_mid_frequency" | "eq_high_mid" | "eq_high_mid_frequency"
  | "eq_treble" | "cabinet" | "limiter";
type Buttons = "skip" | "riff" | "power" | "later" | "hands" | "down" | "up" | "again" | "same" | "pull" | "story-back" | "story-next" | "picture" | "clip" | "now" | "octave-down" | "octave-up"
  | "open" | "open-preset" | "roll" | "loop" | "record" | "undo" | "redo" | "reset" | "newer" | "save" | "link" | "send" | "midi" | "panic" | "response"
  | "response-level" | "response-off" | "hear-recorded" | "hear-computed";
type Inputs = ControlName | "pull-place" | "pull-apex" | "pull-angle" | "zoom" | "slow" | "moment" | "song-file" | "force" | "response-file" | "preset-file";
type Canvases = "strings" | "side" | "note" | "spectrum" | "both";
type Others = "string" | "one-bar" | "one-row" | "maps" | "map-neck" | "map-text" | "map-hint" | `bench-${string}` | "page" | "lacks" | "about" | "meters" | "level" | "level-text" | "load" | "load-text" | "state"
  | "overload" | "faults" | "tab" | "neck" | "zoom-text" | "window" | "shown" | "pictures" | "pitch" | "slow-text"
  | "moment-text" | "cases" | "legend" | "seen" | "piano" | "strokes" | "ways" | "parts" | "transport" | "song-text" | "bench"
  | "bench-count" | "stories" | "real" | "story" | "story-at" | "bench-controls" | "force-text" | "midi-text" | "response-text"
  | "recorded" | "recorded-text" | "said" | "pull-place-text" | "pull-apex-text" | "pull-angle-text" | `${ControlName}-text` | `${"side" | "note" | "spectrum"}-figure`;

interface GetElement {
  (id: Buttons | `slot-${string}`): HTMLButtonElement;
  (id: Inputs): HTMLInputElement;
  (id: "bass" | "part" | "one"): HTMLSelectElement;
  (id: Canvases): HTMLCanvasElement;
  (id: "bench-fold"): HTMLDetailsElement;
  (id: Others): HTMLElement;
}

interface AudioContext {
  playbackStats?: {underrunEvents: number}; // Chromium's
}

interface Navigator {
  keyboard?: {getLayoutMap?: () => Promise<Map<string, string>>}; // Chromium's
}

// --- what the export tells: livebass/web/export.py ---

interface BassString {
  name: string;
  note: number;
  gauge: number; // mm
  length: number; // m, as all lengths
  frets: number[];
  heights: number[];
  rests: Rests;
}

type Rests = Record<number, number>; // the frets at which a string frets out, and the higher one that it lies on

interface Bass {
  name: string;
  title: string;
  about: string;
  strings: BassString[];
  pickups: {position: number, aperture: number, strings: number[]}[];
  body: number;
  pluck: [nearest: number, defaultValue: number, farthest: number];
  capo: number;
  frets: number;
  fretless: boolean;
  stroke: string;
  range: [lowest: number, highest: number];
  switches: number[];
  keys: Record<string, number>;
  effects: Record<string, number | string>;
  controllers: Record<string, number>;
  bench: any;
  cases: Case[];
  made: string; // differs where the bass does
  revision?: number; // of a shipped preset ...
  earlier?: number[]; // ... and those that the page has besides
}

interface Case {
  symbol: string;
  title: string;
  apex: number;
  place: number;
  width: number;
  tier: number;
  says: string;
}

interface PlayButton {
  symbol: string;
  name: string;
  value: number;
  strikes: boolean;
  everywhere: boolean;
  stroke: number; // the value of the parameter that chooses it; 0: none does
}

interface Parameter {
  minimum: number;
  maximum: number;
  defaultValue: number;
  unit: string;
  whole: boolean;
  points: string[];
  event: [kind: number, number: number];
}

interface RecordFields {
  bytes: number;
  fields: Record<string, [offset: number, kind: string]>;
}

type TabStroke = [begin: number, end: number, string: number, fret: number, kind: string]; // s, s

// livebass/web/tab.py
interface TabData {
  title: string;
  said: string;
  bass: string;
  rows: [time: number, kind: number, number: number, value: number][]; // s; kernels/player/words.py
  strokes: TabStroke[];
  bars: [begin: number, number: number, name: string][];
  end: number;
  shown?: Bass;
}

interface PageData {
  opens?: string; // the path that reads a dropped tablature
  tab?: TabData;
  address?: string; // public
  offline?: boolean; // it keeps its files for use without a network
  version: string;
  digest: string;
  tier: number;
  watching?: string;
  sliders: Record<string, object>; // what they have in common on all basses, by symbol
  packed?: boolean; // all its files are in the page
  parameters: Record<ControlName | "technique", Parameter>;
  sight: {SIGHT: RecordFields, SLOT_SIGHT: RecordFields & {seen: number}};
  buttons: PlayButton[];
  basses: Bass[];
  stories: Story[];
  recorded?: RecordedNote; // livebass/web/recorded_note.py
  map: {velocity: number, seconds: number, rate: number}; // of `livebass map`
}

// What one pluck does at a fret: contacts; where it hits hardest, and how fast (m/s); the last contact, s after the
// release; the fret that the string lies on; all this in words
interface FretCell {
  contacts: number;
  hardest?: number;
  speed: number;
  last: number;
  on: number;
  title: string;
}

interface FretRow {
  name: string;
  cells: FretCell[];
}

interface RecordedNote {
  bass: string;
  string: number;
  note: number;
  velocity: number;
  says: string;
}

interface Story {
  name: string;
  title: string;
  steps: {says: string, bass: string, notes: [string: number, fret: number, velocity: number][], values: Record<string, number>}[];
}

// --- what plays ---

interface MadeBass {
  name: string;
  label: string; // a link to it
  file: ArrayBuffer;
  response?: Float64Array;
  heights: number[][]; // of each string's crowns
  rests: Rests[];
}

interface Built extends MadeBass {
  bass: number;
  at: number;
  size: number;
  full: number[];
  image: ArrayBuffer;
}

interface PlayReport {
  load: number;
  peak: number;
  overload: number;
  faults: number;
  held: number[];
}

interface Playing {
  on: Record<string, boolean>;
  pluckedWith: string;
  values: Partial<Record<ControlName, number>>;
}

interface PlayerEvents {
  started: []; // the audio thread is there
  sounds: []; // it is heard from now on
  soundless: []; // somebody wants to hear it, and no sound comes
  ends: []; // it will stop: notes may still end
  silent: []; // it stopped
  stopped: []; // somebody stopped it
  sent: [midi: number[], time: number]; // a message was sent, of an event at a time (ms)
  struck: []; // a note was sent
  plays: [name: string]; // another bass plays
  playing: [playing: Playing]; // how it plays
  report: [report: PlayReport];
  sight: [sight: Sight];
  kept: [note: SeenNote]; // as much of a note was heard as a replay shows
  reported: [note: SeenNote]; // a note was heard for half a second
  songEnded: []; // a song came to its end
  songAt: [anchor: {from: number, at: number, tempo: number}]; // it plays its frame `at` at the frame `from`
  taped: [tape: {taped: Float32Array<ArrayBuffer>, last?: boolean}];
}

// The globals of an audio thread
declare const sampleRate: number, currentFrame: number;
declare class AudioWorkletProcessor { port: MessagePort; }
declare function registerProcessor(name: string, of: typeof AudioWorkletProcessor): void;

// --- what the strings do ---

interface Sight {
  sight: ArrayBuffer;
  frame: number;
  contacts: number[];
  notes: number[];
  of?: number; // the bass
}

interface Seen extends Sight {
  rate: number;
  bass?: Bass;
}

interface Hit {
  string: number;
  fret: number;
  frame: number;
  speed: number;
}

interface Flash {
  string: number;
  fret: number;
  strength: number; // of the hit, 0 to 1
  bright: number; // what is left of it, 0 to 1
  since: number; // ms
}

type Place = (place: number) => number | undefined; // m from the nut, to px

interface Motion {
  rows: Float32Array;
  across: Float32Array;
  slots: Float64Array;
  lies: number;
  sound: Float32Array<ArrayBuffer>;
  contacts: number[];
  first: number;
  string: number;
  frame: number;
  heights?: number[]; // of the crowns under it, if they are not those of the chosen bass
}

interface Replay extends Motion {
  hits: Hit[];
  at: number;
  length: number;
}

interface SeenNote {
  string: number;
  fret?: number;
  frame?: number;
  contacts: Hit[];
  of?: number; // the bass that played it
  wasKept?: boolean;
  wasReported?: boolean;
}

interface KeptNote extends Omit<MadeBass, "heights" | "rests"> {
  heights: Record<number, number[]>; // of each string's crowns
  recalled?: any; // what Engine.recall returned
  pulled?: Pull;
}

// A string that a hand holds, and lets go of
interface Pull {
  string: number;
  fret: number;
  place: number; // m from the stop
  apex: number; // m; below 0: towards the frets
  angle: number; // rad, from away from the neck to across it
}

// What Engine.hold returned, and what the player can
interface HeldString {
  length: number; // m
  weights: Float64Array; // of each mode
  hardest?: {apex: number, place: number}; // m, of the hardest pluck
  farthest: number; // m
}

interface HeldShape {
  string: number;
  fret: number;
  length: number; // m
  u: Float32Array; // m, at the steps of a drawn string
  v: Float32Array;
  place: number; // m from the stop, of the hand ...
  height: number; // ... and m over the open string's rest line
}

// --- what is played ---

interface Clock {
  late: number;
  frameAt(time: number): number | undefined;
}

interface PressedKey {
  note: number;
  velocity: number;
  string?: number;
  cell?: HTMLElement | null;
  clock: Clock;
  begin: number;
  end?: number;
}

interface RightFinger {
  y: number;
  time: number;
  began: number;
  crossed: boolean;
  plucked: number[]; // when it plucked each string
}

interface Stroke extends PlayButton {
  button: HTMLButtonElement;
}

interface Way extends Stroke {
  holds: Set<string>;
  latched: boolean;
  sent: boolean;
}

interface Roll {
  begun: boolean; // the audio thread has it
}

interface ResponseFile {
  name: string;
  samples: Float64Array;
  channels: number;
  channel: number;
}

interface PageState {
  octave: number;
  from: number;
  width: number;
  stroke?: Stroke;
  sentStroke?: Stroke;
  loud: number;
  late: number;
  watched: number;
  rolling: boolean;
  repeats: boolean;
  lastLook: number;
  lastSaid: number;
  early: PressedKey[];
  song?: import("../../livebass/web/static/score/song.js").Song;
  rolls?: Roll;
  tape?: Float32Array<ArrayBuffer>[];
  responseFile?: ResponseFile;
}
