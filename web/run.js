// One run: a source of frames, the objects that are followed through them, and the tracker's answers.

import { rowOf } from "./boxes.js";
import { sendDrawn } from "./drawn.js";
import { WINDOW, followerOf } from "./follower.js";
import { Frames, Pace, close } from "./frames.js";
import { LocalClient } from "./js/local.js";
import { FollowedObject } from "./objects.js";
import { isUnreadable } from "./problems.js";

export class Run {
  /**
   * @param {Client | LocalClient} client Tracks at the service, or in the page.
   * @param {Source} source
   * @param {Picture} picture The first frame of the source.
   * @param {RunTold} told
   */
  constructor(client, source, picture, told) {
    this.client = client;
    this.source = source;
    this.told = told;
    /** The last picture with an answer; the first one before that. */
    this.picture = picture;
    /** @type {FollowedObject[]} */
    this.objects = [];
    /** @type {FollowedObject | undefined} The object that corrections go to. */
    this.chosen = undefined;
    /** How many objects there were, deleted ones included. */
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
    /** @type {unknown} The error that ended the source. */
    this.failure = undefined;
    /** @type {{picture: Picture, at: number}[]} Frames without an answer, oldest first. */
    this.underWay = [];
    /** @type {import("./drawn.js").Drawn | undefined} */
    this.drawn = undefined;
    /** @type {(() => Promise<void>) | undefined} Goes on with a run that was stopped, or restored from the database. */
    this.wake = undefined;
    /** Whether earlier frames are tracked anew. */
    this.isRedoing = false;
  }

  /** Whether the files of the source are gone or changed, so that the user must choose them again. */
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

  /** Starts the source, after the last frame. */
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

  /** Follows another object, from `picture` on.
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

  /** Whether frames wait because there is no object. Those of a camera never do: the user draws in the live picture. */
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
      // The sessions ended before this frame was answered. The source delivers it again when the run goes on.
      if (this.isResting && answers.some((answer) => !answer)) return close(picture);
      // Frames that were in flight when the last object was deleted are no skipped ones: the next box is after them.
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
    // The picture before is not on the screen any more.
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

  /** Takes a box that the user drew in the last picture.
   * @param {Box} box
   * @param {FollowedObject | undefined} object
   * @param {() => void} sending Called right before the box is sent.
   * @param {() => void} refused Called if the tracker refuses the box. */
  draw(box, object, sending, refused) {
    this.drawn = { box, object, sending, refused };
    sendDrawn(this);
  }

  /** Runs `track` once all frames in flight are answered; no other frame is sent until it ends.
   * @param {() => Promise<void>} track */
  async alone(track) {
    // Another call, for a box that was drawn before, may still be at work.
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

  /** The source has failed: the run ends, and its rows are kept. */
  end() {
    this.rest();
    if (this.source.isFetched || this.isGone) this.told.rest(this.failure);
    else this.told.fail(this.failure);
  }

  /** An earlier frame cannot be read again. If the file is gone, that ends the run too.
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

  /** Takes no more frames. Earlier frames can still be tracked again, and objects be handed over. */
  rest() {
    this.isResting = true;
    this.source.stop();
    this.leaveSessions();
  }

  /** Ends the sessions at the service if the run takes no more frames. If it goes on, it opens others. */
  leaveSessions() {
    if (this.isResting && !this.isLocal) this.objects.forEach(({ follower }) => follower.end());
  }
}
