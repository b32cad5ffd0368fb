// One run: a source of frames, its session, and what the service answers.

import { endSession, openSession } from "./api.js";
import { FrameStream } from "./stream.js";

/**
 * @typedef {import("./api.js").Box} Box
 * @typedef {import("./clip.js").Picture} Picture
 * @typedef {import("./stream.js").Answer} Answer
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
   * @param {import("./clip.js").Source} source
   * @param {Picture} picture The first one.
   * @param {Told} told
   */
  constructor(source, picture, told) {
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
    this.id = "";
    /** @type {Box | undefined} A box that was drawn, until the frames on their way are answered. */
    this.drawn = undefined;
    /** @type {FrameStream | undefined} */
    this.stream = undefined;
  }

  /** Opens the session with the box in the first frame, and begins.
   * @param {Box} box */
  async begin(box) {
    const created = await openSession(this.picture.blob, box);
    this.id = created.id;
    if (this.isOver) return void endSession(this.id);
    this.note({ frame: 0, box: created.box, score: 1, status: "tracking" }, this.picture, true);
    this.stream = new FrameStream(created.id, this.source.isLive, {
      answer: (answer, sent) => this.answered(answer, sent),
      skip: (sent) => this.skip(sent.what),
      fail: (problem) => this.fail(problem),
      line: (isUp) => this.told.line(isUp),
    });
    await this.stream.open();
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
    const stream = this.stream;
    if (!stream || this.isPaused || this.drawn || stream.unanswered.length >= WINDOW) {
      if (this.source.isLive) return this.skip(picture);
    }
    stream?.send({ blob: picture.blob, at: performance.now(), see: this.sees, what: picture });
    this.throttle();
  }

  /** @param {Picture} picture */
  skip(picture) {
    this.skipped += 1;
    picture.bitmap.close();
  }

  throttle() {
    const waiting = this.stream?.unanswered.length ?? 0;
    this.source.hold(this.isPaused || this.drawn !== undefined || waiting >= WINDOW);
  }

  /**
   * @param {Answer} answer
   * @param {import("./stream.js").Sent} sent
   */
  answered(answer, sent) {
    const now = performance.now();
    this.trip = now - sent.at;
    this.answeredAt = [...this.answeredAt, now].slice(-RATE_OVER);
    this.picture = sent.what;
    this.note(answer, sent.what, sent.box !== undefined);
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
    const { stream, drawn: box, picture } = this;
    if (box && stream?.unanswered.length === 0) {
      this.drawn = undefined;
      stream.send({ blob: picture.blob, box, at: performance.now(), what: picture });
    }
    this.throttle();
  }

  checkEnd() {
    if (this.hasAll && this.stream?.unanswered.length === 0) this.told.end();
  }

  /** @param {unknown} error */
  fail(error) {
    this.stop();
    this.told.fail(error);
  }

  stop() {
    if (this.isOver) return;
    this.isOver = true;
    this.source.stop();
    this.stream?.end();
    if (this.id) endSession(this.id);
  }
}
