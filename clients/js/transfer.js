// Prepares frames to be sent to the worker.

import { checkImage, className } from "./given.js";

/** @typedef {import("./image.js").Image} Image */

/** The objects that can be sent to a worker only as a bitmap. */
const DRAWN = ["HTMLCanvasElement", "OffscreenCanvas", "HTMLVideoElement", "HTMLImageElement"];

/** The same frame, as it can be sent to a worker, and what is handed over to it.
 * @param {Image} image
 * @returns {Promise<{sent: Image, handed: Transferable[]}>} */
export async function sendable(image) {
  checkImage(image);
  if (typeof VideoFrame !== "undefined" && image instanceof VideoFrame) {
    const sent = image.clone();
    return { sent, handed: [sent] };
  }
  if ("luma" in image || "data" in image) return plain(image);
  if (!DRAWN.includes(className(image))) return { sent: image, handed: [] };
  const sent = await createImageBitmap(/** @type {ImageBitmapSource} */ (image));
  return { sent, handed: [sent] };
}

/** A plain object with the pixels or planes, since properties that are accessors, as of an `ImageData`, are not sent.
 * Arrays that are parts of larger buffers are copied: a message has the whole buffer of each array.
 * @param {import("./image.js").Pixels | import("./image.js").Planes} image
 * @returns {{sent: Image, handed: Transferable[]}} */
function plain(image) {
  const { width, height } = image;
  /** @type {Transferable[]} */
  const handed = [];
  const own = (/** @type {any} */ pixels) => {
    // Shared memory is sent without a copy.
    if (!(pixels?.buffer instanceof ArrayBuffer) || pixels.byteLength === pixels.buffer.byteLength) return pixels;
    const copy = new Uint8Array(pixels);
    handed.push(copy.buffer);
    return copy;
  };
  if (!("luma" in image)) return { sent: { width, height, data: own(image.data) }, handed };
  return { sent: { width, height, luma: own(image.luma), cb: own(image.cb), cr: own(image.cr) }, handed };
}

/** Gives up what was handed over.
 * @param {Image} image */
export function close(image) {
  // A caller's own object may have any property of this name.
  if ("close" in image && typeof image.close === "function") image.close();
}
