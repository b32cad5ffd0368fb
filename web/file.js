// The frames of a video file, each exactly once.
//
// A browser plays files and does not say which frames they have. So the file is played and paused, and every frame that
// the browser tells of is taken. Where the media times leave room for another one, the file is looked into right before
// the later of the two frames; where that is not the earlier one, the file is played from there again, more slowly.

import { addVideo, drawFrame, encoded, loaded } from "./source.js";

/**
 * @typedef {import("./source.js").Picture} Picture
 * @typedef {import("./source.js").Source} Source
 */

/** Media times that differ by less are the same frame's, in seconds. */
const SAME = 0.001;
/** A time between two frames of so many intervals is one that another frame may be in. */
const GAP = 1.5;
const SLOWEST = 0.25;
/** The rate that a file begins with, until the interval between its frames is known. */
const CAUTIOUS = 0.5;
const LEARNED_AFTER = 6;
/** After so many frames without a gap the file is played faster again. */
const SPEEDS_UP_AFTER = 40;
/** What is looked at before a frame lies so far before it, in seconds. */
const BEFORE = 0.002;
/** Most passes over a gap with frames in it. After the first one they are gone to, one by one. */
const MOST_PASSES = 6;
/** A gap that cannot be looked into, and is the same at so many passes, belongs to the file. */
const SAME_PASSES = 2;
/** Most frames that are gone to. */
const MOST_BETWEEN = 12;
/** A sound that goes on for longer after the last frame is no reason to look for frames, in seconds. */
const LONGEST_TAIL = 1;
/** Frames that are encoded at a time. */
const MOST_ENCODING = 3;
/** Pictures of the screen after which a frame is shown that was told of. */
const SETTLES_AFTER = 3;
/** How long a browser may take to show a frame that it went to, in milliseconds. */
const SHOWN_WITHIN = 500;
/** Some browsers go to the next key frame where it is near: then the way back begins so many seconds earlier. */
const LEADS = [0, 0.5, 1.5, 5];

/** @implements {Source} */
export class VideoFile {
  /**
   * @param {HTMLVideoElement} video That can be played.
   * @param {string} name
   */
  constructor(video, name) {
    this.video = video;
    this.name = name;
    this.isLive = false;
    this.size = { width: video.videoWidth, height: video.videoHeight };
    /** Frames that could not be had, for all passes. */
    this.skipped = 0;
    this.isHeld = false;
    this.isStopped = false;
    this.isSeeking = false;
    this.hasEnded = false;
    /** @type {number | undefined} The time of a frame that is taken in a moment; infinite when it has gone by. */
    this.settling = undefined;
    /** @type {HTMLCanvasElement | undefined} The frame that was taken so last. */
    this.lastImage = undefined;
    /** How often the next one looked the same. */
    this.samePasses = 0;
    this.encoding = 0;
    /** The frame that was taken last: its number, its media time, and how many the browser had shown then.
     * @type {{frame: number, time: number, shown: number | undefined}} */
    this.last = { frame: 0, time: 0, shown: undefined };
    this.firstTime = 0;
    /** The shortest time between two frames. */
    this.interval = Infinity;
    /** A time between two frames that was looked into, and what came of it. */
    this.gap = { from: -1, to: -1, isOfTheFile: false, passes: 0, same: 0 };
    this.sinceGap = 0;
    /** @type {Promise<unknown>} The pictures before are delivered. */
    this.before = Promise.resolve();
    /** @type {(picture: Picture) => void} */
    this.deliver = () => undefined;
    this.end = () => {};
    /** @type {(error: unknown) => void} */
    this.fail = () => undefined;
    this.adjust = this.adjust.bind(this);
  }

  /** @returns {number | undefined} */
  get rate() {
    const { frame, time } = this.last;
    return frame > 0 ? frame / (time - this.firstTime) : undefined;
  }

  /** @returns {Promise<Picture>} */
  async first() {
    const shown = await this.seek(0);
    const time = shown?.mediaTime ?? 0;
    this.firstTime = time;
    this.last = { frame: 0, time, shown: shown?.presentedFrames };
    const image = drawFrame(this.video);
    this.lastImage = image;
    return { image, blob: await encoded(image), time, frame: 0 };
  }

  /** Goes to a time and waits until its frame is shown.
   * @param {number} time
   * @returns {Promise<VideoFrameCallbackMetadata | undefined>} What is shown: a later frame, where the browser went on
   *   to the next key frame. */
  async seek(time) {
    const { video } = this;
    this.isSeeking = true;
    /** @type {VideoFrameCallbackMetadata | undefined} */
    let shown;
    const there = new Promise((resolve) => {
      /** @type {VideoFrameRequestCallback} */
      const next = (_, metadata) => {
        shown = metadata;
        // What is told before the browser has gone there may be a later one.
        if (metadata.mediaTime <= time + SAME) resolve(undefined);
        else if (this.isSeeking) video.requestVideoFrameCallback(next);
      };
      video.requestVideoFrameCallback(next);
    });
    const done = new Promise((resolve) => video.addEventListener("seeked", resolve, { once: true }));
    video.currentTime = time;
    await done;
    await Promise.race([there, new Promise((resolve) => setTimeout(resolve, SHOWN_WITHIN))]);
    this.isSeeking = false;
    return shown;
  }

  /**
   * @param {(picture: Picture) => void} deliver
   * @param {() => void} end
   * @returns {Promise<void>}
   */
  start(deliver, end) {
    const { video } = this;
    [this.deliver, this.end] = [deliver, end];
    const next = (/** @type {number} */ _, /** @type {VideoFrameCallbackMetadata} */ shown) => {
      if (this.isStopped) return;
      video.requestVideoFrameCallback(next);
      if (!this.isSeeking && !this.hasEnded) this.look(shown);
    };
    video.requestVideoFrameCallback(next);
    video.onended = () => this.ended();
    // In a hidden page frames are not told of.
    document.addEventListener("visibilitychange", this.adjust);
    video.playbackRate = CAUTIOUS;
    return new Promise((_, reject) => {
      this.fail = reject;
      video.onerror = () => reject(new DOMException("", "EncodingError"));
      this.adjust();
    });
  }

  /** Takes the frame that is shown, if it is the next one.
   * @param {VideoFrameCallbackMetadata} shown */
  look({ mediaTime, presentedFrames }) {
    const { frame, time } = frameAt(this.video, mediaTime);
    const { last } = this;
    const steps = presentedFrames - (last.shown ?? presentedFrames - 1);
    if (time <= last.time + SAME) {
      last.shown = presentedFrames;
    } else if (this.settling !== undefined) {
      // The frame that was waited for has gone by.
      if (time > this.settling + SAME) this.settling = Infinity;
    } else if (this.mayPassOver(last.time, time, steps)) {
      this.lookInto(time, steps);
    } else if (frame) {
      this.interval = Math.min(this.interval, time - last.time);
      this.take(drawFrame(this.video, frame), time, presentedFrames);
    } else {
      this.settle(time, presentedFrames);
    }
    frame?.close();
    this.adjust();
  }

  /** Takes the frame that is shown after a while: some browsers tell of a frame before they give it away.
   * @param {number} time
   * @param {number} shown */
  async settle(time, shown) {
    this.settling = time;
    this.adjust();
    for (let count = 0; count < SETTLES_AFTER; count += 1) await new Promise(requestAnimationFrame);
    const isGone = this.settling > time + SAME;
    this.settling = undefined;
    if (this.isStopped) return;
    const image = drawFrame(this.video);
    // What looks the same may be the frame before, which is given away for longer than it is told of.
    const isSame = this.lastImage !== undefined && this.samePasses < SAME_PASSES && areEqual(image, this.lastImage);
    this.samePasses = isSame ? this.samePasses + 1 : 0;
    if (isGone || isSame) return this.resume();
    this.interval = Math.min(this.interval, time - this.last.time);
    this.lastImage = image;
    this.take(image, time, shown);
    this.adjust();
  }

  /** Whether there may be a frame in between.
   * @param {number} from
   * @param {number} to
   * @param {number} steps How many frames the browser has shown. */
  mayPassOver(from, to, steps) {
    const isLong = to - from > this.interval * GAP;
    // The first interval has nothing to be compared with.
    const isSuspect = this.interval === Infinity || isLong || (steps > 1 && to - from > this.interval * 1.1);
    const { gap } = this;
    return isSuspect && !(gap.isOfTheFile && gap.from === from && Math.abs(gap.to - to) < SAME);
  }

  /** Looks for a frame between the one that was taken last and this one.
   * @param {number} to
   * @param {number} steps */
  async lookInto(to, steps) {
    const { video, last } = this;
    video.pause();
    const sought = to - BEFORE;
    const shown = await this.seek(sought);
    if (this.isStopped) return;
    const gap = this.countPass(to, steps);
    const isTold = isTimeOf(shown, sought);
    const found = this.between(shown, sought);
    gap.isOfTheFile = isTold ? found === undefined : gap.same >= SAME_PASSES;
    if (gap.isOfTheFile) return isTold ? this.goOnFrom(shown) : this.resume();
    this.sinceGap = 0;
    video.playbackRate = Math.max(SLOWEST, video.playbackRate / 2);
    const isNext = found !== undefined && found - last.time <= this.interval * GAP;
    if (found !== undefined && (isNext || (gap.passes > 1 && gap.passes < MOST_PASSES))) {
      // Where there is room for one frame only, there is no other one.
      const frames = await this.goBack({ image: drawFrame(video), time: found }, isNext);
      for (const { image, time } of frames) this.take(image, time, undefined);
      return frames.length === 1 && isNext ? this.goOnFrom(shown) : this.resume();
    }
    if (gap.passes >= MOST_PASSES) {
      gap.isOfTheFile = true;
      const missing = Math.max(1, Math.round((to - last.time) / this.interval) - 1);
      this.skipped += missing;
      last.frame += missing;
    }
    await this.resume();
  }

  /** Plays on from the frame that is shown, which was taken.
   * @param {VideoFrameCallbackMetadata | undefined} shown */
  goOnFrom(shown) {
    this.last.shown = shown?.presentedFrames;
    this.adjust();
  }

  /** Plays on from the frame that was taken last, or from one before it. */
  async resume() {
    const { last } = this;
    for (const lead of LEADS) {
      const shown = await this.seek(Math.max(0, last.time - lead));
      last.shown = shown?.presentedFrames;
      if (this.isStopped || (shown && shown.mediaTime <= last.time + SAME)) break;
    }
    this.adjust();
  }

  /**
   * Goes from a frame to those before it, down to the one that was taken last.
   * @param {{image: HTMLCanvasElement, time: number}} frame
   * @param {boolean} isNext Whether there is none before it.
   */
  async goBack(frame, isNext) {
    const frames = [frame];
    while (!isNext && frames.length < MOST_BETWEEN) {
      const { time } = frames[0];
      const sought = time - BEFORE;
      const before = this.between(await this.seek(sought), sought);
      if (before === undefined || this.isStopped) break;
      frames.unshift({ image: drawFrame(this.video), time: before });
    }
    return frames;
  }

  /**
   * The time of the frame that is shown after a seek; nothing where it is not told, or not after the last one.
   * @param {VideoFrameCallbackMetadata | undefined} shown
   * @param {number} sought
   */
  between(shown, sought) {
    return isTimeOf(shown, sought) && shown.mediaTime > this.last.time + SAME ? shown.mediaTime : undefined;
  }

  /** Counts how often a gap was looked into, and how often it was the same one.
   * @param {number} to
   * @param {number} steps */
  countPass(to, steps) {
    const from = this.last.time;
    const { passes, same } = this.gap.from === from ? this.gap : { passes: 0, same: 0 };
    const isSame = steps <= 1 && (passes === 0 || Math.abs(this.gap.to - to) < SAME);
    this.gap = { from, to, isOfTheFile: false, passes: passes + 1, same: isSame ? same + 1 : 0 };
    return this.gap;
  }

  /** Takes the next frame.
   * @param {HTMLCanvasElement} image
   * @param {number} time
   * @param {number | undefined} shown */
  take(image, time, shown) {
    const frame = this.last.frame + 1;
    this.last = { frame, time, shown };
    this.encoding += 1;
    const blob = encoded(image);
    this.before = this.before.then(async () => {
      const picture = { image, blob: await blob, time, frame };
      this.encoding -= 1;
      if (this.isStopped) return;
      this.deliver(picture);
      this.adjust();
    });
    this.before.catch((error) => this.fail(error));
    this.sinceGap += 1;
    const { video } = this;
    if (frame === LEARNED_AFTER) video.playbackRate = 1;
    else if (this.sinceGap % SPEEDS_UP_AFTER === 0) video.playbackRate = Math.min(1, video.playbackRate * 1.5);
  }

  /** Plays or pauses. */
  adjust() {
    const { video } = this;
    const isBusy = this.isSeeking || this.settling !== undefined;
    const isWanted = !this.isStopped && !isBusy && !this.hasEnded && !video.ended;
    if (isWanted && !this.isHeld && !document.hidden && this.encoding < MOST_ENCODING) {
      if (!video.paused) return;
      // It may be paused again before it plays.
      video.play().catch((error) => error.name === "AbortError" || this.fail(error));
    } else if (!video.paused) {
      video.pause();
    }
  }

  async ended() {
    if (this.isSeeking || this.isStopped) return;
    // The last frame may be told of after the end.
    for (let count = 0; count < 2; count += 1) await new Promise((resolve) => setTimeout(resolve, 50));
    while (this.settling !== undefined) await new Promise(requestAnimationFrame);
    if (this.isSeeking || this.isStopped || this.hasEnded || !this.video.ended) return;
    const { duration } = this.video;
    const { time } = this.last;
    const tail = Number.isFinite(duration) ? duration - time : 0;
    const isSuspect = tail < LONGEST_TAIL && this.mayPassOver(time, duration, 1);
    // There the file ends again, or plays on.
    if (isSuspect) return this.lookInto(duration, 1);
    this.hasEnded = true;
    await this.before;
    if (!this.isStopped) this.end();
  }

  /** @param {boolean} isHeld */
  hold(isHeld) {
    this.isHeld = isHeld;
    this.adjust();
  }

  stop() {
    this.isStopped = true;
    document.removeEventListener("visibilitychange", this.adjust);
    this.video.pause();
    this.video.remove();
    URL.revokeObjectURL(this.video.src);
  }
}

/** The frame that a video shows, and its media time. It may be newer than the one that was told of.
 * @param {HTMLVideoElement} video
 * @param {number} mediaTime
 * @returns {{frame: VideoFrame | undefined, time: number}} */
function frameAt(video, mediaTime) {
  if (typeof VideoFrame === "undefined") return { frame: undefined, time: mediaTime };
  const frame = new VideoFrame(video);
  const time = frame.timestamp / 1e6;
  if (time >= mediaTime - SAME) return { frame, time };
  // Not every browser gives it the time that it has in the file.
  frame.close();
  return { frame: undefined, time: mediaTime };
}

/** Whether two canvases of one size show the same.
 * @param {HTMLCanvasElement} one
 * @param {HTMLCanvasElement} other */
function areEqual(one, other) {
  const [a, b] = [one, other].map((canvas) => {
    const data = canvas.getContext("2d")?.getImageData(0, 0, canvas.width, canvas.height).data;
    return new Uint32Array(data?.buffer ?? new ArrayBuffer(0));
  });
  return a.every((pixel, at) => pixel === b[at]);
}

/** Whether the time of the frame is told. Some browsers tell the one that was sought, and some go on to a key frame.
 * @param {VideoFrameCallbackMetadata | undefined} shown
 * @param {number} sought
 * @returns {shown is VideoFrameCallbackMetadata} */
function isTimeOf(shown, sought) {
  return shown !== undefined && shown.mediaTime < sought - SAME / 2;
}

/**
 * @param {File} file
 * @param {HTMLElement} place
 */
export async function openFile(file, place) {
  const video = addVideo(place);
  const ready = loaded(video);
  video.src = URL.createObjectURL(file);
  try {
    await ready;
  } catch (error) {
    video.remove();
    throw error;
  }
  return new VideoFile(video, file.name);
}
