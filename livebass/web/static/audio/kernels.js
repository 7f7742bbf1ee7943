// The kernels in a memory of their own, and the records in it: layout.js has their fields. No DOM.
import {LAYOUT} from "../layout.js";

const PAGE_BYTES = 65536;
export const RECORDS = LAYOUT.records;
export const N = LAYOUT.numbers;
export const UNPLAYABLE = "Unplayable"; // the name of errors about a neck that cannot be played, between worker and page
export const lines = bytes => Math.ceil(bytes / N.LINE) * N.LINE;

export class Kernels {
  // `instance`: of the page's module.
  constructor(instance) {
    /** @type {any} */
    this.x = instance.exports;
    /** @type {WebAssembly.Memory} */
    this.memory = this.x.memory;
    this.view = new DataView(this.memory.buffer);
    this.bytes = new Uint8Array(this.memory.buffer);
    this.end = lines(this.x.__heap_base.value); // of what is in the memory
  }

  // Extends the memory to the address `end`.
  reserve(end) {
    const more = Math.ceil((end - this.memory.buffer.byteLength) / PAGE_BYTES);
    if (more > 0) this.memory.grow(more);
    if (this.view.buffer !== this.memory.buffer) {
      this.view = new DataView(this.memory.buffer);
      this.bytes = new Uint8Array(this.memory.buffer);
    }
  }

  // Adds memory behind what is there; returns its address.
  add(size) {
    const at = this.end;
    this.end = lines(at + size);
    this.reserve(this.end);
    return at;
  }

  get(record, address, name, index = 0) {
    const [offset, kind] = RECORDS[record].fields[name], at = address + offset;
    if (kind === "i4") return this.view.getInt32(at, true);
    if (kind === "i2") return this.view.getInt16(at, true);
    if (kind === "u1") return this.bytes[at + index];
    return kind === "f8" ? this.view.getFloat64(at + 8 * index, true) : Number(this.view.getBigInt64(at + 8 * index, true));
  }

  set(record, address, name, value, index = 0) {
    const [offset, kind] = RECORDS[record].fields[name], at = address + offset + 8 * index;
    if (kind === "f8") this.view.setFloat64(at, value, true);
    else if (kind === "i4") this.view.setInt32(address + offset, value, true);
    else this.view.setBigInt64(at, BigInt(value), true);
  }

  fill(record, address, values) {
    for (const name in values) this.set(record, address, name, values[name]);
  }
}
