// What is kept of a session, so that frames can be sent again, and the whole session be opened again.

/**
 * @typedef {object} Origin What opens the session again, as it was at a frame or later.
 * @property {number} frame
 * @property {import("./transport.js").Request} request
 *
 * @typedef {object} KeptFrame A frame that was sent or is to be sent.
 * @property {number} number
 * @property {Uint8Array<ArrayBuffer>} frame
 * @property {import("./session.js").Box} [box] Where the user corrected it.
 */

/** Most frames that are kept. */
export const MOST_KEPT = 256;
export const SNAPSHOT = "application/vnd.bagtrack.snapshot";

/** The request that goes on where a snapshot was taken.
 * @param {Uint8Array<ArrayBuffer>} snapshot
 * @returns {import("./transport.js").Request} */
export function restoring(snapshot) {
  return { body: snapshot, type: SNAPSHOT };
}

export class Kept {
  /** @param {Origin} [origin] */
  constructor(origin) {
    /** While there is one, all frames after it are kept. */
    this.origin = origin;
    /** @type {KeptFrame[]} Oldest first, without gaps. */
    this.frames = [];
  }

  /** The number of the newest frame. */
  get last() {
    return this.frames.at(-1)?.number;
  }

  /** @param {number} number */
  find(number) {
    return this.frames.find((kept) => kept.number === number);
  }

  /** Keeps the next frame. The oldest goes where there are too many.
   * @param {KeptFrame} kept */
  put(kept) {
    this.frames.push(kept);
    if (this.frames.length <= MOST_KEPT) return;
    this.frames.shift();
    this.origin = undefined;
  }

  /** A newer origin; the frames up to there are not needed any more.
   * @param {Origin} origin */
  renew(origin) {
    this.forgetUntil(origin.frame);
    this.origin = origin;
  }

  /** Forgets the frames up to this one, which the service does not ask for again.
   * @param {number} number */
  forgetUntil(number) {
    this.frames = this.frames.filter((kept) => kept.number > number);
    if (this.origin && this.origin.frame < number) this.origin = undefined;
  }

  /** Forgets the frames after this one, which the service does not have.
   * @param {number} number */
  forgetAfter(number) {
    this.frames = this.frames.filter((kept) => kept.number <= number);
  }

  /** The frames after this one.
   * @param {number} number */
  after(number) {
    return this.frames.filter((kept) => kept.number > number);
  }
}
