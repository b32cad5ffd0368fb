// A source with random access to its frames: a sample clip, a folder of images, a decoded file.

/** Frames that are loaded in advance. */
const AHEAD = 12;

/** @implements {Source} */
export class Stills {
  /**
   * @param {string} name
   * @param {number} rate Frames a second.
   * @param {(index: number) => Promise<Blob>} [load] Loads the image file of a frame.
   */
  constructor(name, rate, load = async () => new Blob()) {
    this.name = name;
    this.isLive = false;
    this.size = { width: 0, height: 0 };
    /** @type {number} */
    this.rate = rate;
    this.load = load;
    /** @type {number[] | undefined} Times of the frames in seconds, ascending; undefined where the rate gives them. */
    this.times = undefined;
    this.skipped = 0;
    /** The number of frames. */
    this.count = 0;
    /** @type {Map<number, Promise<Picture | undefined>>} */
    this.loaded = new Map();
    /** The frame that was delivered last. */
    this.index = 0;
    this.isFetched = false;
    /** Whether frames come at their rate. Else they come as fast as they can be tracked, in a hidden tab too. */
    this.isPaced = false;
    this.isHeld = false;
    /** Wakes `start` when `hold` ends. */
    this.released = () => {};
    this.isStopped = false;
    /** @type {File[] | undefined} The user's files, where the frames come from such. */
    this.files = undefined;
    /** @type {string | undefined} A sentence for the message when the source is open. */
    this.note = undefined;
    /** @type {string[] | undefined} The path of each frame, where each is a file. */
    this.imageNames = undefined;
    /** @type {(() => void) | undefined} */
    this.close = undefined;
  }

  get duration() {
    return this.timeOf(this.count - 1);
  }

  /** @param {number} index */
  timeOf(index) {
    return this.times ? this.times[index] : index / this.rate;
  }

  async first() {
    return this.goTo(0);
  }

  /** @param {number} time */
  goTo(time) {
    let index = Math.min(Math.max(0, this.count - 1), Math.round(time * this.rate));
    // The rate may be a mean, so search for the nearest frame around the estimate.
    const distance = (/** @type {number} */ at) => Math.abs(this.timeOf(at) - time);
    while (index > 0 && distance(index - 1) < distance(index)) index -= 1;
    while (index + 1 < this.count && distance(index + 1) < distance(index)) index += 1;
    this.index = index;
    return this.at(index);
  }

  /** @param {number} index */
  async at(index) {
    return undamaged(await this.picture(index));
  }

  /** A frame; undefined where it is damaged, but later ones can be read.
   * @param {number} index
   * @returns {Promise<Picture | undefined>} */
  async picture(index) {
    const blob = await this.load(index);
    return { blob, image: await createImageBitmap(blob), time: this.timeOf(index), frame: index };
  }

  /** @param {number} index */
  ahead(index) {
    const known = this.loaded.get(index);
    if (known) return known;
    const loading = this.picture(index);
    // The caller that awaits `loading` gets the error.
    loading.catch(() => undefined);
    this.loaded.set(index, loading);
    return loading;
  }

  /** @type {Source["start"]} */
  async start(deliver, end) {
    let due = performance.now();
    for (let index = this.index + 1; index < this.count && !this.isStopped; index += 1) {
      for (let next = index; next < Math.min(index + AHEAD, this.count); next += 1) this.ahead(next);
      const picture = await this.ahead(index);
      this.loaded.delete(index);
      if (this.isPaced) {
        due = Math.max(due + 1000 * (this.timeOf(index) - this.timeOf(index - 1)), performance.now() - 100);
        await new Promise((resolve) => setTimeout(resolve, Math.max(0, due - performance.now())));
      }
      while (this.isHeld && !this.isStopped) await new Promise((resolve) => (this.released = () => resolve(undefined)));
      this.index = index;
      if (!picture) this.skipped += 1;
      else if (!this.isStopped) deliver(picture);
    }
    if (!this.isStopped) end();
  }

  /** @param {boolean} isHeld */
  hold(isHeld) {
    this.isHeld = isHeld;
    if (!isHeld) this.released();
  }

  stop() {
    this.isStopped = true;
    this.released();
  }
}

/** @param {Picture | undefined} picture */
export function undamaged(picture) {
  if (!picture) throw new DOMException("", "EncodingError");
  return picture;
}
