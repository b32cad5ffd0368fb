// The forms in which a frame may be given, and their pixels.

import { checkImage, sizeOf, unsupported } from "./given.js";
import { Problem } from "./problem.js";

/**
 * @typedef {object} Pixels RGBA row by row, as in `ImageData`; what is transparent counts as blended over black.
 * @property {number} width
 * @property {number} height
 * @property {Uint8Array | Uint8ClampedArray} data
 *
 * @typedef {object} Planes Luma row by row and, where there is colour, Cb and Cr in half of the columns and rows, rounded
 *   up: Rec. 601 in full range, as JPEG has them.
 * @property {number} width
 * @property {number} height
 * @property {Uint8Array} luma
 * @property {Uint8Array} [cb]
 * @property {Uint8Array} [cr]
 *
 * @typedef {ImageBitmap | VideoFrame | HTMLCanvasElement | OffscreenCanvas | HTMLVideoElement | HTMLImageElement}
 *   Drawable
 *
 * @typedef {Pixels | Planes | Drawable | Blob} Image Outside of browsers pixels or planes; a `Blob` is a file that the
 *   browser can decode.
 */

/** @type {OffscreenCanvas | undefined} */
let canvas;

/** The pixels of an image.
 * @param {Image} image
 * @returns {Promise<Pixels | Planes>} */
export async function pixelsOf(image) {
  checkImage(image);
  if ("luma" in image || "data" in image) return image;
  if (typeof OffscreenCanvas === "undefined")
    throw unsupported("Files and pictures are decoded by browsers: here give pixels { width, height, data }, or planes.");
  if (!(image instanceof Blob)) return draw(image);
  const bitmap = await createImageBitmap(image).catch(({ message }) => {
    throw new Problem({ type: "frame-damaged", status: 422, detail: `The browser cannot decode the file: ${message}` });
  });
  try {
    return draw(bitmap);
  } finally {
    bitmap.close();
  }
}

/** @param {Drawable} image */
function draw(image) {
  const [width, height] = sizeOf(image);
  if (!canvas || canvas.width !== width || canvas.height !== height) canvas = new OffscreenCanvas(width, height);
  const context = canvas.getContext("2d", { willReadFrequently: true });
  if (!context) throw new Error("The browser cannot draw the frame.");
  context.drawImage(image, 0, 0, width, height);
  return context.getImageData(0, 0, width, height);
}
