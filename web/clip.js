// The sample clips, which the service draws.

/**
 * @typedef {import("./source.js").Picture} Picture
 * @typedef {import("./source.js").Source} Source
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
    this.size = { width: 0, height: 0 };
    this.rate = FRAMES_A_SECOND;
    this.skipped = 0;
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
    this.size = { width: clip.width, height: clip.height };
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
        return { blob, image: await createImageBitmap(blob), time: index / FRAMES_A_SECOND, frame: index };
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
