// Checks what callers give, before any of it is sent or kept.

import { Problem } from "./problem.js";

/** @param {string} detail */
export const unsupported = (detail) => new Problem({ type: "unsupported-image", status: 415, detail });

/** The name of a value's class, also of one of another realm, such as a frame's or a test runner's.
 * @param {unknown} value */
export const className = (value) => Object.prototype.toString.call(value).slice("[object ".length, -1);

const ELEMENTS = ["HTMLCanvasElement", "HTMLVideoElement", "HTMLImageElement"];
const DRAWN = ["ImageBitmap", "VideoFrame", "OffscreenCanvas", ...ELEMENTS];
const PIXELS = ["Uint8Array", "Uint8ClampedArray"];
const FILES = ["Blob", "File"];
/** The least `readyState` of a video that has a picture to draw: `HAVE_CURRENT_DATA`. */
const SHOWS = 2;

/** Refuses what is no image for a tracker here.
 * @param {any} image */
export function checkImage(image) {
  const name = className(image);
  if (FILES.includes(name)) return;
  if (DRAWN.includes(name)) return void sizeOf(image);
  const isPixels = typeof image === "object" && image !== null && ("luma" in image || "data" in image);
  if (!isPixels)
    throw unsupported(`An image is { width, height, data }, planes, a picture, a video or a Blob.${hint(image)}`);
  const { luma, cb, cr, data } = image;
  const parts = "luma" in image ? [luma, cb ?? luma, cr ?? luma] : [data];
  if (parts.every((part) => PIXELS.includes(className(part)))) return;
  throw unsupported("Pixels are bytes: each of data, luma, cb and cr is a Uint8Array or a Uint8ClampedArray.");
}

/** Advice for a value from which an image could be made, such as a promise.
 * @param {unknown} image */
function hint(image) {
  if (className(image) === "Promise") return " This is a promise: await it.";
  if (!ArrayBuffer.isView(image) && className(image) !== "ArrayBuffer") return "";
  return " A browser takes the bytes of a file as new Blob([bytes]); elsewhere decode them.";
}

/** The size in which an image is drawn; or a refusal, since in place of nothing a black frame would be tracked.
 * @param {import("./image.js").Drawable} image */
export function sizeOf(image) {
  const [width, height] = sidesOf(image);
  const isShown = !("readyState" in image) || image.readyState >= SHOWS;
  if (width > 0 && height > 0 && isShown) return [width, height];
  throw unsupported("The picture has no pixels: it is closed, empty, or a video or <img> that has not loaded.");
}

/** @param {import("./image.js").Drawable} image */
function sidesOf(image) {
  if ("displayWidth" in image) return [image.displayWidth, image.displayHeight];
  if ("videoWidth" in image) return [image.videoWidth, image.videoHeight];
  if ("naturalWidth" in image) return [image.naturalWidth, image.naturalHeight];
  return [image.width, image.height];
}

/** A copy of the given bytes, since the caller may use their buffer again; or the file itself; `undefined` for all
 * else.
 * @param {unknown} given
 * @returns {Blob | Uint8Array<ArrayBuffer> | undefined} */
function ownOf(given) {
  if (ArrayBuffer.isView(given)) return new Uint8Array(given.buffer, given.byteOffset, given.byteLength).slice();
  const name = className(given);
  if (FILES.includes(name)) return /** @type {Blob} */ (given);
  if (name === "ArrayBuffer") return new Uint8Array(/** @type {ArrayBuffer} */ (given)).slice();
  return undefined;
}

/** The frame itself; or a refusal. What a WebSocket would send as a text or not at all is none, and shared memory is
 * sent by no browser.
 * @param {import("./client.js").Frame} frame
 * @returns {Blob | Uint8Array<ArrayBuffer>} */
export function frameOf(frame) {
  const own = ownOf(frame);
  if (own) return own;
  throw unsupported("A frame is a Blob, an ArrayBuffer or a Uint8Array with a JPEG, PNG or WebP file.");
}

/** The bytes of a snapshot; or a refusal.
 * @param {import("./client.js").Frame} snapshot */
export async function snapshotBytes(snapshot) {
  const own = ownOf(snapshot);
  if (own) return bytesOf(own);
  const detail = "A snapshot is a Blob, an ArrayBuffer or a Uint8Array with what `snapshot()` or `save()` gave.";
  throw new Problem({ type: "invalid-snapshot", status: 422, detail });
}

/** The bytes of a frame. A file is read, since it may be changed or removed before it is sent, or sent again.
 * @param {Blob | Uint8Array<ArrayBuffer>} frame
 * @returns {Promise<Uint8Array<ArrayBuffer>>} */
export async function bytesOf(frame) {
  if (ArrayBuffer.isView(frame)) return frame;
  try {
    return new Uint8Array(await frame.arrayBuffer());
  } catch (error) {
    const problem = unsupported("The frame cannot be read: its file was changed or removed since it was chosen.");
    problem.cause = error;
    throw problem;
  }
}

/** @param {number} window Frames on their way at a time. */
export function checkWindow(window) {
  if (Number.isInteger(window) && window >= 1 && window <= 32) return window;
  throw new RangeError("The window of a stream is a whole number from 1 to 32.");
}

/** A number of this name; or a refusal: with "20s" or NaN a client would wait for ever, or not at all.
 * @param {string} name
 * @param {number} number */
export function checkNumber(name, number) {
  if (typeof number === "number" && number >= 0) return number;
  throw new RangeError(`${name} is a number from 0 on, not ${typeof number === "string" ? `"${number}"` : number}.`);
}

/** The box itself, which its owner may change afterwards; or a refusal.
 * @param {import("./session.js").Box} box
 * @returns {import("./session.js").Box} */
export function boxOf(box) {
  const { x, y, width, height } = box ?? {};
  if ([x, y, width, height].every(Number.isFinite)) return { x, y, width, height };
  const detail = "A box is { x, y, width, height }, four finite numbers.";
  throw new Problem({ type: "invalid-box", status: 422, detail });
}

/** @param {import("./session.js").Box} box */
export function boxText(box) {
  return Object.values(boxOf(box)).map((side) => Number(side.toFixed(4))).join(",");
}
