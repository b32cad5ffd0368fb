// Frames on their way to the worker.

import { checkImage } from "./given.js";

/** @typedef {import("./image.js").Image} Image */

/** The same frame, as it can be sent to a worker, and what is handed over to it.
 * @param {Image} image
 * @returns {Promise<{sent: Image, handed: Transferable[]}>} */
export async function sendable(image) {
  checkImage(image);
  if (typeof VideoFrame !== "undefined" && image instanceof VideoFrame) {
    const sent = image.clone();
    return { sent, handed: [sent] };
  }
  const isDrawn = ["HTMLCanvasElement", "OffscreenCanvas", "HTMLVideoElement"].includes(image.constructor?.name);
  if (!isDrawn) return withoutTheRest(image);
  const sent = await createImageBitmap(/** @type {ImageBitmapSource} */ (image));
  return { sent, handed: [sent] };
}

/** The image, with copies of what are parts of larger buffers: a message has the whole buffer of each array.
 * @param {any} image
 * @returns {{sent: Image, handed: Transferable[]}} */
function withoutTheRest(image) {
  // Shared memory is not copied at all.
  const isPart = (/** @type {any} */ { BYTES_PER_ELEMENT: bytes, byteLength, buffer } = {}) =>
    bytes === 1 && buffer instanceof ArrayBuffer && byteLength < buffer.byteLength;
  const parts = ["data", "luma", "cb", "cr"].filter((name) => isPart(image[name] ?? undefined));
  if (parts.length === 0) return { sent: image, handed: [] };
  const copies = parts.map((name) => new Uint8Array(image[name]));
  const sent = { ...image, ...Object.fromEntries(parts.map((name, at) => [name, copies[at]])) };
  return { sent, handed: copies.map(({ buffer }) => buffer) };
}

/** Gives up what was handed over.
 * @param {Image} image */
export function close(image) {
  // A caller's own object may have anything by that name.
  if ("close" in image && typeof image.close === "function") image.close();
}
