// The frames of a video file, taken while a video element plays it: over plain http, pages have no `VideoDecoder`.
//
// The browser does not say which frames a file has. So the file is played and paused, and every frame that the browser
// reports is taken. Where two media times leave room for a frame between them, the page seeks to right before the
// later one. If another frame than the earlier one appears there, that part is played again, more slowly.

import { Delivery } from "./delivery.js";
import { Gaps, SAME_PASSES } from "./gaps.js";
import { BEFORE, Playback, SAME, areEqual, isEmpty, learnRate } from "./playback.js";
import { GONE, isReadable } from "./problems.js";
import { addVideo, drawFrame, encoded, loaded } from "./source.js";

/** The playback rate at first, until `LEARNED_AFTER` frames have told the interval between frames. */
const CAUTIOUS = 0.5;
const LEARNED_AFTER = 6;
/** Frames without a gap after which the file is played faster again. */
const SPEEDS_UP_AFTER = 40;
/** In seconds. Where the file goes on for longer after the last frame, that is sound alone, without frames to find. */
const LONGEST_TAIL = 1;
/** Repaints of the screen after which a reported frame can be read from the element. */
const SETTLES_AFTER = 3;

/** @param {HTMLCanvasElement} image
 * @param {number} frame
 * @param {number} time */
const pictureOf = async (image, frame, time) => ({ image, blob: await encoded(image), time, frame });

/** @implements {Source} */
export class VideoFile {
  /**
   * @param {HTMLVideoElement} video Has loaded the file.
   * @param {File} file
   * @param {HTMLElement} place The parent of the element.
   */
  constructor(video, file, place) {
    this.video = video;
    this.file = file;
    this.place = place;
    this.files = [file];
    this.name = file.name;
    this.duration = video.duration;
    /** @type {number | undefined} Frames a second, from the first frames of the file. */
    this.learned = undefined;
    /** @type {VideoFile | undefined} A second element, for single frames at any time. */
    this.reader = undefined;
    /** @type {Promise<unknown>} Settles when `reader` has shown the last frame asked for. */
    this.looked = Promise.resolve();
    this.isLive = false;
    this.size = { width: video.videoWidth, height: video.videoHeight };
    /** Frames that no pass over their gap has shown. */
    this.skipped = 0;
    this.isHeld = false;
    this.isStopped = false;
    this.playback = new Playback(video, file);
    this.hasEnded = false;
    /** @type {number | undefined} The time of a frame that waits to be taken; infinite once a later one shows. */
    this.settling = undefined;
    /** @type {HTMLCanvasElement | undefined} The frame that was taken last. */
    this.lastImage = undefined;
    /** How often the next frame looked the same as the last one. */
    this.samePasses = 0;
    /** The frame that was taken last: its number, its media time, and `presentedFrames` of the browser then.
     * @type {{frame: number, time: number, shown: number | undefined}} */
    this.last = { frame: 0, time: 0, shown: undefined };
    this.firstTime = 0;
    /** The shortest time between two frames, in seconds. */
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
    // Some browsers load a file without one whole frame, and show nothing.
    if (shown || !isEmpty(this.lastImage)) return picture;
    this.close();
    throw new Error(`${this.name} is cut in its first frame: there is no picture in it. Choose another copy of it.`);
  }

  /** Begins at a time. Nobody counted the frames before it: its number is estimated from the rate of the first frames.
   * @param {number} time
   * @param {number} [frame] Its number, where it is known. */
  async goTo(time, frame) {
    this.learned ??= await learnRate(this.playback);
    // The times of rows are rounded, perhaps to a time before the frame.
    const sought = frame === undefined ? time : time + BEFORE;
    const shown = await this.playback.reach(Math.min(sought, this.duration));
    const shownTime = shown?.mediaTime ?? time;
    return this.begin(frame ?? Math.round((shownTime - this.firstTime) * this.learned), shownTime, shown);
  }

  /** Takes the frame on the screen as the first one.
   * @param {number} frame
   * @param {number} time
   * @param {VideoFrameCallbackMetadata | undefined} shown */
  begin(frame, time, shown) {
    this.last = { frame, time, shown: shown?.presentedFrames };
    this.lastImage = drawFrame(this.video);
    return pictureOf(this.lastImage, frame, time);
  }

  /** Any frame, from a second element: this one plays on meanwhile.
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
    // In a hidden page the browser reports no frames, so playing pauses.
    document.addEventListener("visibilitychange", this.adjust);
    video.playbackRate = CAUTIOUS;
    this.adjust();
    return this.playback.broken;
  }

  /** Takes the reported frame, if it is the next one.
   * @param {VideoFrameCallbackMetadata} shown */
  look({ mediaTime: time, presentedFrames }) {
    const { last } = this;
    const steps = presentedFrames - (last.shown ?? presentedFrames - 1);
    if (time <= last.time + SAME) {
      last.shown = presentedFrames;
    } else if (this.settling !== undefined) {
      // A later frame is on the screen before the awaited one was taken.
      if (time > this.settling + SAME) this.settling = Infinity;
    } else if (this.gaps.mayPassOver(last.time, time, steps)) {
      this.gaps.lookInto(time, steps);
    } else {
      this.settle(time, presentedFrames);
    }
    this.adjust();
  }

  /** Takes a reported frame after a few repaints: some browsers report a frame before it can be drawn to a canvas, and
   * on a busy machine draw the next one.
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
    // An equal image may still be the frame before: some browsers draw it for a while after they report the next one.
    const isSame = this.lastImage !== undefined && this.samePasses < SAME_PASSES && areEqual(image, this.lastImage);
    if (isSame) {
      this.samePasses += 1;
      return this.retake();
    }
    this.take(image, time, shown, true);
    this.adjust();
  }

  /** Goes back to a frame that another has replaced before it was taken. On a busy machine that can be every frame.
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

  /** Goes back to the last frame taken, and takes its image again: the browser drew one frame for the other. */
  async retake() {
    const { time } = this.last;
    // Without the addition, rounding could lead to the frame before.
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
   * @param {boolean} [isDoubted] Whether the image may be that of the frame after this one. */
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

  /** Plays or pauses the element, as the state asks for. */
  adjust() {
    const { video } = this;
    const isBusy = this.playback.isSeeking || this.settling !== undefined;
    const isAtEnd = this.isStopped || this.hasEnded || video.ended;
    if (!isAtEnd && !isBusy && !this.isHeld && !document.hidden && !this.delivery.isFull) {
      if (!video.paused) return;
      // `AbortError` only says that the element was paused before it played.
      video.play().catch((error) => error.name === "AbortError" || this.playback.fail(error));
    } else if (!video.paused) {
      video.pause();
    } else if (video.ended && !isBusy) {
      // After a seek to the end, no `ended` event comes.
      this.ended();
    }
  }

  async ended() {
    if (this.playback.isSeeking || this.isStopped) return;
    // The browser may report the last frame after the `ended` event.
    for (let count = 0; count < 2; count += 1) await new Promise((resolve) => setTimeout(resolve, 50));
    while (this.settling !== undefined) await new Promise(requestAnimationFrame);
    if (this.playback.isSeeking || this.isStopped || this.hasEnded || !this.video.ended) return;
    const [{ duration }, { time }] = [this.video, this.last];
    const tail = Number.isFinite(duration) ? duration - time : 0;
    // After that look, the file plays on and ends once more.
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

  /** Stops, and removes the second element as well. */
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
    // The browser can play the sound, but not the picture.
    if (video.videoWidth === 0) throw new DOMException("", "NotSupportedError");
  } catch (error) {
    video.remove();
    throw (await isReadable(file)) ? error : GONE;
  }
  return new VideoFile(video, file, place);
}
