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
  if (!isDrawn) return { sent: image, handed: [] };
  const sent = await createImageBitmap(/** @type {ImageBitmapSource} */ (image));
  return { sent, handed: [sent] };
}

/** Gives up what was handed over.
 * @param {Image} image */
export function close(image) {
  // A caller's own object may have anything by that name.
  if ("close" in image && typeof image.close === "function") image.close();
}
