// Sounds beside the playing: motions that the worker made, and ticks for contacts.
import {player} from "./player.js";

const GAP = 0.25; // s between two sounds
const TICK = {lowest: 300, seconds: 0.06, level: 0.25}; // Hz of the first fret; of the hardest hit
export const hearing = {sources: /** @type {AudioBufferSourceNode[]} */ ([])}; // what sounds

/**
 * Plays sounds one after another, in place of those before; louder ones than full scale are turned down together.
 * Returns how long they last, s.
 * @param {Float32Array<ArrayBuffer>[]} sounds
 * @param {AudioNode} [to]
 */
export function hear(sounds, to = player.analyser) {
  const {context} = player;
  const most = sounds.reduce((most, sound) => sound.reduce((a, b) => Math.max(a, Math.abs(b)), most), 1);
  hush();
  let seconds = 0;
  for (const sound of sounds) {
    const buffer = new AudioBuffer({length: sound.length, sampleRate: context.sampleRate});
    buffer.copyToChannel(sound.map(x => x / most), 0);
    const source = new AudioBufferSourceNode(context, {buffer});
    if (to) source.connect(to);
    source.start(context.currentTime + seconds);
    hearing.sources.push(source);
    seconds += buffer.duration + GAP;
  }
  return seconds - GAP;
}

export function hush() {
  for (const source of hearing.sources) source.stop();
  hearing.sources = [];
}

// Ticks for a contact: higher frets higher, faster hits louder.
export function tick(/** @type {Hit} */ {fret, speed}, /** @type {AudioNode} */ to) {
  const {context} = player, now = context.currentTime, end = now + TICK.seconds;
  const sound = new OscillatorNode(context, {frequency: TICK.lowest * 2 ** (fret / 12), type: "triangle"});
  const level = new GainNode(context, {gain: TICK.level * Math.min(1, Math.sqrt(speed / 4))});
  level.gain.exponentialRampToValueAtTime(1e-4, end);
  sound.connect(level).connect(to);
  sound.start();
  sound.stop(end);
}
