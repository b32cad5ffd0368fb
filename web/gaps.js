// Looks for frames that the browser did not report, in gaps between the media times of two frames of a played file.

import { BEFORE, SAME, isTimeOf } from "./playback.js";
import { drawFrame } from "./source.js";

/** A gap of so many frame intervals may have another frame in it. */
const GAP = 1.5;
const SLOWEST = 0.25;
/** Most passes over a gap with frames in it. The first pass plays it again; later ones seek to each frame. */
const MOST_PASSES = 6;
/** If the browser does not say what it shows after a seek: a gap that is the same at so many passes has no frames. */
export const SAME_PASSES = 2;
/** Most frames that one pass takes from a gap. */
const MOST_BETWEEN = 12;
/** Seconds before the last frame to seek to, tried in order: some browsers go on to a key frame that is near. */
const LEADS = [0, 0.5, 1.5, 5];

export class Gaps {
  /** @param {import("./file.js").VideoFile} file */
  constructor(file) {
    this.file = file;
    /** The last gap that was looked into, and what was found; `isOfTheFile`: there is no frame in it. */
    this.gap = { from: -1, to: -1, isOfTheFile: false, passes: 0, same: 0 };
  }

  /** Whether there may be an unreported frame between two media times in seconds.
   * @param {number} from
   * @param {number} to
   * @param {number} steps How many frames the browser has presented meanwhile. */
  mayPassOver(from, to, steps) {
    const isLong = to - from > this.file.interval * GAP;
    // The first interval has nothing to be compared with.
    const isSuspect = this.file.interval === Infinity || isLong || (steps > 1 && to - from > this.file.interval * 1.1);
    const { gap } = this;
    return isSuspect && !(gap.isOfTheFile && gap.from === from && Math.abs(gap.to - to) < SAME);
  }

  /** Looks for a frame between the one that was taken last and the one at `to`.
   * @param {number} to
   * @param {number} steps */
  async lookInto(to, steps) {
    const { video, last } = this.file;
    video.pause();
    const sought = to - BEFORE;
    const shown = await this.file.playback.seek(sought);
    if (this.file.isStopped) return;
    const gap = this.countPass(to, steps);
    const isTold = isTimeOf(shown, sought);
    const found = this.between(shown, sought);
    gap.isOfTheFile = isTold ? found === undefined : gap.same >= SAME_PASSES;
    if (gap.isOfTheFile) return isTold ? this.goOnFrom(shown) : this.resume();
    this.file.sinceGap = 0;
    video.playbackRate = Math.max(SLOWEST, video.playbackRate / 2);
    const { interval } = this.file;
    const isNext = found !== undefined && interval < Infinity && found - last.time <= interval * GAP;
    if (found !== undefined && (isNext || (gap.passes > 1 && gap.passes < MOST_PASSES))) {
      // Within `GAP` intervals after the last frame there is no room for another one.
      const frames = await this.goBack({ image: drawFrame(video), time: found }, isNext);
      if (this.file.isStopped) return;
      if (frames.length === 0) return this.resume();
      if (this.file.delivery.isAhead(frames[0].image)) return this.file.retake();
      for (const { image, time } of frames) this.file.take(image, time, undefined);
      return frames.length === 1 && isNext ? this.goOnFrom(shown) : this.resume();
    }
    if (gap.passes >= MOST_PASSES) {
      gap.isOfTheFile = true;
      const missing = Math.max(1, Math.round((to - last.time) / this.file.interval) - 1);
      this.file.skipped += missing;
      last.frame += missing;
    }
    await this.resume();
  }

  /** Plays on from the frame on the screen, which was taken.
   * @param {VideoFrameCallbackMetadata | undefined} shown */
  goOnFrom(shown) {
    this.file.last.shown = shown?.presentedFrames;
    this.file.adjust();
  }

  /** Seeks to the frame that was taken last, or to one before it, and plays on from there. */
  async resume() {
    const { last } = this.file;
    for (const lead of LEADS) {
      const shown = await this.file.playback.seek(Math.max(0, last.time - lead));
      last.shown = shown?.presentedFrames;
      if (this.file.isStopped || (shown && shown.mediaTime <= last.time + SAME)) break;
    }
    this.file.adjust();
  }

  /**
   * Goes back frame by frame, down to the one that was taken last. Returns the earliest `MOST_BETWEEN` frames of the
   * gap: another pass finds the rest. Returns none where the browser does not say what it shows.
   * @param {{image: HTMLCanvasElement, time: number}} frame
   * @param {boolean} isNext Whether `frame` is the first one of the gap.
   */
  async goBack(frame, isNext) {
    const frames = [frame];
    while (!isNext) {
      const sought = frames[0].time - BEFORE;
      const shown = await this.file.playback.seek(sought);
      if (this.file.isStopped || !isTimeOf(shown, sought)) return [];
      const before = this.between(shown, sought);
      if (before === undefined) break;
      frames.unshift({ image: drawFrame(this.file.video), time: before });
      if (frames.length > MOST_BETWEEN) frames.pop();
    }
    return frames;
  }

  /**
   * The media time of the frame after a seek; undefined if the browser does not say it, or the frame was taken before.
   * @param {VideoFrameCallbackMetadata | undefined} shown
   * @param {number} sought
   */
  between(shown, sought) {
    return isTimeOf(shown, sought) && shown.mediaTime > this.file.last.time + SAME ? shown.mediaTime : undefined;
  }

  /** Counts the passes over a gap, and those with the same end.
   * @param {number} to
   * @param {number} steps */
  countPass(to, steps) {
    const from = this.file.last.time;
    const { passes, same } = this.gap.from === from ? this.gap : { passes: 0, same: 0 };
    const isSame = steps <= 1 && (passes === 0 || Math.abs(this.gap.to - to) < SAME);
    this.gap = { from, to, isOfTheFile: false, passes: passes + 1, same: isSame ? same + 1 : 0 };
    return this.gap;
  }
}
