// Decodes single frames of a file. Frames are numbered in the order of display, samples in that of decoding.

/** Most samples in the decoder's queue. */
const MOST_QUEUED = 4;
/** Bytes of the file that are read at a time. */
const READ_AHEAD = 1 << 20;

/** Maps frames to the samples of an index, and times in microseconds to frames. */
export class FrameNumbers {
  /** @param {Index} index */
  constructor({ times, keys, shown }) {
    const samples = Array.from(times.keys()).filter((sample) => shown[sample]);
    this.samples = samples.sort((one, other) => times[one] - times[other]);
    this.numbers = new Map(this.samples.map((sample, number) => [times[sample], number]));
    let key = keys.indexOf(1);
    /** For each sample, the last key frame up to it: decoding must begin there. */
    this.keyOf = Array.from(keys, (isKey, sample) => (key = isKey ? sample : key));
    /** The time of each frame, in seconds. */
    this.times = this.samples.map((sample) => times[sample] / 1e6);
  }
}

export class FrameDecoder {
  /**
   * @param {File} file
   * @param {Index} index
   * @param {FrameNumbers} frames
   */
  constructor(file, index, frames) {
    this.file = file;
    this.index = index;
    this.frames = frames;
    /** @type {VideoDecoder | undefined} */
    this.decoder = undefined;
    /** @type {Error | undefined} */
    this.failure = undefined;
    /** The sample that is decoded next. */
    this.next = 0;
    /** The number of the last frame that came out. */
    this.last = -1;
    this.wanted = 0;
    /** @type {Map<number, VideoFrame>} Frames that came out before they were wanted. */
    this.ready = new Map();
    /** Wakes `step`: the decoder has given a frame, taken a sample, or failed. */
    this.changed = () => {};
    /** @type {Promise<unknown>} Settles when the frame that was asked for before is decoded. */
    this.before = Promise.resolve();
    /** The part of the file that was read last, and its offset. */
    this.part = { begin: 0, bytes: new Uint8Array() };
  }

  /** A frame; undefined where the decoder skips it. Fast where the last call was for the frame before.
   * @param {number} number
   * @returns {Promise<VideoFrame | undefined>} The caller closes it. */
  at(number) {
    const asked = this.before.then(() => this.decode(number));
    this.before = asked.catch(() => undefined);
    return asked;
  }

  /** @param {number} number */
  async decode(number) {
    const sample = this.frames.samples[number];
    const key = this.frames.keyOf[sample];
    this.wanted = number;
    this.drop(number);
    const isAhead = this.decoder?.state === "configured" && number > this.last && key <= this.next;
    if (!this.ready.has(number) && !isAhead) this.begin(key);
    while (!this.ready.has(number) && this.last < number) await this.step();
    const frame = this.ready.get(number);
    this.ready.delete(number);
    return frame;
  }

  /** Starts a new decoder at a key frame.
   * @param {number} sample */
  begin(sample) {
    this.close();
    const decoder = new VideoDecoder({
      output: (frame) => decoder === this.decoder && this.keep(frame),
      error: (error) => {
        this.failure = error;
        this.changed();
      },
    });
    decoder.ondequeue = () => this.changed();
    const { codec, description } = this.index;
    decoder.configure({ codec, description });
    [this.decoder, this.failure, this.next, this.last] = [decoder, undefined, sample, -1];
  }

  /** Gives the decoder a sample, or waits until it can take one. */
  async step() {
    const { decoder } = this;
    if (!decoder || this.failure) throw new DOMException("", "EncodingError");
    if (this.next === this.index.sizes.length) {
      await decoder.flush().catch(() => undefined);
      // After a flush the decoder accepts a key frame only, so `decode` has to begin anew.
      this.last = Infinity;
    } else if (decoder.decodeQueueSize < MOST_QUEUED) {
      const chunk = await this.chunk(this.next);
      if (decoder.state === "configured") decoder.decode(chunk);
      this.next += 1;
    } else {
      await new Promise((resolve) => (this.changed = () => resolve(undefined)));
    }
  }

  /** @param {VideoFrame} frame */
  keep(frame) {
    const number = this.frames.numbers.get(frame.timestamp);
    if (number === undefined || number < this.wanted) frame.close();
    else this.ready.set(number, frame);
    this.last = Math.max(this.last, number ?? -1);
    this.changed();
  }

  /** Closes the decoded frames before this number.
   * @param {number} number */
  drop(number) {
    for (const [early, frame] of this.ready) {
      if (early >= number) continue;
      frame.close();
      this.ready.delete(early);
    }
  }

  /** @param {number} sample */
  async chunk(sample) {
    const { offsets, sizes, times, keys } = this.index;
    const [offset, size] = [offsets[sample], sizes[sample]];
    let from = offset - this.part.begin;
    if (from < 0 || from + size > this.part.bytes.length) {
      const blob = this.file.slice(offset, offset + Math.max(size, READ_AHEAD));
      this.part = { begin: offset, bytes: new Uint8Array(await blob.arrayBuffer()) };
      from = 0;
    }
    const data = this.part.bytes.subarray(from, from + size);
    return new EncodedVideoChunk({ type: keys[sample] ? "key" : "delta", timestamp: times[sample], data });
  }

  close() {
    this.drop(Infinity);
    if (this.decoder && this.decoder.state !== "closed") this.decoder.close();
    this.decoder = undefined;
  }
}
