// One run: a source of frames, the objects that are followed through them, and the answers.

import { rowOf } from "./boxes.js";
import { sendDrawn } from "./drawn.js";
import { WINDOW, followerOf } from "./follower.js";
import { Frames, Pace, close } from "./frames.js";
import { LocalClient } from "./js/local.js";
import { FollowedObject } from "./objects.js";
import { isUnreadable } from "./problems.js";

export class Run {
  /**
   * @param {Client | LocalClient} client Where it is tracked.
   * @param {Source} source
   * @param {Picture} picture The first one.
   * @param {RunTold} told
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
    this.frames = new Frames(source);
    this.frames.failed = (error) => this.lose(error);
    /** How many frames were tracked. */
    this.tracked = 1;
    this.pace = new Pace();
    this.passedOver = 0;
    this.sees = false;
    this.isPaused = false;
    this.isOver = false;
    this.isResting = false;
    this.hasAll = false;
    /** @type {unknown} What keeps the source from giving more frames. */
    this.failure = undefined;
    /** @type {{picture: Picture, at: number}[]} Frames without an answer, oldest first. */
    this.underWay = [];
    /** @type {import("./drawn.js").Drawn | undefined} */
    this.drawn = undefined;
    /** @type {(() => Promise<void>) | undefined} Goes on with a run that was brought back, or stopped. */
    this.wake = undefined;
    /** Whether earlier frames are tracked anew. */
    this.isRedoing = false;
  }

  /** Whether its files are gone or were changed: they are to be chosen again. */
  get isGone() {
    return isUnreadable(this.failure);
  }

  get isLocal() {
    return this.client instanceof LocalClient;
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
    if (!this.isResting) this.play();
  }

  /** Takes the frames after the last one. */
  play() {
    this.isResting = false;
    sendDrawn(this);
    const end = () => {
      this.hasAll = true;
      this.checkEnd();
    };
    const { source } = this;
    source.start((picture) => this.deliver(picture), end).catch((error) => {
      if (source !== this.source) return;
      this.failure = error;
      this.checkEnd();
    });
  }

  /** Follows another object, from the picture that was answered last.
   * @param {Box} box */
  async add(box) {
    const { picture } = this;
    const object = this.newObject();
    const answer = await object.follower.open(picture, box);
    if (this.isOver) return object.follower.end();
    this.take(object);
    this.frames.keep(picture);
    this.note(object, answer, picture, true);
    this.leaveSessions();
    this.told.answer(picture, answer);
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
    if (this.drawn?.object === object) this.drawn = undefined;
    this.throttle();
  }

  follower() {
    return followerOf(this);
  }

  /** @param {Picture} picture */
  deliver(picture) {
    if (this.isFull && this.source.isLive) return this.skip(picture);
    this.send(picture);
    this.throttle();
  }

  /** Whether there is nothing to follow: frames wait for a box. Those of a camera do not, one draws in what it sees. */
  get wantsObject() {
    return this.objects.length === 0 && !this.source.isLive;
  }

  get isFull() {
    const hasBox = this.drawn !== undefined && !this.drawn.isSent;
    return this.isPaused || this.isRedoing || hasBox || this.wantsObject || this.underWay.length >= WINDOW;
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
      // It was on its way when the sessions were ended, and comes again where one goes on.
      if (this.isResting && answers.some((answer) => !answer)) return close(picture);
      // Those on their way when the last object is deleted are before the next box.
      const isSkipped = objects.length > 0 && !this.wantsObject && answers.every((answer) => !answer);
      if (isSkipped) {
        this.skip(picture);
        sendDrawn(this);
      } else this.answered(objects, answers, sent);
    } catch (error) {
      this.underWay = this.underWay.filter((other) => other !== sent);
      this.fail(error);
    }
  }

  /** @param {Picture} picture */
  skip(picture) {
    this.passedOver += 1;
    close(picture);
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
    this.pace.answered(at);
    const before = this.picture;
    this.picture = picture;
    this.tracked += 1;
    this.frames.keep(picture);
    objects.forEach((object, index) => {
      const answer = answers[index];
      if (answer && this.objects.includes(object)) this.note(object, answer, picture, false);
    });
    this.told.answer(picture, this.chosen && answers[objects.indexOf(this.chosen)]);
    // It is not shown any more.
    if (before.image !== picture.image) close(before);
    sendDrawn(this);
    this.checkEnd();
  }

  /**
   * @param {FollowedObject} object
   * @param {Answer} answer
   * @param {Picture} picture
   * @param {boolean} corrected
   */
  note(object, answer, picture, corrected) {
    object.note(rowOf(answer, picture, this.source.size, corrected));
  }

  /** @param {boolean} isPaused */
  pause(isPaused) {
    this.isPaused = isPaused;
    this.throttle();
  }

  /** The user drew a box in the picture that is shown: for an object, or for a new one.
   * @param {Box} box
   * @param {FollowedObject | undefined} object
   * @param {() => void} sending Is told as it is sent.
   * @param {() => void} refused Is told where the tracker does not take it. */
  draw(box, object, sending, refused) {
    this.drawn = { box, object, sending, refused };
    sendDrawn(this);
  }

  /** Tracks frames again while no other ones are tracked.
   * @param {() => Promise<void>} track */
  async alone(track) {
    // One may go on while a box is still followed that was drawn before.
    while (this.isRedoing) await new Promise(requestAnimationFrame);
    this.isRedoing = true;
    this.throttle();
    try {
      while (this.underWay.length > 0) await new Promise(requestAnimationFrame);
      await track();
    } finally {
      this.isRedoing = false;
      this.leaveSessions();
      if (this.isResting) this.throttle();
      else sendDrawn(this);
      this.checkEnd();
    }
  }

  checkEnd() {
    const isBusy = this.underWay.length > 0 || this.drawn || this.isRedoing;
    if (isBusy || this.isResting) return;
    if (this.hasAll) this.told.end();
    else if (this.failure) this.end();
  }

  /** The source has no more frames that can be had: those before are kept. */
  end() {
    this.rest();
    if (this.source.isFetched || this.isGone) this.told.rest(this.failure);
    else this.told.fail(this.failure);
  }

  /** The picture of an earlier frame cannot be had. A file that is gone has no more frames, either.
   * @param {unknown} error */
  lose(error) {
    if (this.isOver || !isUnreadable(error)) return;
    this.failure = error;
    if (!this.isResting) this.checkEnd();
    else if (this.wake) this.told.rest(error);
    else this.told.fail(error);
  }

  /** @param {unknown} error */
  fail(error) {
    if (this.isOver || this.isResting) return;
    this.rest();
    this.told.rest(error);
  }

  stop() {
    this.isOver = true;
    this.rest();
    this.objects.forEach(({ follower }) => follower.end());
    this.source.close?.();
  }

  /** Takes no more frames. Those that are kept can be tracked anew, and the sessions be handed over. */
  rest() {
    this.isResting = true;
    this.source.stop();
    this.leaveSessions();
  }

  /** Ends the service's sessions of a run that takes no more frames. One that goes on opens others. */
  leaveSessions() {
    if (this.isResting && !this.isLocal) this.objects.forEach(({ follower }) => follower.end());
  }
}
