// One run: a source of frames, the objects that are followed through them, and the answers.

import { LocalFollower, ServiceFollower, WINDOW } from "./follower.js";
import { LocalClient } from "./js/bagtrack.js";
import { FollowedObject } from "./objects.js";

/**
 * @typedef {import("./js/bagtrack.js").Box} Box
 * @typedef {import("./source.js").Picture} Picture
 * @typedef {import("./js/bagtrack.js").StreamAnswer} Answer
 * @typedef {import("./objects.js").Row} Row
 *
 * @typedef {object} Drawn A box that was drawn, until the frames on their way are answered.
 * @property {Box} box
 * @property {FollowedObject | undefined} object The one that it corrects; nothing for a new one.
 *
 * @typedef {object} Told
 * @property {(picture: Picture, answer: Answer | undefined) => void} answer A frame is answered: what was answered for the
 *   chosen object.
 * @property {(error: unknown) => void} fail
 * @property {(isUp: boolean) => void} line
 * @property {() => void} anew The service had lost a session: another one goes on from the last box.
 * @property {() => void} end The source has no more frames, and all are answered.
 */

/** Answers that the rate is taken over. */
const RATE_OVER = 30;
/** Most bytes of frames that are kept. */
const MOST_KEPT = 512 << 20;

export class Run {
  /**
   * @param {import("./js/bagtrack.js").Client | LocalClient} client Where it is tracked.
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
    /** @type {FollowedObject[]} */
    this.objects = [];
    /** @type {FollowedObject | undefined} The chosen one. */
    this.chosen = undefined;
    /** How many there were. */
    this.count = 0;
    /** @type {Map<number, {blob: Blob, time: number}>} The last frames, by their numbers in the video. */
    this.frames = new Map();
    this.bytes = 0;
    /** How many frames were tracked. */
    this.tracked = 1;
    /** @type {number[]} */
    this.answeredAt = [];
    this.passedOver = 0;
    this.trip = 0;
    this.sees = false;
    this.isPaused = false;
    this.isOver = false;
    this.isResting = false;
    this.hasAll = false;
    /** @type {{picture: Picture, at: number}[]} Frames without an answer, oldest first. */
    this.underWay = [];
    /** @type {Drawn | undefined} */
    this.drawn = undefined;
    /** Whether earlier frames are tracked anew. */
    this.isRedoing = false;
  }

  /** Frames that were not tracked. */
  get skipped() {
    return this.passedOver + this.source.skipped;
  }

  /** The last frame that was tracked. */
  get lastFrame() {
    return this.picture.frame;
  }

  /** Begins with the box in the first frame.
   * @param {Box} box */
  async begin(box) {
    await this.add(box);
    if (this.isOver) return;
    const started = this.source.start(
      (picture) => this.deliver(picture),
      () => {
        this.hasAll = true;
        this.checkEnd();
      },
    );
    started.catch((error) => this.fail(error));
  }

  /** Follows another object, from the picture that was answered last.
   * @param {Box} box */
  async add(box) {
    const object = this.newObject();
    const answer = await object.follower.open(this.picture, box);
    if (this.isOver) return object.follower.end();
    this.take(object);
    this.keep(this.picture);
    this.note(object, answer, this.picture, true);
    this.told.answer(this.picture, answer);
  }

  newObject() {
    return new FollowedObject(this.count, this.follower());
  }

  /** @param {FollowedObject} object */
  take(object) {
    this.count += 1;
    this.objects.push(object);
    this.chosen = object;
  }

  /** @param {FollowedObject} object */
  remove(object) {
    object.follower.end();
    this.objects = this.objects.filter((other) => other !== object);
    if (this.chosen === object) this.chosen = this.objects[0];
  }

  /** @returns {import("./follower.js").Follower} */
  follower() {
    const { client } = this;
    if (client instanceof LocalClient) return new LocalFollower(client);
    return new ServiceFollower(client, this.source.isLive, {
      line: (isUp) => this.told.line(isUp),
      anew: () => this.told.anew(),
      fail: (error) => this.fail(error),
    });
  }

  /** @param {Picture} picture */
  deliver(picture) {
    if (this.isFull && this.source.isLive) return this.skip(picture);
    this.send(picture);
    this.throttle();
  }

  get isFull() {
    return this.isPaused || this.isRedoing || this.drawn !== undefined || this.underWay.length >= WINDOW;
  }

  /** @param {Picture} picture */
  async send(picture) {
    const sent = { picture, at: performance.now() };
    this.underWay.push(sent);
    const objects = [...this.objects];
    const see = (/** @type {FollowedObject} */ object) => this.sees && object === this.chosen;
    try {
      const answers = await Promise.all(objects.map((it) => it.follower.track(picture, { see: see(it) })));
      this.underWay = this.underWay.filter((other) => other !== sent);
      if (objects.length > 0 && answers.every((answer) => !answer)) this.skip(picture);
      else this.answered(objects, answers, sent);
    } catch (error) {
      this.fail(error);
    }
  }

  /** @param {Picture} picture */
  skip({ image }) {
    this.passedOver += 1;
    if ("close" in image) image.close();
  }

  throttle() {
    this.source.hold(this.isFull);
  }

  /**
   * @param {FollowedObject[]} objects
   * @param {(Answer | undefined)[]} answers
   * @param {{picture: Picture, at: number}} sent
   */
  answered(objects, answers, { picture, at }) {
    if (this.isOver) return;
    const now = performance.now();
    this.trip = now - at;
    this.answeredAt = [...this.answeredAt, now].slice(-RATE_OVER);
    const before = this.picture.image;
    this.picture = picture;
    this.tracked += 1;
    this.keep(picture);
    objects.forEach((object, index) => {
      const answer = answers[index];
      if (answer && this.objects.includes(object)) this.note(object, answer, picture, false);
    });
    this.told.answer(picture, this.chosen && answers[objects.indexOf(this.chosen)]);
    // It is not shown any more.
    if (before !== picture.image && "close" in before) before.close();
    this.sendDrawn();
    this.checkEnd();
  }

  /**
   * @param {FollowedObject} object
   * @param {Answer} answer
   * @param {Picture} picture
   * @param {boolean} corrected
   */
  note(object, { box, score, status }, picture, corrected) {
    const { frame, time } = picture;
    object.note({ frame, time: Number(time.toFixed(3)), box: this.inOwnPixels(box, picture), score, status, corrected });
  }

  /** A box of the uploaded frame in the video's own pixels.
   * @param {Box} box
   * @param {Picture} picture */
  inOwnPixels(box, { image }) {
    return scaled(box, this.source.size, image);
  }

  /** Keeps a frame. The oldest ones go where there are too many.
   * @param {Picture} picture */
  keep({ frame, blob, time }) {
    this.bytes += blob.size - (this.frames.get(frame)?.blob.size ?? 0);
    this.frames.set(frame, { blob, time });
    for (const [oldest, kept] of this.frames) {
      if (this.bytes <= MOST_KEPT) break;
      this.frames.delete(oldest);
      this.bytes -= kept.blob.size;
    }
  }

  /** A frame that is kept.
   * @param {number} frame
   * @returns {Promise<Picture | undefined>} */
  async kept(frame) {
    const kept = this.frames.get(frame);
    return kept && { ...kept, frame, image: await createImageBitmap(kept.blob) };
  }

  /** What is shown of the objects in a frame.
   * @param {number} frame
   * @param {{width: number, height: number}} image
   * @returns {import("./stage.js").Shown[]} */
  shownIn(frame, image) {
    const isNamed = this.objects.length > 1;
    return this.objects.flatMap(({ rows, name, color, isShown }) => {
      const row = rows.get(frame);
      if (!row || !isShown) return [];
      const box = scaled(row.box, image, this.source.size);
      return [{ box, color, name: isNamed ? name : "", isLost: row.status === "lost" }];
    });
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

  /** The user drew a box in the picture that is shown: for an object, or for a new one.
   * @param {Box} box
   * @param {FollowedObject | undefined} object */
  draw(box, object) {
    this.drawn = { box, object };
    this.sendDrawn();
  }

  async sendDrawn() {
    const { drawn, picture } = this;
    if (!drawn || this.underWay.length > 0) return this.throttle();
    const { box, object } = drawn;
    const sent = { picture, at: performance.now() };
    this.underWay.push(sent);
    this.drawn = undefined;
    try {
      if (!object) await this.add(box);
      const answer = await object?.follower.track(picture, { box });
      if (object && answer) {
        this.note(object, answer, picture, true);
        this.told.answer(picture, answer);
      }
    } catch (error) {
      this.fail(error);
    }
    this.underWay = this.underWay.filter((other) => other !== sent);
    this.throttle();
    this.checkEnd();
  }

  /**
   * Follows an object anew, from a box in an earlier frame up to the last one.
   * @param {FollowedObject | undefined} known Nothing for a new one.
   * @param {number} frame
   * @param {Box} box
   * @param {(frame: number) => void} tell Is told of each frame.
   */
  async redo(known, frame, box, tell) {
    this.isRedoing = true;
    this.throttle();
    const object = known ?? this.newObject();
    try {
      while (this.underWay.length > 0) await new Promise(requestAnimationFrame);
      const from = await object.goBackBefore(frame, this.follower());
      object.forgetFrom(frame);
      for (const number of [...this.frames.keys()].sort((a, b) => a - b)) {
        if (this.isOver || number < (from === undefined ? frame : from + 1)) continue;
        const picture = /** @type {Picture} */ (await this.kept(number));
        const isDrawn = number === frame;
        const isFirst = isDrawn && from === undefined;
        const { follower } = object;
        const answer = await (isFirst ? follower.open(picture, box) : follower.track(picture, isDrawn ? { box } : {}));
        if (!this.objects.includes(object)) this.take(object);
        if (answer && number >= frame) this.note(object, answer, picture, isDrawn);
        else if (answer) object.frames.push(number);
        if ("close" in picture.image) picture.image.close();
        tell(number);
      }
      if (this.isResting) object.follower.end();
    } finally {
      this.isRedoing = false;
      this.throttle();
    }
    this.checkEnd();
  }

  checkEnd() {
    const isBusy = this.underWay.length > 0 || this.drawn || this.isRedoing;
    if (this.hasAll && !isBusy && !this.isResting) this.told.end();
  }

  /** @param {unknown} error */
  fail(error) {
    if (this.isOver) return;
    this.stop();
    this.told.fail(error);
  }

  stop() {
    this.isOver = true;
    this.rest();
  }

  /** Takes no more frames. Those that are kept can be tracked anew. */
  rest() {
    this.isResting = true;
    this.source.stop();
    this.objects.forEach(({ follower }) => follower.end());
  }
}

/** A box in pixels of another size of the same picture.
 * @param {Box} box
 * @param {{width: number, height: number}} to
 * @param {{width: number, height: number}} from */
export function scaled(box, to, from) {
  if (to.width === from.width && to.height === from.height) return box;
  const [across, down] = [to.width / from.width, to.height / from.height];
  const rounded = (/** @type {number} */ value) => Number(value.toFixed(2));
  const [x, y] = [rounded(box.x * across), rounded(box.y * down)];
  return { x, y, width: rounded(box.width * across), height: rounded(box.height * down) };
}
