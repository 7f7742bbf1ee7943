// What the modules of livebass/web/static hand one another, and what the export of the page tells them.

// --- elements, by their ids ---

type ControlName = "gain" | "tone" | "pluck_position" | "compression" | "drive";
type Buttons = "power" | "hands" | "down" | "up" | "again" | "picture" | "clip" | "now" | "octave-down" | "octave-up"
  | "open" | "open-preset" | "roll" | "loop" | "record" | "undo" | "redo" | "reset" | "save" | "link" | "midi" | "panic" | "response"
  | "response-level" | "response-off";
type Inputs = ControlName | "zoom" | "slow" | "moment" | "song-file" | "force" | "response-file" | "preset-file";
type Canvases = "strings" | "side" | "note" | "spectrum";
type Others = "page" | "lacks" | "about" | "meters" | "level" | "level-text" | "load" | "load-text" | "state"
  | "overload" | "faults" | "tab" | "neck" | "how" | "zoom-text" | "window" | "shown" | "pictures" | "pitch" | "slow-text"
  | "moment-text" | "cases" | "case-said" | "seen" | "piano" | "strokes" | "ways" | "parts" | "song-text" | "bench"
  | "bench-count" | "stories" | "bench-said" | "bench-controls" | "force-text" | "midi-text" | "response-text"
  | "said" | `${ControlName}-text` | `${"side" | "note" | "spectrum"}-figure`;

interface GetElement {
  (id: Buttons | `slot-${string}`): HTMLButtonElement;
  (id: Inputs): HTMLInputElement;
  (id: "bass" | "part"): HTMLSelectElement;
  (id: Canvases): HTMLCanvasElement;
  (id: "bench-fold"): HTMLDetailsElement;
  (id: Others): HTMLElement;
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
}

interface Bass {
  name: string;
  title: string;
  about: string;
  strings: BassString[];
  pickups: {position: number, aperture: number, strings: number[]}[];
  body: number;
  pluck: [nearest: number, usual: number, farthest: number];
  capo: number;
  frets: number;
  fretless: boolean;
  stroke: string;
  range: [lowest: number, highest: number];
  switches: number[];
  keys: Record<string, number>;
  effects: Record<string, number>;
  controllers: Record<string, number>;
  bench: any;
  cases: Case[];
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
}

interface Parameter {
  number: number;
  least: number;
  most: number;
  usual: number;
  unit: string;
  effect: number;
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
  midi: string; // base64
  strokes: TabStroke[];
  bars: [begin: number, number: number, name: string][];
  end: number;
  shown?: Bass;
}

interface PageData {
  opens?: string; // the path that reads a dropped tablature
  tab?: TabData;
  version: string;
  digest: string;
  tier: number;
  watching?: string;
  files: Record<string, string>;
  parameters: Record<ControlName, Parameter>;
  sight: {SIGHT: RecordFields, SLOT_SIGHT: RecordFields & {seen: number}};
  buttons: PlayButton[];
  basses: Bass[];
}

// --- what plays ---

interface Built {
  bass: number;
  at: number;
  image: ArrayBuffer;
  file: ArrayBuffer;
  response?: Float64Array;
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
  ends: []; // it will stop: notes may still end
  silent: []; // it stopped
  stopped: []; // somebody stopped it
  struck: []; // a note was sent
  heard: []; // the bass that is chosen plays, for the first time or again
  plays: [name: string]; // another bass plays
  playing: [playing: Playing]; // how it plays
  report: [report: PlayReport];
  sight: [sight: Sight];
  faded: []; // a bass from before is silent
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

interface Motion {
  rows: Float32Array;
  slots: Float64Array;
  sound: Float32Array;
  contacts: number[];
  first: number;
  string: number;
  frame: number;
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
  said?: boolean;
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
  told: boolean;
}

interface Roll {
  from: number; // s of the context
  messages: {frame: number, midi: number[]}[];
  sent: number; // how many of them
  timer?: ReturnType<typeof setInterval>;
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
  toldStroke?: Stroke;
  loud: number;
  late: number;
  watched: number;
  rolling: boolean;
  usualZoom: number;
  lastLook: number;
  early: PressedKey[];
  song?: import("../../livebass/web/static/song.js").Song;
  rolls?: Roll;
  tape?: Float32Array<ArrayBuffer>[];
  responseFile?: ResponseFile;
}
