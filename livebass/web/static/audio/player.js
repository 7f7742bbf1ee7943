// The player: an audio thread in this browser. It receives notes, changes and the bass to play, and reports with events
// (tools/js/page.d.ts lists them as PlayerEvents).
import {read, workletAddress} from "../pages/files.js";
import {Kernels} from "./kernels.js";
import {$, PAGE, bassCalled, saved, say} from "../pages/page.js";
import {isUnplayable, workshop} from "./workshop.js";

const WARM = 400; // ms
const MAX_AHEAD = 0.5; // s
const SOUNDLESS = 2000; // ms from a press to the sentence that no sound comes
const FADES = 60; // ms
// Firefox on Linux can stop for ever when asked for its latency while it computes a sound: it is not asked. s
const ASSUMED = /Linux.*Firefox\//.test(navigator.userAgent) ? 0.035 : 0;

/**
 * Has the worker make the image that plays a bass, changed by sliders.
 * @param {string} name
 * @param {string} path of its instrument file
 * @param {[number, number][]} moved number and value of each slider
 * @returns {Promise<{file: ArrayBuffer, heights: number[][], rests: Rests[], places: number[]}>}
 */
export async function imageOf(name, path = `basses/${name}.lbass`, moved = []) {
  const {strings, capo, fretless} = bassCalled(name), file = await read(path);
  return workshop.ask({change: moved, neck: {strings, capo, fretless}, file}, [file]);
}

export class WorkletPlayer {
  constructor() {
    this.ready = false; // it can begin to play
    this.sounding = false; // somebody wants to hear it
    this.isMute = false; // this place cannot sound: it only shows motions
    /** @type {AudioContext} */
    this.context = /** @type {any} */ (undefined);
    /** @type {AudioWorkletNode} */
    this.node = /** @type {any} */ (undefined);
    /** @type {AnalyserNode | undefined} */
    this.analyser = undefined;
    /** @type {Float64Array | undefined} */
    this.response = undefined; // the player's own impulse response at the context's rate; undefined: the bass's
    this.fileOf = async (/** @type {string} */ name) => (await imageOf(name)).file; // the bench replaces this
    this.labelOf = (/** @type {string} */ name) => name; // tells a changed bass from others; the bench replaces this, too
    this.began = 0; // frame of the context at which the audio thread began
    this.playing = ""; // the name of the bass that plays
    /** @type {Map<number, string>} */
    this.names = new Map(); // of basses in the audio thread, by address ...
    /** @type {Map<number, MadeBass>} */
    this.basses = new Map(); // ... and what they were made of
    /** @type {{name: string, built: Promise<Built>} | undefined} */
    this.next = undefined; // the bass that waits for the start, or comes next
    /** @type {Promise<void> | undefined} */
    this.loading = undefined;
    /** @type {Promise<void> | undefined} */
    this.starting = undefined;
    /** @type {Map<number, () => void>} */
    this.copied = new Map(); // functions to call when the audio thread has a bass
    /** @type {((recalled: any) => void)[]} */
    this.recalled = []; // functions that wait for a string's events, the first first
    this.changes = 0; // of the playing, requested from the audio thread
    /** @type {Map<string, Function[]>} */
    this.listeners = new Map();
  }

  /**
   * Calls `listener` on every event of this kind; listeners are called in the order they were added.
   * @template {keyof PlayerEvents} Kind
   * @param {Kind} kind
   * @param {(...reported: PlayerEvents[Kind]) => void} listener
   */
  on(kind, listener) { this.listeners.set(kind, [...this.listeners.get(kind) || [], listener]); }

  /**
   * @template {keyof PlayerEvents} Kind
   * @param {Kind} kind
   * @param {PlayerEvents[Kind]} reported
   */
  emit(kind, ...reported) { for (const listener of this.listeners.get(kind) || []) listener(...reported); }

  // --- start and stop ---

  // Prepares everything possible before somebody asks for sound: until then browsers allow a context, but do not run
  // it.
  load() {
    this.loading = this.prepareAll();
    this.loading.catch(() => { this.loading = undefined; });
    return this.loading;
  }

  async prepareAll() {
    const context = this.context = new AudioContext({latencyHint: saved.get("latency") === "playback" ? "playback" : "interactive"});
    context.suspend().catch(() => {}); // some browsers run it at once
    context.onstatechange = () => { // for example, a phone call came
      if (this.sounding && context.state !== "running") this.silence();
    };
    this.wasm = await read("livebass.wasm");
    this.module = await WebAssembly.compile(this.wasm);
    await workshop.open(this.module);
    this.prepare($("bass").value, WARM);
    this.ready = true;
  }

  // Kernels with a memory of their own.
  async kernels() {
    await (this.loading || this.load());
    return new Kernels(await WebAssembly.instantiate(/** @type {WebAssembly.Module} */ (this.module)));
  }

  // Builds the player, whether or not somebody wants to hear it. Browsers that hold the audio thread back until then
  // continue when somebody does.
  start() {
    this.starting ||= this.begin().catch(error => {
      this.starting = undefined;
      say(`The sound does not start: ${error.message}`);
      throw error;
    });
    return this.starting;
  }

  async begin() {
    await this.loading;
    this.node = await this.makeNode(this.context);
    this.node.port.onmessage = ({data}) => this.hear(data);
    this.node.onprocessorerror = () => say("The audio thread stopped. Load the page again.", true);
    this.analyser = new AnalyserNode(this.context, {fftSize: 8192, smoothingTimeConstant: 0.5});
    this.node.connect(this.analyser).connect(this.context.destination);
    this.emit("started");
    this.see(!document.hidden);
    await this.put();
  }

  // Starts or resumes. Browsers run a context only right after a key, a button or the end of a touch: this waits for
  // that, and every call asks again, at once.
  async sound() {
    if (this.isMute) {
      this.emit("soundless");
      return new Promise(() => {});
    }
    await Promise.all([this.start(), this.resume()]);
    if (this.sounding) return; // another call came first
    this.sounding = true;
    this.emit("sounds");
  }

  // Browsers that tell whether somebody has touched the page write a warning if nobody has.
  async resume() {
    if (navigator.userActivation?.hasBeenActive === false) await new Promise(done => addEventListener("pointerup", done, {once: true}));
    const late = setTimeout(() => this.emit("soundless"), SOUNDLESS);
    await this.context.resume().finally(() => clearTimeout(late));
  }

  silence() {
    this.emit("ends");
    this.sounding = false;
    this.emit("silent");
  }

  async stop() {
    this.silence();
    await new Promise(done => setTimeout(done, FADES));
    if (this.sounding) return; // somebody played on
    this.emit("stopped");
    await this.context.suspend();
  }

  /**
   * Makes a playing node; offline, with a `score` of [frame, status, data, data] and a `bass` from the start.
   * @param {BaseAudioContext} context
   * @param {{channels?: number, score?: number[][], bass?: Built}} more
   */
  async makeNode(context, more = {}) {
    await context.audioWorklet.addModule(await workletAddress("worklet.js"));
    const {wasm, module} = this;
    return new AudioWorkletNode(context, "livebass", {
      numberOfInputs: 0, outputChannelCount: [more.channels || 2], processorOptions: {module, wasm, ...more},
    });
  }

  // --- basses ---

  // Plays a bass, by name, as soon as it is built.
  choose(/** @type {string} */ name) {
    if (this.ready) this.prepare(name);
    return this.node ? this.put() : undefined;
  }

  /**
   * Builds a bass of the page at a rate (Hz).
   * @param {string} name
   * @param {number} rate
   * @param {number} warm
   * @returns {Promise<Built>}
   */
  async build(name, rate, warm = 0) {
    const label = this.labelOf(name), {response} = this, file = await this.fileOf(name), kept = file.slice(0);
    const {strings} = bassCalled(name), heights = strings.map(string => string.heights), rests = strings.map(string => string.rests);
    return {...await workshop.ask({name, file, tier: PAGE.tier, rate, warm, response}, [file]), name, label, file: kept, response, heights, rests};
  }

  prepare(/** @type {string} */ name, warm = 0) {
    const before = this.next;
    this.next = {name, built: this.build(name, this.context.sampleRate, warm)};
    this.next.built.catch(error => { if (!isUnplayable(error)) say(`${bassCalled(name).title}: ${error.message}`); }); // else the bench says it
    before?.built.then(({bass}) => workshop.free(bass), () => {});
    return this.next;
  }

  // Hands the prepared bass to the audio thread, once it is built; returns when it has arrived.
  async put() {
    const wanted = this.next;
    if (!wanted) return;
    const built = await wanted.built.catch(() => undefined);
    if (!built || this.next !== wanted) return;
    this.next = undefined;
    const {bass, at, size, full, image, ...made} = built;
    this.names.set(bass, wanted.name);
    this.basses.set(bass, made);
    /** @type {Promise<void>} */
    const there = new Promise(resolve => this.copied.set(bass, resolve));
    this.node.port.postMessage({bass: {bass, at, size, full, image}}, [image]);
    await there;
  }

  // --- playing ---

  // The context's time (s) that is heard at a time of the page (ms; 0: the browser reports none), and the latency (s).
  heard() {
    const {context} = this;
    if (ASSUMED) return {contextTime: context.currentTime - ASSUMED, performanceTime: performance.now(), latency: ASSUMED};
    const {contextTime = 0, performanceTime = 0} = context.getOutputTimestamp?.() || {};
    return {contextTime, performanceTime, latency: context.outputLatency || 0};
  }

  // The audio frame for an event at `time` (ms, as in events), delayed enough to give all events the same latency.
  // Undefined, for at once, if the browser reports no time or, after a pause, an old one.
  frameAt(/** @type {number} */ time) {
    const {context} = this, {contextTime, performanceTime, latency} = this.heard();
    if (!performanceTime) return undefined;
    const at = contextTime + (time - performanceTime) / 1000 + latency + (context.baseLatency || 0);
    return at > context.currentTime + MAX_AHEAD ? undefined : Math.round(at * context.sampleRate);
  }

  // The frame heard now; in browsers that report no time, the frame computed last.
  heardFrame() {
    const {context} = this, {contextTime, performanceTime} = this.heard();
    const time = performanceTime ? contextTime + (performance.now() - performanceTime) / 1000 : context.currentTime;
    return time * context.sampleRate - this.began;
  }

  /**
   * Sends a MIDI message. Nothing is kept for later while the sound is off. A note may be meant for one string.
   * @param {number} time
   * @param {number[]} midi
   * @param {number | undefined} string
   * @param {number | undefined} frame
   */
  send(time, midi, string = undefined, frame = this.frameAt(time)) {
    if (!this.node || this.context.state !== "running" || midi[0] >= 0xf0) return;
    if ((midi[0] & 0xf0) === 0x90) this.emit("struck");
    this.emit("sent", midi, time);
    this.node.port.postMessage({midi, string, frame});
  }

  // Changes the playing. The audio thread reports the playing once it has carried out all changes.
  change(/** @type {object} */ message) { this.node?.port.postMessage({...message, change: ++this.changes}); }

  // Changes the playing now, with a MIDI message; or with a controller on every channel.
  changeBy(/** @type {number[]} */ midi) { this.change({midi, frame: this.frameAt(performance.now())}); }
  changeEverywhere(/** @type {number[]} */ everywhere) {
    this.change({everywhere, frame: this.frameAt(performance.now())});
  }

  // Tells the audio thread whether somebody watches; gives back one of its buffers.
  see(/** @type {boolean} */ seeing) { this.node?.port.postMessage({seeing}); }
  giveBack(/** @type {ArrayBuffer | undefined} */ spare) { if (spare) this.node?.port.postMessage({spare}, [spare]); }

  // Plays a song's messages in the audio thread, whatever the page does meanwhile: `from` a frame of the context, which
  // plays its frame `at`, up to its frame `end`, then again from `begin` on with `loops`. null: ends it. `goesOn`: in
  // place of the present one. steerSong changes some of these.
  playSong(/** @type {object | null} */ song) { this.node?.port.postMessage({song}); }
  steerSong(/** @type {object} */ steer) { this.node?.port.postMessage({steer}); }

  // Starts or stops recording.
  record(/** @type {boolean} */ on) { this.node.port.postMessage({record: on}); }

  // Asks for all that a string of a bass received since it was still; null if that is more than it keeps.
  recall(/** @type {number} */ string, /** @type {number} */ bass) {
    return new Promise(done => {
      this.recalled.push(done);
      this.node.port.postMessage({recall: {string, bass}});
    });
  }

  // Takes a message from the audio thread.
  hear(/** @type {any} */ data) {
    const chosen = $("bass").value;
    if (data.copied || data.faded) this.hearBass(data);
    else if (data.taped) this.emit("taped", data);
    else if (data.songEnded) this.emit("songEnded");
    else if (data.songAt) this.emit("songAt", data.songAt);
    else if (data.recalled !== undefined) this.recalled.shift()?.(data.recalled);
    else if (data.sight) {
      this.began = data.began;
      if (this.names.get(data.of) === chosen) this.emit("sight", data);
      else this.giveBack(data.sight); // another one may still ring
    } else {
      const name = this.names.get(data.bass);
      if (name && name !== this.playing) {
        this.playing = name;
        this.emit("plays", name);
      }
      if (this.sounding && name === chosen && data.changes === this.changes) this.emit("playing", data.playing);
      this.emit("report", data);
    }
  }

  // A bass has reached the audio thread, or is silent there: its memory can be reused.
  hearBass(/** @type {{copied?: number, faded?: number}} */ {copied, faded}) {
    const there = /** @type {number} */ (copied || faded);
    this.copied.get(there)?.();
    this.copied.delete(there);
    if (!faded) return;
    this.names.delete(faded);
    this.basses.delete(faded);
    workshop.free(faded);
  }
}

export const player = new WorkletPlayer();
document.addEventListener("visibilitychange", () => player.see(!document.hidden));
