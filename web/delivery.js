// Encodes the frames of a played file as JPEG, several at a time, and delivers them in order.

import { areEqual } from "./playback.js";
import { encoded } from "./source.js";

/**
 * @typedef {{image: HTMLCanvasElement, time: number, frame: number}} Taken
 */

/** Most frames that are encoded at the same time. */
const MOST_ENCODING = 3;

export class Delivery {
  /** @param {() => void} changed Called when a frame was delivered. */
  constructor(changed) {
    this.changed = changed;
    this.encoding = 0;
    this.isStopped = false;
    /** @type {Promise<unknown>} Resolves when all frames so far are delivered. */
    this.before = Promise.resolve();
    /** @type {(picture: Picture) => void} */
    this.deliver = () => undefined;
    /** @type {(error: unknown) => void} */
    this.fail = () => undefined;
    /** @type {Taken | undefined} The last frame, held back while its image may be that of the frame after it. */
    this.doubted = undefined;
  }

  get isFull() {
    return this.encoding >= MOST_ENCODING;
  }

  /** Whether the frame that is held back has this image, which is that of the frame after it.
   * @param {HTMLCanvasElement} image */
  isAhead(image) {
    return this.doubted !== undefined && areEqual(image, this.doubted.image);
  }

  /** Adds the next frame, and sends the one that was held back.
   * @param {Taken} taken
   * @param {boolean} isDoubted Whether to hold it back until the next frame comes. */
  add(taken, isDoubted) {
    this.settle();
    if (isDoubted) this.doubted = taken;
    else this.send(taken);
  }

  /** Sends the frame that is held back, if any: with this image, or else with its own.
   * @param {HTMLCanvasElement} [image] */
  settle(image) {
    const { doubted } = this;
    this.doubted = undefined;
    if (doubted) this.send({ ...doubted, image: image ?? doubted.image });
  }

  /** @param {Taken} taken */
  send({ image, time, frame }) {
    this.encoding += 1;
    const blob = encoded(image);
    this.before = this.before.then(async () => {
      const picture = { image, blob: await blob, time, frame };
      this.encoding -= 1;
      if (this.isStopped) return;
      this.deliver(picture);
      this.changed();
    });
    this.before.catch((error) => this.fail(error));
  }

  /** Sends the frame that is held back, and resolves when all frames are delivered. */
  async end() {
    this.settle();
    await this.before;
  }
}
