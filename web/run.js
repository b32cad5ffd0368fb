// One run: a source of frames, its session, and what the service answers.

import { LocalClient, LocalStream, Problem } from "./js/bagtrack.js";

/**
 * @typedef {import("./js/bagtrack.js").Box} Box
 * @typedef {import("./source.js").Picture} Picture
 * @typedef {import("./js/bagtrack.js").StreamAnswer} Answer
 *
 * @typedef {object} Row What is known of one tracked frame.
 * @property {number} frame Its number in the video.
 * @property {number} time Seconds from the beginning of the video.
 * @property {Box} box In the video's own pixels.
 * @property {number} score
 * @property {"tracking" | "uncertain" | "lost"} status
 * @property {boolean} corrected Whether the box was drawn.
 *
 * @typedef {object} Sent A frame without an answer.
 * @property {Picture} picture
 * @property {{box?: Box, see?: boolean}} header
 * @property {number} at When it was sent, in milliseconds.
 *
 * @typedef {object} Told
 * @property {(picture: Picture, answer: Answer) => void} answer
 * @property {(error: unknown) => void} fail
 * @property {(isUp: boolean) => void} line
 * @property {() => void} anew The service had lost the session: another one goes on from the last box.
 * @property {() => void} end The source has no more frames, and all are answered.
 */

/** Frames on their way at a time. */
const WINDOW = 8;
/** Answers that the rate is taken over. */
const RATE_OVER = 30;
/** Most bytes of frames that are kept for the video with the boxes. */
const MOST_KEPT = 512 << 20;

export class Run {
  /**
   * @param {import("./js/bagtrack.js").Client | import("./js/bagtrack.js").LocalClient} client Where it is tracked.
   * @param {import("./source.js").Source} source
   * @param {Picture} picture The first one.
   * @param {Told} told
   */
  constructor(client, source, picture, told) {
    this.client = client;
    this.source = source;
    this.told = told;
    /** The picture that was answered last. */
    this.picture = picture;
    /** @type {Box | undefined} The box in it, in its pixels. */
    this.box = undefined;
    /** @type {Row[]} */
    this.rows = [];
    /** @type {Map<number, Blob>} The frames of the last rows, by their numbers. */
    this.frames = new Map();
    this.bytes = 0;
    /** @type {number[]} */
    this.answeredAt = [];
    this.passedOver = 0;
    this.trip = 0;
    this.sees = false;
    this.isPaused = false;
    this.isOver = false;
    this.hasAll = false;
    /** @type {Sent[]} Oldest first. */
    this.underWay = [];
    /** @type {import("./js/bagtrack.js").Session | import("./js/bagtrack.js").LocalSession | undefined} */
    this.session = undefined;
    /** Whether the session has answered. */
    this.hasAnswered = false;
    /** @type {Box | undefined} A box that was drawn, until the frames on their way are answered. */
    this.drawn = undefined;
    /** @type {import("./js/bagtrack.js").FrameStream | LocalStream | undefined} */
    this.stream = undefined;
  }

  /** Frames that were not tracked. */
  get skipped() {
    return this.passedOver + this.source.skipped;
  }

  /** Opens the session with the box in the first frame, and begins.
   * @param {Box} box */
  async begin(box) {
    const session = await this.open(box);
    if (!session) return;
    this.note({ frame: 0, box: session.box, score: 1, status: "tracking" }, this.picture, true);
    const started = this.source.start(
      (picture) => this.deliver(picture),
      () => {
        this.hasAll = true;
        this.checkEnd();
      },
    );
    started.catch((error) => this.fail(error));
  }

  /** Opens a session with the box in the picture that was answered last.
   * @param {Box} box */
  async open(box) {
    // In the page the frame is tracked as it is shown, with the service as it is uploaded.
    const { client, picture } = this;
    const isHere = client instanceof LocalClient;
    const session = await (isHere ? client.open(picture.image, box) : client.open(picture.blob, box));
    this.session = session;
    this.hasAnswered = false;
    if (this.isOver) {
      this.endSession();
      return undefined;
    }
    const onLine = (/** @type {boolean} */ isUp) => this.told.line(isUp);
    const stream = session.stream({ live: this.source.isLive, window: WINDOW, patience: Infinity, onLine });
    this.stream = stream;
    stream.ended.then((problem) => problem && this.stream === stream && this.fail(problem));
    return session;
  }

  /** @param {Picture} picture */
  deliver(picture) {
    const isFull = this.isPaused || this.drawn || this.underWay.length >= WINDOW;
    if (isFull && this.source.isLive) return this.skip(picture);
    this.send(picture, { see: this.sees });
    this.throttle();
  }

  /**
   * @param {Picture} picture
   * @param {{box?: Box, see?: boolean}} header
   */
  send(picture, header) {
    const sent = { picture, header, at: performance.now() };
    this.underWay.push(sent);
    this.transmit(sent);
  }

  /** @param {Sent} sent */
  async transmit(sent) {
    const { stream } = this;
    if (!stream) return;
    try {
      const { image, blob } = sent.picture;
      const isHere = stream instanceof LocalStream;
      const answer = await (isHere ? stream.track(image, sent.header) : stream.track(blob, sent.header));
      if (this.stream !== stream) return;
      this.underWay = this.underWay.filter((other) => other !== sent);
      if (answer) this.answered(answer, sent);
      else this.skip(sent.picture);
    } catch (problem) {
      if (this.stream === stream) this.fail(problem);
    }
  }

  /** @param {Picture} picture */
  skip({ image }) {
    this.passedOver += 1;
    if ("close" in image) image.close();
  }

  throttle() {
    this.source.hold(this.isPaused || this.drawn !== undefined || this.underWay.length >= WINDOW);
  }

  /**
   * @param {Answer} answer
   * @param {Sent} sent
   */
  answered(answer, { picture, header, at }) {
    const now = performance.now();
    this.trip = now - at;
    this.answeredAt = [...this.answeredAt, now].slice(-RATE_OVER);
    this.picture = picture;
    this.hasAnswered = true;
    this.note(answer, picture, header.box !== undefined);
    this.sendDrawn();
    this.checkEnd();
  }

  /**
   * @param {Answer} answer
   * @param {Picture} picture
   * @param {boolean} corrected
   */
  note({ box, score, status, ...rest }, picture, corrected) {
    this.box = box;
    const { frame, time } = picture;
    // A corrected frame was answered before.
    if (this.rows.at(-1)?.frame === frame) this.rows.pop();
    this.rows.push({ frame, time: Number(time.toFixed(3)), box: this.inOwnPixels(box), score, status, corrected });
    this.keep(frame, picture.blob);
    this.told.answer(picture, { box, score, status, ...rest });
  }

  /** A box of the uploaded frame in the video's own pixels.
   * @param {Box} box */
  inOwnPixels(box) {
    const { image } = this.picture;
    const { width, height } = this.source.size;
    if (image.width === width && image.height === height) return box;
    const [across, down] = [width / image.width, height / image.height];
    const rounded = (/** @type {number} */ value) => Number(value.toFixed(2));
    return {
      x: rounded(box.x * across),
      y: rounded(box.y * down),
      width: rounded(box.width * across),
      height: rounded(box.height * down),
    };
  }

  /** Keeps a frame for the video with the boxes. The oldest ones go where there are too many.
   * @param {number} frame
   * @param {Blob} blob */
  keep(frame, blob) {
    this.bytes += blob.size - (this.frames.get(frame)?.size ?? 0);
    this.frames.set(frame, blob);
    for (const [oldest, { size }] of this.frames) {
      if (this.bytes <= MOST_KEPT) break;
      this.frames.delete(oldest);
      this.bytes -= size;
    }
  }

  /** Frames a second, of the last answers. */
  get rate() {
    const times = this.answeredAt;
    if (times.length < 2) return 0;
    return ((times.length - 1) * 1000) / (times[times.length - 1] - times[0]);
  }

  /** @param {boolean} isPaused */
  pause(isPaused) {
    this.isPaused = isPaused;
    this.throttle();
  }

  /** The user drew another box in the picture that is shown: it is sent once more, with the box.
   * @param {Box} box */
  correct(box) {
    this.drawn = box;
    this.sendDrawn();
  }

  sendDrawn() {
    const { drawn: box, picture } = this;
    if (box && this.underWay.length === 0) {
      this.drawn = undefined;
      this.send(picture, { box });
    }
    this.throttle();
  }

  checkEnd() {
    if (this.hasAll && this.underWay.length === 0 && !this.drawn) this.told.end();
  }

  /** @param {unknown} error */
  fail(error) {
    if (this.isOver) return;
    // Such as a service with other keys after its restart, which does not take the session's snapshot.
    if (error instanceof Problem && error.isGone && this.hasAnswered) return void this.goOn();
    this.stop();
    this.told.fail(error);
  }

  /** Goes on in another session, from the last picture and its box. */
  async goOn() {
    this.stream = undefined;
    this.hasAnswered = false;
    try {
      if (!this.box || !(await this.open(this.box))) return;
      this.told.anew();
      this.underWay.forEach((sent) => this.transmit(sent));
    } catch (error) {
      this.fail(error);
    }
  }

  stop() {
    if (this.isOver) return;
    this.isOver = true;
    this.source.stop();
    this.stream?.close();
    this.endSession();
  }

  endSession() {
    // One that cannot be ended expires.
    this.session?.end().catch(() => undefined);
  }
}
