// The worker that reads where the frames of a video file are: only a worker can read a file piece by piece and wait.

import init, { index } from "./wasm/bagtrack_demux.js";

/**
 * @typedef {object} Index The samples of a file in the order of decoding, as `bagtrack-demux` tells them.
 * @property {string} codec
 * @property {Uint8Array<ArrayBuffer> | undefined} description
 * @property {number} rotation Degrees clockwise.
 * @property {Float64Array} offsets
 * @property {Uint32Array} sizes
 * @property {Float64Array} times In microseconds.
 * @property {Uint8Array} keys
 * @property {Uint8Array} shown
 */

onmessage = async ({ data: file }) => {
  try {
    await init({ module_or_path: new URL("./wasm/bagtrack_demux_bg.wasm", import.meta.url) });
    // A worker has it, a page does not.
    const reader = new /** @type {any} */ (globalThis).FileReaderSync();
    const read = (/** @type {number} */ offset, /** @type {number} */ length) =>
      new Uint8Array(reader.readAsArrayBuffer(file.slice(offset, offset + length)));
    const { codec, description, rotation, offsets, sizes, times, keys, shown } = index(read, file.size);
    postMessage({ codec, description, rotation, offsets, sizes, times, keys, shown });
  } catch {
    // A file of another kind, or a damaged one.
    postMessage(undefined);
  }
};
