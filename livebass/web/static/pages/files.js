// The page's files: in its folder on a server, or packed in the page itself.
import {PAGE} from "./page.js";

// A function that uses a vector instruction
const SIMD = [0, 97, 115, 109, 1, 0, 0, 0, 1, 5, 1, 96, 0, 1, 123, 3, 2, 1, 0, 10, 10, 1, 8, 0, 65, 0, 253, 15, 253, 98, 11];

// Tells what the browser, or the page's place, lacks for showing strings; undefined: nothing.
export function lacking() {
  if (!PAGE.packed && location.protocol === "file:")
    return "A page in a folder needs a web server. To play from a disk, export it with --single.";
  if (!window.WebAssembly || !WebAssembly.validate(new Uint8Array(SIMD)))
    return "This browser has no WebAssembly SIMD: it cannot play. Chrome 97, Edge 97, Firefox 89 and Safari 16.4 or later can.";
  if (PAGE.packed && !window.DecompressionStream)
    return "This browser has no DecompressionStream: it cannot open this page. Chrome 97, Edge 97, Firefox 113 and Safari 16.4 or later can.";
  return undefined;
}

// Tells what is lacking for sound; undefined: nothing.
export function lackingSound() {
  if (!window.isSecureContext) return "Browsers play this page from https, from localhost or from a disk only, not from http. Here strings move without sound.";
  if (!window.AudioWorkletNode) return "This browser has no AudioWorklet: strings move without sound. Chrome, Edge, Firefox and Safari 16.4 or later play.";
  return undefined;
}

/** @param {string} text */
async function unpack(text) {
  const packed = Uint8Array.from(atob(text), c => c.charCodeAt(0));
  return new Response(new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"))).arrayBuffer();
}

// The address of a file in the page's folder. Its version keeps a browser's cache from mixing two exports.
const address = (/** @type {string} */ name) => `${name.split("/").map(encodeURIComponent).join("/")}?v=${PAGE.digest}`;

const LOOKS = 50; // ms from a look for a file on its way to the next

// A file's text in this page, once the browser has all of it.
async function packed(/** @type {string} */ name) {
  for (;;) {
    const found = document.querySelector(`script[data-file="${CSS.escape(name)}"]`), whole = document.readyState !== "loading";
    if (found && (whole || found.nextElementSibling)) return found.textContent;
    if (whole) throw new Error(`${name}: not in this page`);
    await new Promise(done => setTimeout(done, LOOKS));
  }
}

// Reads a file, by path.
export async function read(/** @type {string} */ name) {
  if (PAGE.packed) return unpack(await packed(name));
  const answer = await fetch(address(name));
  if (!answer.ok) throw new Error(`${name}: ${answer.status} ${answer.statusText}`);
  return answer.arrayBuffer();
}

export const readText = async (/** @type {string} */ name) => new TextDecoder().decode(await read(name));

// Addresses of scripts. A page on a disk may start a worker from a blob: address and an audio thread from a data:
// address, but not the other way round.
export const workerAddress = async (/** @type {string} */ name) => PAGE.packed
  ? URL.createObjectURL(new Blob([await readText(name)], {type: "text/javascript"})) : address(name);
export const workletAddress = async (/** @type {string} */ name) => PAGE.packed
  ? "data:text/javascript;charset=utf-8," + encodeURIComponent(await readText(name)) : address(name);
