// The sample clips, which the service draws.

/**
 * @typedef {object} Picture A frame as it is uploaded and as it is shown.
 * @property {Blob} blob
 * @property {ImageBitmap} bitmap
 * @property {number} time Seconds from the beginning of the video.
 *
 * @typedef {object} Source Where frames come from.
 * @property {boolean} isLive Whether it goes on by itself, so that late frames are skipped.
 * @property {() => Promise<Picture>} first The first frame.
 * @property {(deliver: (picture: Picture) => void, end: () => void) => Promise<void>} start Delivers the frames after
 *   it.
 * @property {(isHeld: boolean) => void} hold Stops delivering for a while.
 * @property {() => void} stop
 */

const FRAMES_A_SECOND = 25;
/** Frames fetched ahead. */
const AHEAD = 12;
/** How often a frame is asked for. */
const ATTEMPTS = 6;

/** @implements {Source} */
export class SampleClip {
  /** @param {string} name */
  constructor(name) {
    this.name = name;
    this.isLive = false;
    /** @type {Map<number, Promise<Picture>>} */
    this.fetched = new Map();
    this.index = 0;
    this.isHeld = false;
    this.isStopped = false;
    /** @type {number} */
    this.frames = 0;
  }

  async first() {
    const first = this.fetch(0);
    const clip = await (await fetch(`./sample/${this.name}/clip.json`)).json();
    this.frames = clip.truth.length;
    return first;
  }

  /**
   * @param {number} index
   * @returns {Promise<Picture>}
   */
  async load(index) {
    for (let attempt = 1; ; attempt += 1) {
      try {
        const response = await fetch(`./sample/${this.name}/${index}.jpg`);
        if (!response.ok) throw new Error("The sample clip cannot be loaded.");
        const blob = await response.blob();
        return { blob, bitmap: await createImageBitmap(blob), time: index / FRAMES_A_SECOND };
      } catch (error) {
        // The line may be back in a moment.
        if (attempt === ATTEMPTS) throw error;
        await new Promise((resolve) => setTimeout(resolve, 200 * attempt));
      }
    }
  }

  /** @param {number} index */
  fetch(index) {
    const known = this.fetched.get(index);
    if (known) return known;
    const loading = this.load(index);
    // Whoever waits for it is told.
    loading.catch(() => undefined);
    this.fetched.set(index, loading);
    return loading;
  }

  /**
   * @param {(picture: Picture) => void} deliver
   * @param {() => void} end
   */
  async start(deliver, end) {
    let due = performance.now();
    for (this.index = 1; this.index < this.frames && !this.isStopped; this.index += 1) {
      for (let ahead = 0; ahead < AHEAD && this.index + ahead < this.frames; ahead += 1) this.fetch(this.index + ahead);
      const picture = await this.fetch(this.index);
      this.fetched.delete(this.index);
      due = Math.max(due + 1000 / FRAMES_A_SECOND, performance.now() - 100);
      do {
        await new Promise((resolve) => setTimeout(resolve, Math.max(0, due - performance.now())));
        if (this.isHeld) due = performance.now() + 10;
      } while (this.isHeld && !this.isStopped);
      if (!this.isStopped) deliver(picture);
    }
    if (!this.isStopped) end();
  }

  /** @param {boolean} isHeld */
  hold(isHeld) {
    this.isHeld = isHeld;
  }

  stop() {
    this.isStopped = true;
  }
}
