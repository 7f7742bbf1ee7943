// The transport of a song or a tablature: play and pause, bars to and fro, a loop of bars, tempo. The audio thread plays,
// whatever the page does meanwhile; only one plays at a time.
import {isPressed, make, makeButton, say, setPressed} from "../pages/page.js";
import {player} from "../audio/player.js";
import {state} from "../pages/state.js";

const SOON = 0.1; // s until it begins
const LAST_MOMENT = 1e-3; // s before the end of a part, from which it begins again
/** @type {Transport | undefined} */
let active; // it plays, or will once there is sound
/** @type {{from: number, at: number, tempo: number}} */
let anchor; // the frame of the song `at` the frame `from` of the context

export class Transport {
  /**
   * `messages` makes the song's messages for the context: the frame of each, and status and two data bytes, or kind,
   * number and value of a tablature's event. `quiet` ends what messages left; `ready` waits for the bass.
   * @param {{messages: () => Int32Array, quiet?: () => void, ready?: () => Promise<void>}} song
   * @param {HTMLButtonElement} play
   * @param {HTMLButtonElement} loop
   */
  constructor(song, play, loop) {
    this.song = song;
    this.place = 0; // s, while it does not play
    this.tempo = 1;
    /** @type {[begin: number, number: number, name: string][]} */
    this.bars = [];
    this.end = 0; // s
    this.part = {begin: 0, end: 0}; // s, of the loop or the whole
    this.play = play;
    this.name = play.textContent;
    this.loop = loop;
    this.back = makeButton("‹", {title: "Bar before", ariaLabel: "Bar before", onclick: () => this.step(-1)});
    this.next = makeButton("›", {title: "Next bar", ariaLabel: "Next bar", onclick: () => this.step(1)});
    this.first = make("input", {type: "number", min: 1, value: 1, ariaLabel: "First bar"});
    this.last = make("input", {type: "number", min: 1, value: 1, ariaLabel: "Last bar"});
    this.slow = make("input", {type: "range", min: 25, max: 125, step: 5, value: 100, ariaLabel: "Tempo"});
    this.percent = make("output", {textContent: "100 %"});
    const labelled = (/** @type {string} */ name, /** @type {Node[]} */ ...inputs) => make("label", {}, `${name} `, ...inputs);
    this.labels = [labelled("Bars", this.first), labelled("to", this.last), labelled("Tempo", this.slow, this.percent)];
    this.where = make("output"); // the bar
    play.onclick = () => {
      if (isPressed(play)) this.pause();
      else this.start().catch(error => say(error.message));
    };
    loop.onclick = () => {
      setPressed(loop, !isPressed(loop));
      this.takePart();
    };
    this.first.onchange = this.last.onchange = () => {
      setPressed(loop, true);
      this.takePart();
    };
    this.slow.oninput = () => {
      this.tempo = Number(this.slow.value) / 100;
      this.percent.textContent = `${this.slow.value} %`;
      this.steer({tempo: this.tempo});
    };
  }

  // Takes another song, from its beginning: its bars, as they come, with their numbers, and its length in s.
  open(/** @type {[number, number, string][]} */ bars, /** @type {number} */ end) {
    this.pause(0);
    [this.bars, this.end, this.place] = [bars, end, 0];
    const numbers = bars.map(([, number]) => number);
    this.first.max = this.last.max = String(Math.max(...numbers));
    this.first.value = String(numbers[0]);
    this.last.value = String(Math.max(...numbers));
    this.takePart();
    this.showPlace();
  }

  get rolls() { return active === this && state.rolls !== undefined; }

  get now() {
    if (!this.rolls || !state.rolls?.begun) return this.place;
    const {currentTime, sampleRate} = player.context, passed = Math.max(0, currentTime * sampleRate - anchor.from);
    return Math.min((anchor.at + passed * anchor.tempo) / sampleRate, this.part.end);
  }

  // The number of the bar at a place, as the bars are played, from 0.
  barAt(/** @type {number} */ at) {
    const found = this.bars.findIndex(([begin]) => begin > at + 1e-6);
    return (found < 0 ? this.bars.length : found) - 1;
  }

  // The part between the chosen bars, as they first come; the whole song without a loop.
  takePart() {
    const {bars, end} = this, begin = Math.max(0, bars.findIndex(([, number]) => number === Number(this.first.value)));
    const final = bars.findIndex(([, number], k) => k >= begin && number === Number(this.last.value));
    const whole = !isPressed(this.loop) || !bars.length;
    this.part = {begin: whole ? 0 : bars[begin][0], end: whole || final < 0 ? end : bars[final + 1]?.[0] ?? end};
    if (this.rolls) this.steer(this.frames());
    if (this.place < this.part.begin || this.place > this.part.end) this.place = this.part.begin;
  }

  frames() {
    const {sampleRate} = player.context, begin = Math.round(this.part.begin * sampleRate);
    return {begin, end: Math.max(begin + 1, Math.round(this.part.end * sampleRate)), loops: isPressed(this.loop)};
  }

  steer(/** @type {object} */ change) { if (this.rolls) player.steerSong(change); }

  // Plays from its place on, once there is sound; a pause or another press before that cancels it.
  async start() {
    if (active !== this) active?.pause();
    active = this;
    /** @type {Roll} */
    const roll = state.rolls = {begun: false};
    this.show();
    try {
      await player.sound();
      await this.song.ready?.();
      if (state.rolls !== roll) return;
      const {currentTime, sampleRate} = player.context, messages = this.song.messages();
      if (this.place < this.part.begin || this.place >= this.part.end - LAST_MOMENT) this.place = this.part.begin;
      anchor = {from: Math.round((currentTime + SOON) * sampleRate), at: Math.round(this.place * sampleRate), tempo: this.tempo};
      player.playSong({messages, ...anchor, ...this.frames()});
      roll.begun = true;
    } catch (error) {
      if (state.rolls === roll) this.pause();
      throw error;
    }
  }

  // Plays other messages in place of the present ones, for another bass or part.
  replace() { if (this.rolls && state.rolls?.begun) player.playSong({messages: this.song.messages(), goesOn: true}); }

  // Pauses, here or at a place of the song.
  pause(at = this.now) {
    const begun = this.rolls && state.rolls?.begun;
    if (active === this) active = state.rolls = undefined;
    this.place = Math.min(at, this.end);
    this.show();
    if (!begun) return;
    player.playSong(null);
    this.song.quiet?.();
  }

  // Ends: the next start begins with the part.
  close() {
    active = state.rolls = undefined;
    this.place = this.part.begin;
    this.show();
  }

  show() {
    setPressed(this.play, this.rolls);
    this.play.textContent = this.rolls ? "Pause" : this.name;
    this.showPlace();
  }

  showPlace() {
    const number = this.bars[this.barAt(this.now)]?.[1], text = number ? `Bar ${number}` : "";
    if (this.where.textContent !== text) this.where.textContent = text;
  }

  // Goes a number of bars on or back; it plays on from there if it plays.
  step(/** @type {number} */ by) {
    const to = this.bars[Math.max(0, this.barAt(this.now) + by)]?.[0];
    if (to === undefined) return;
    this.place = to;
    this.steer({at: Math.round(to * player.context.sampleRate)});
    this.showPlace();
  }
}

// Pauses what plays.
export const pauseAll = () => active?.pause();

player.on("songAt", reported => { anchor = reported; });
player.on("songEnded", () => { if (state.rolls?.begun) active?.close(); });
player.on("ends", pauseAll);
player.on("report", () => active?.showPlace());
