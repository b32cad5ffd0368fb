// The frames of a video file that is played: over plain http a page is not given the browser's decoders.
//
// The browser does not say which frames a file has. So the file is played and paused, and every frame that
// the browser tells of is taken. Where the media times leave room for another one, the file is looked into right before
// the later of the two frames; where that is not the earlier one, the file is played from there again, more slowly.

import { Delivery } from "./delivery.js";
import { Gaps, SAME_PASSES } from "./gaps.js";
import { BEFORE, Playback, SAME, areEqual, isEmpty, learnRate } from "./playback.js";
import { GONE, isReadable } from "./problems.js";
import { addVideo, drawFrame, encoded, loaded } from "./source.js";

/** The rate that a file begins with, until the interval between its frames is known. */
const CAUTIOUS = 0.5;
const LEARNED_AFTER = 6;
/** After so many frames without a gap the file is played faster again. */
const SPEEDS_UP_AFTER = 40;
/** A sound that goes on for longer after the last frame is no reason to look for frames, in seconds. */
const LONGEST_TAIL = 1;
/** Pictures of the screen after which a frame is shown that was told of. */
const SETTLES_AFTER = 3;

/** @param {HTMLCanvasElement} image
 * @param {number} frame
 * @param {number} time */
const pictureOf = async (image, frame, time) => ({ image, blob: await encoded(image), time, frame });

/** @implements {Source} */
export class VideoFile {
  /**
   * @param {HTMLVideoElement} video That can be played.
   * @param {File} file
   * @param {HTMLElement} place Where the element is.
   */
  constructor(video, file, place) {
    this.video = video;
    this.file = file;
    this.place = place;
    this.files = [file];
    this.name = file.name;
    this.duration = video.duration;
    /** @type {number | undefined} Frames a second, where they had to be learned ahead. */
    this.learned = undefined;
    /** @type {VideoFile | undefined} Shows frames out of their order. */
    this.reader = undefined;
    /** @type {Promise<unknown>} What it was asked for before is shown. */
    this.looked = Promise.resolve();
    this.isLive = false;
    this.size = { width: video.videoWidth, height: video.videoHeight };
    /** Frames that could not be had, for all passes. */
    this.skipped = 0;
    this.isHeld = false;
    this.isStopped = false;
    this.playback = new Playback(video, file);
    this.hasEnded = false;
    /** @type {number | undefined} The time of a frame that is taken in a moment; infinite when it has gone by. */
    this.settling = undefined;
    /** @type {HTMLCanvasElement | undefined} The frame that was taken last. */
    this.lastImage = undefined;
    /** How often the next one looked the same. */
    this.samePasses = 0;
    /** The frame that was taken last: its number, its media time, and how many the browser had shown then.
     * @type {{frame: number, time: number, shown: number | undefined}} */
    this.last = { frame: 0, time: 0, shown: undefined };
    this.firstTime = 0;
    /** The shortest time between two frames. */
    this.interval = Infinity;
    this.gaps = new Gaps(this);
    this.sinceGap = 0;
    this.end = () => {};
    this.adjust = this.adjust.bind(this);
    this.delivery = new Delivery(this.adjust);
  }

  get rate() {
    const { frame, time } = this.last;
    return frame > 0 && time > this.firstTime ? frame / (time - this.firstTime) : this.learned;
  }

  async first() {
    const shown = await this.playback.seek(0);
    this.firstTime = shown?.mediaTime ?? 0;
    const picture = await this.begin(0, this.firstTime, shown);
    // Some browsers say that they can play what has no whole frame, and show nothing.
    if (shown || !isEmpty(this.lastImage)) return picture;
    this.close();
    throw new Error(`${this.name} is cut in its first frame: there is no picture in it. Choose another copy of it.`);
  }

  /** Begins at a time. What is not played has no number: it is counted from the rate of the file's first frames.
   * @param {number} time
   * @param {number} [frame] Its number, where it is known. */
  async goTo(time, frame) {
    this.learned ??= await learnRate(this.playback);
    // The times of rows are rounded, perhaps to before the frame.
    const sought = frame === undefined ? time : time + BEFORE;
    const shown = await this.playback.reach(Math.min(sought, this.duration));
    const shownTime = shown?.mediaTime ?? time;
    return this.begin(frame ?? Math.round((shownTime - this.firstTime) * this.learned), shownTime, shown);
  }

  /** Takes the frame that is shown as the one before all others.
   * @param {number} frame
   * @param {number} time
   * @param {VideoFrameCallbackMetadata | undefined} shown */
  begin(frame, time, shown) {
    this.last = { frame, time, shown: shown?.presentedFrames };
    this.lastImage = drawFrame(this.video);
    return pictureOf(this.lastImage, frame, time);
  }

  /** Any frame, by an element of its own: the file plays on meanwhile.
   * @param {number} frame
   * @param {number} time */
  at(frame, time) {
    const looked = this.looked.then(async () => {
      this.reader ??= await openPlayed(this.file, this.place);
      await this.reader.playback.reach(time + BEFORE);
      return pictureOf(drawFrame(this.reader.video), frame, time);
    });
    this.looked = looked.catch(() => undefined);
    return looked;
  }

  /** @type {Source["start"]} */
  start(deliver, end) {
    const { video } = this;
    this.delivery.deliver = deliver;
    this.delivery.fail = this.playback.fail;
    this.end = end;
    const next = (/** @type {number} */ _, /** @type {VideoFrameCallbackMetadata} */ shown) => {
      if (this.isStopped) return;
      video.requestVideoFrameCallback(next);
      if (!this.playback.isSeeking && !this.hasEnded) this.look(shown);
    };
    video.requestVideoFrameCallback(next);
    video.onended = () => this.ended();
    // In a hidden page frames are not told of.
    document.addEventListener("visibilitychange", this.adjust);
    video.playbackRate = CAUTIOUS;
    this.adjust();
    return this.playback.broken;
  }

  /** Takes the frame that is shown, if it is the next one.
   * @param {VideoFrameCallbackMetadata} shown */
  look({ mediaTime: time, presentedFrames }) {
    const { last } = this;
    const steps = presentedFrames - (last.shown ?? presentedFrames - 1);
    if (time <= last.time + SAME) {
      last.shown = presentedFrames;
    } else if (this.settling !== undefined) {
      // The frame that was waited for has gone by.
      if (time > this.settling + SAME) this.settling = Infinity;
    } else if (this.gaps.mayPassOver(last.time, time, steps)) {
      this.gaps.lookInto(time, steps);
    } else {
      this.settle(time, presentedFrames);
    }
    this.adjust();
  }

  /** Takes the frame that is shown after a while: some browsers tell of a frame before they give it away, and when the
   * machine is busy, give away the next one.
   * @param {number} time
   * @param {number} shown */
  async settle(time, shown) {
    this.settling = time;
    this.adjust();
    for (let count = 0; count < SETTLES_AFTER; count += 1) await new Promise(requestAnimationFrame);
    const isGone = this.settling > time + SAME;
    this.settling = undefined;
    if (this.isStopped) return;
    if (isGone) return this.takeGone(time);
    const image = drawFrame(this.video);
    // What looks the same may be the frame before, which is given away for longer than it is told of.
    const isSame = this.lastImage !== undefined && this.samePasses < SAME_PASSES && areEqual(image, this.lastImage);
    if (isSame) {
      this.samePasses += 1;
      return this.retake();
    }
    this.take(image, time, shown, true);
    this.adjust();
  }

  /** Goes back to the frame that has gone by before it was taken. On a busy machine each one would, when it is played.
   * @param {number} time */
  async takeGone(time) {
    const shown = await this.playback.seek(time + SAME / 2);
    if (this.isStopped) return;
    if (!shown || Math.abs(shown.mediaTime - time) > SAME) return this.gaps.resume();
    const image = drawFrame(this.video);
    if (this.delivery.isAhead(image)) return this.retake();
    this.take(image, time, undefined);
    this.gaps.goOnFrom(shown);
  }

  /** Goes back to the frame that was taken last: it or the next one was given away for the other. */
  async retake() {
    const { time } = this.last;
    // Rounding leads to before it otherwise.
    const shown = await this.playback.seek(time + SAME / 2);
    if (this.isStopped) return;
    if (!shown || Math.abs(shown.mediaTime - time) > SAME) return this.gaps.resume();
    this.lastImage = drawFrame(this.video);
    this.delivery.settle(this.lastImage);
    this.gaps.goOnFrom(shown);
  }

  /** Takes the next frame.
   * @param {HTMLCanvasElement} image
   * @param {number} time
   * @param {number | undefined} shown
   * @param {boolean} [isDoubted] Whether the image may be that of the frame after it. */
  take(image, time, shown, isDoubted = false) {
    const frame = this.last.frame + 1;
    this.interval = Math.min(this.interval, time - this.last.time);
    this.samePasses = 0;
    this.last = { frame, time, shown };
    this.lastImage = image;
    this.delivery.add({ image, time, frame }, isDoubted);
    this.sinceGap += 1;
    const { video } = this;
    if (frame === LEARNED_AFTER) video.playbackRate = 1;
    else if (this.sinceGap % SPEEDS_UP_AFTER === 0) video.playbackRate = Math.min(1, video.playbackRate * 1.5);
  }

  /** Plays or pauses. */
  adjust() {
    const { video } = this;
    const isBusy = this.playback.isSeeking || this.settling !== undefined;
    const isAtEnd = this.isStopped || this.hasEnded || video.ended;
    if (!isAtEnd && !isBusy && !this.isHeld && !document.hidden && !this.delivery.isFull) {
      if (!video.paused) return;
      // It may be paused again before it plays.
      video.play().catch((error) => error.name === "AbortError" || this.playback.fail(error));
    } else if (!video.paused) {
      video.pause();
    } else if (video.ended && !isBusy) {
      // One that was gone to does not tell its end.
      this.ended();
    }
  }

  async ended() {
    if (this.playback.isSeeking || this.isStopped) return;
    // The last frame may be told of after the end.
    for (let count = 0; count < 2; count += 1) await new Promise((resolve) => setTimeout(resolve, 50));
    while (this.settling !== undefined) await new Promise(requestAnimationFrame);
    if (this.playback.isSeeking || this.isStopped || this.hasEnded || !this.video.ended) return;
    const [{ duration }, { time }] = [this.video, this.last];
    const tail = Number.isFinite(duration) ? duration - time : 0;
    // There the file ends again, or plays on.
    if (tail < LONGEST_TAIL && this.gaps.mayPassOver(time, duration, 1)) return this.gaps.lookInto(duration, 1);
    this.hasEnded = true;
    await this.delivery.end();
    if (!this.isStopped) this.end();
  }

  /** @param {boolean} isHeld */
  hold(isHeld) {
    this.isHeld = isHeld;
    this.adjust();
  }

  stop() {
    this.isStopped = this.delivery.isStopped = true;
    document.removeEventListener("visibilitychange", this.adjust);
    this.video.pause();
    this.video.remove();
    URL.revokeObjectURL(this.video.src);
  }

  /** Gives up the element that shows frames out of their order. */
  close() {
    this.stop();
    this.reader?.stop();
    this.reader = undefined;
  }
}

/**
 * @param {File} file
 * @param {HTMLElement} place
 */
export async function openPlayed(file, place) {
  const video = addVideo(place);
  const ready = loaded(video);
  video.src = URL.createObjectURL(file);
  try {
    await ready;
    // Only its sound can be played.
    if (video.videoWidth === 0) throw new DOMException("", "NotSupportedError");
  } catch (error) {
    video.remove();
    throw (await isReadable(file)) ? error : GONE;
  }
  return new VideoFile(video, file, place);
}
