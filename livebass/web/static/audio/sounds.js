// Sounds beside the playing: motions that the worker made, and ticks for contacts.
import {busy, setPressed} from "../pages/page.js";
import {player} from "./player.js";

const GAP = 0.25; // s between two sounds
const FADE = 0.15; // s at the end of a sound: it does not break off
const TICK = {lowest: 300, seconds: 0.06, level: 0.25}; // Hz of the first fret; of the hardest hit
/** @type {{sources: AudioBufferSourceNode[], button?: Element}} */
export const hearing = {sources: []}; // what was heard last, and the button pressed meanwhile

/**
 * Plays sounds one after another, in place of those before; louder ones than full scale are turned down together.
 * Returns how long they last, s.
 * @param {Float32Array<ArrayBuffer>[]} sounds
 * @param {AudioNode} [to]
 * @param {Element} [button] that is pressed meanwhile
 */
export function hear(sounds, to = player.analyser, button = undefined) {
  const {context} = player;
  const maximum = sounds.reduce((maximum, sound) => sound.reduce((a, b) => Math.max(a, Math.abs(b)), maximum), 1);
  hush();
  press(button);
  let seconds = 0;
  hearing.sources = sounds.map(sound => {
    const buffer = new AudioBuffer({length: sound.length, sampleRate: context.sampleRate});
    const fade = FADE * context.sampleRate;
    buffer.copyToChannel(sound.map((x, k) => x / maximum * Math.min(1, (sound.length - 1 - k) / fade)), 0);
    const source = new AudioBufferSourceNode(context, {buffer});
    if (to) source.connect(to);
    source.start(context.currentTime + seconds);
    seconds += buffer.duration + GAP;
    return source;
  });
  const last = hearing.sources[sounds.length - 1];
  if (last) last.onended = () => { if (hearing.sources.includes(last)) press(undefined); };
  return seconds - GAP;
}

/**
 * Plays what a button's press makes: the button is busy until it is made, and pressed until it was heard. Another press
 * ends it.
 * @param {Element} button
 * @param {() => Promise<Float32Array<ArrayBuffer>[]>} make
 */
export async function hearBy(button, make) {
  const before = hearing.button;
  hush();
  if (button === before) return;
  press(button);
  const isRequested = () => hearing.button === button;
  try {
    const sounds = await busy(button, make());
    if (isRequested()) hear(sounds, undefined, button);
  } catch (error) {
    if (isRequested()) hush();
    throw error;
  }
}

function press(/** @type {Element | undefined} */ button) {
  if (hearing.button) setPressed(hearing.button, false);
  hearing.button = button;
  if (button) setPressed(button, true);
}

export function hush() {
  for (const source of hearing.sources) source.stop();
  hearing.sources = [];
  press(undefined);
}

player.on("ends", hush);

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
