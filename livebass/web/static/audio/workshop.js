// Workers that build basses in the background. The page has one for the basses that it plays; a map of the neck has its own.
import {workerAddress} from "../pages/files.js";
import {UNPLAYABLE} from "./kernels.js";

// True if no neck can be made as the sliders wanted; the message says which fret is too high.
export const isUnplayable = (/** @type {unknown} */ error) => /** @type {Error} */ (error).name === UNPLAYABLE;

export class Workshop {
  constructor() {
    this.worker = /** @type {Worker | undefined} */ (undefined);
    this.requested = 0;
    this.closed = false;
    /** @type {Map<number, {resolve: (built: any) => void, reject: (error: Error) => void}>} */
    this.waiting = new Map(); // for answers, by their numbers
  }

  // Begins, with the compiled kernels.
  async open(/** @type {WebAssembly.Module} */ module) {
    const address = await workerAddress("worker.js");
    if (this.closed) return;
    const worker = this.worker = new Worker(address);
    worker.onmessage = ({data: {id, built, error, kind}}) => {
      const waiting = this.waiting.get(id);
      this.waiting.delete(id);
      if (error) waiting?.reject(Object.assign(new Error(error), {name: kind}));
      else waiting?.resolve(built);
    };
    worker.onerror = ({message}) => {
      for (const {reject} of this.waiting.values()) reject(new Error(`worker.js: ${message || "it cannot be loaded"}`));
      this.waiting.clear();
    };
    await this.ask({module});
  }

  /**
   * Sends a message, and transfers `moved` to the worker; the promise is for its answer.
   * @param {object} message
   * @param {Transferable[]} moved
   * @returns {Promise<any>}
   */
  ask(message, moved = []) {
    const id = this.requested++;
    const answer = new Promise((resolve, reject) => this.waiting.set(id, {resolve, reject}));
    this.worker?.postMessage({id, ...message}, moved);
    return answer;
  }

  // Ends: what was asked for is not answered, and its promises are undefined.
  close() {
    this.closed = true;
    this.worker?.terminate();
    for (const {resolve} of this.waiting.values()) resolve(undefined);
    this.waiting.clear();
  }

  // Frees the memory of a bass, by its address in the audio thread.
  free(/** @type {number} */ bass) { this.worker?.postMessage({free: bass}); }
}

export const workshop = new Workshop();
