// The worker that reads the index of a video file: only workers have `FileReaderSync`, which the module calls.

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
    // The type checker knows the types of a page only.
    const reader = new /** @type {any} */ (globalThis).FileReaderSync();
    const read = (/** @type {number} */ offset, /** @type {number} */ length) =>
      new Uint8Array(reader.readAsArrayBuffer(file.slice(offset, offset + length)));
    const { codec, description, rotation, offsets, sizes, times, keys, shown } = index(read, file.size);
    postMessage({ codec, description, rotation, offsets, sizes, times, keys, shown });
  } catch {
    // The file has another format, or is damaged.
    postMessage(undefined);
  }
};
