// The frames of a file on their way: encoded, and in their order.

import { areEqual } from "./playback.js";
import { encoded } from "./source.js";

/**
 * @typedef {{image: HTMLCanvasElement, time: number, frame: number}} Taken
 */

/** Frames that are encoded at a time. */
const MOST_ENCODING = 3;

export class Delivery {
  /** @param {() => void} changed Is told when a frame has left. */
  constructor(changed) {
    this.changed = changed;
    this.encoding = 0;
    this.isStopped = false;
    /** @type {Promise<unknown>} The frames before are delivered. */
    this.before = Promise.resolve();
    /** @type {(picture: Picture) => void} */
    this.deliver = () => undefined;
    /** @type {(error: unknown) => void} */
    this.fail = () => undefined;
    /** @type {Taken | undefined} The last frame, where its image may be that of the one after it. */
    this.doubted = undefined;
  }

  get isFull() {
    return this.encoding >= MOST_ENCODING;
  }

  /** Whether the last frame has the image of the one after it, which is this.
   * @param {HTMLCanvasElement} image */
  isAhead(image) {
    return this.doubted !== undefined && areEqual(image, this.doubted.image);
  }

  /** Adds the next frame. The one before it is in no doubt any more.
   * @param {Taken} taken
   * @param {boolean} isDoubted Whether it waits for the one after it. */
  add(taken, isDoubted) {
    this.settle();
    if (isDoubted) this.doubted = taken;
    else this.send(taken);
  }

  /** Sends the last frame, where it waits: with this image, or with its own.
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

  /** Sends what waits, and ends when all are delivered. */
  async end() {
    this.settle();
    await this.before;
  }
}
