// The frames that were tracked: the times of all, the pictures of the last `MOST_BYTES`.

import { GONE, isReadable } from "./problems.js";

/** Most bytes of encoded pictures that are kept. */
const MOST_BYTES = 512 << 20;

/** The number of answers that the rate is averaged over. */
const RATE_OVER = 30;

export class Frames {
  /** @param {Source} source */
  constructor(source) {
    this.source = source;
    /** @type {Map<number, number>} Seconds from the beginning of the video, by frame number. */
    this.times = new Map();
    /** @type {Map<number, Blob>} */
    this.blobs = new Map();
    this.bytes = 0;
    /** Called when a picture cannot be read. */
    this.failed = (/** @type {unknown} */ _) => {};
  }

  /** All numbers, ascending. */
  get numbers() {
    return [...this.times.keys()].sort((one, other) => one - other);
  }

  /** The numbers of the frames that can be shown: the picture is kept, or the source can read it again. */
  get shown() {
    return this.source.at ? this.numbers : this.numbers.filter((frame) => this.blobs.has(frame));
  }

  /** Keeps a frame. Drops the oldest pictures over `MOST_BYTES`.
   * @param {Picture} picture */
  keep({ frame, blob, time }) {
    this.times.set(frame, time);
    this.bytes += blob.size - (this.blobs.get(frame)?.size ?? 0);
    this.blobs.set(frame, blob);
    for (const [oldest, kept] of this.blobs) {
      if (this.bytes <= MOST_BYTES) break;
      this.blobs.delete(oldest);
      this.bytes -= kept.size;
    }
  }

  /** Removes a frame that no object has a row of.
   * @param {number} frame */
  forget(frame) {
    this.bytes -= this.blobs.get(frame)?.size ?? 0;
    this.blobs.delete(frame);
    this.times.delete(frame);
  }

  /** The picture of a frame; undefined for a frame that was not tracked, or whose picture nobody has.
   * @param {number} frame */
  async at(frame) {
    const [time, blob] = [this.times.get(frame), this.blobs.get(frame)];
    if (time === undefined) return undefined;
    if (!blob) return this.read(frame, time);
    const image = await createImageBitmap(blob).catch(async (error) => {
      // The blob may be a file of the user, which was removed since.
      return this.fail((await isReadable(blob)) ? error : GONE);
    });
    return { blob, time, frame, image };
  }

  /** @param {number} frame
   * @param {number} time */
  read(frame, time) {
    return this.source.at?.(frame, time).catch((error) => this.fail(error));
  }

  /** @param {unknown} error
   * @returns {never} */
  fail(error) {
    this.failed(error);
    throw error;
  }

  /** The picture before a frame: of the nearest earlier tracked frame, or else from the source.
   * @param {number} frame */
  async before(frame) {
    const { numbers, source } = this;
    const known = numbers.filter((number) => number < frame).pop();
    if (known !== undefined) return this.at(known);
    const time = this.times.get(frame);
    if (frame < 1 || !source.at || !source.rate || time === undefined) return undefined;
    return this.read(frame - 1, Math.max(0, time - 1 / source.rate));
  }
}

/** How fast frames are answered. */
export class Pace {
  constructor() {
    /** @type {number[]} */
    this.times = [];
    /** Milliseconds from sending the last frame to its answer. */
    this.trip = 0;
  }

  /** @param {number} sent When the frame was sent, by `performance.now()`. */
  answered(sent) {
    const now = performance.now();
    this.trip = now - sent;
    this.times = [...this.times, now].slice(-RATE_OVER);
  }

  /** Frames a second, averaged over the last answers. */
  get rate() {
    const { times } = this;
    if (times.length < 2) return 0;
    return ((times.length - 1) * 1000) / (times[times.length - 1] - times[0]);
  }
}

/** @param {Picture} picture */
export function close({ image }) {
  if ("close" in image) image.close();
}
