// One run: a source of frames, its session, and what the service answers.

/**
 * @typedef {import("./js/bagtrack.js").Box} Box
 * @typedef {import("./clip.js").Picture} Picture
 * @typedef {import("./js/bagtrack.js").StreamAnswer} Answer
 *
 * @typedef {object} Row What is known of one tracked frame.
 * @property {number} frame Its number in the session.
 * @property {number} time Seconds from the beginning of the video.
 * @property {Box} box
 * @property {number} score
 * @property {"tracking" | "uncertain" | "lost"} status
 * @property {boolean} corrected Whether the box was drawn.
 *
 * @typedef {object} Told
 * @property {(picture: Picture, answer: Answer) => void} answer
 * @property {(error: unknown) => void} fail
 * @property {(isUp: boolean) => void} line
 * @property {() => void} end The source has no more frames, and all are answered.
 */

/** Frames on their way at a time. */
const WINDOW = 8;
/** Answers that the rate is taken over. */
const RATE_OVER = 30;

export class Run {
  /**
   * @param {import("./js/bagtrack.js").Client} client
   * @param {import("./clip.js").Source} source
   * @param {Picture} picture The first one.
   * @param {Told} told
   */
  constructor(client, source, picture, told) {
    this.client = client;
    this.source = source;
    this.told = told;
    /** The picture that was answered last. */
    this.picture = picture;
    /** @type {Row[]} */
    this.rows = [];
    /** @type {number[]} */
    this.answeredAt = [];
    this.skipped = 0;
    this.trip = 0;
    this.sees = false;
    this.isPaused = false;
    this.isOver = false;
    this.hasAll = false;
    /** Frames without an answer. */
    this.underWay = 0;
    /** @type {import("./js/bagtrack.js").Session | undefined} */
    this.session = undefined;
    /** @type {Box | undefined} A box that was drawn, until the frames on their way are answered. */
    this.drawn = undefined;
    /** @type {import("./js/bagtrack.js").FrameStream | undefined} */
    this.stream = undefined;
  }

  /** Opens the session with the box in the first frame, and begins.
   * @param {Box} box */
  async begin(box) {
    const session = await this.client.open(this.picture.blob, box);
    this.session = session;
    if (this.isOver) return this.endSession();
    this.note({ frame: 0, box: session.box, score: 1, status: "tracking" }, this.picture, true);
    const onLine = (/** @type {boolean} */ isUp) => this.told.line(isUp);
    this.stream = session.stream({ live: this.source.isLive, window: WINDOW, patience: Infinity, onLine });
    this.stream.ended.then((problem) => problem && this.fail(problem));
    const started = this.source.start(
      (picture) => this.deliver(picture),
      () => {
        this.hasAll = true;
        this.checkEnd();
      },
    );
    started.catch((error) => this.fail(error));
  }

  /** @param {Picture} picture */
  deliver(picture) {
    const isFull = this.isPaused || this.drawn || this.underWay >= WINDOW;
    if (isFull && this.source.isLive) return this.skip(picture);
    this.send(picture, { see: this.sees });
    this.throttle();
  }

  /**
   * @param {Picture} picture
   * @param {{box?: Box, see?: boolean}} header
   */
  async send(picture, header) {
    const at = performance.now();
    this.underWay += 1;
    try {
      const answer = await this.stream?.track(picture.blob, header);
      this.underWay -= 1;
      if (answer) this.answered(answer, picture, at, header.box !== undefined);
      else this.skip(picture);
    } catch (problem) {
      this.fail(problem);
    }
  }

  /** @param {Picture} picture */
  skip(picture) {
    this.skipped += 1;
    picture.bitmap.close();
  }

  throttle() {
    this.source.hold(this.isPaused || this.drawn !== undefined || this.underWay >= WINDOW);
  }

  /**
   * @param {Answer} answer
   * @param {Picture} picture
   * @param {number} at When it was sent, in milliseconds.
   * @param {boolean} corrected
   */
  answered(answer, picture, at, corrected) {
    const now = performance.now();
    this.trip = now - at;
    this.answeredAt = [...this.answeredAt, now].slice(-RATE_OVER);
    this.picture = picture;
    this.note(answer, picture, corrected);
    this.sendDrawn();
    this.checkEnd();
  }

  /**
   * @param {Answer} answer
   * @param {Picture} picture
   * @param {boolean} corrected
   */
  note(answer, picture, corrected) {
    const { frame, box, score, status } = answer;
    this.rows.push({ frame, time: Number(picture.time.toFixed(3)), box, score, status, corrected });
    this.told.answer(picture, answer);
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
    if (box && this.underWay === 0) {
      this.drawn = undefined;
      this.send(picture, { box });
    }
    this.throttle();
  }

  checkEnd() {
    if (this.hasAll && this.underWay === 0) this.told.end();
  }

  /** @param {unknown} error */
  fail(error) {
    if (this.isOver) return;
    this.stop();
    this.told.fail(error);
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
