// Seeking in a video element, and finding out which frame it shows then.

import { GONE, isReadable } from "./problems.js";

/** In seconds. Media times that differ by less belong to the same frame. */
export const SAME = 0.001;
/** In seconds. A seek to so long before a frame shows the frame before it. */
export const BEFORE = 0.002;
/** Milliseconds that a browser may take to show a frame after a seek. */
const SHOWN_WITHIN = 500;

export class Playback {
  /** @param {HTMLVideoElement} video
   * @param {File} file */
  constructor(video, file) {
    this.video = video;
    this.isSeeking = false;
    /** @type {(error?: unknown) => void} Rejects `broken` with the error; without one, only if the file is gone. */
    this.fail = () => {};
    /** @type {Promise<never>} Rejects when the rest cannot be played. */
    this.broken = new Promise((_, reject) => {
      this.fail = async (error) => {
        const isThere = await isReadable(file);
        if (error || !isThere) reject(isThere ? error : GONE);
      };
    });
    this.broken.catch(() => undefined);
    // Browsers try for half a minute to read a file that is gone, and report nothing meanwhile.
    video.onwaiting = video.onseeking = () => this.fail();
    video.onerror = () => this.fail(new DOMException("", "EncodingError"));
  }

  /** Like `seek`, but rejects if the file cannot be played any more.
   * @param {number} time */
  reach(time) {
    return Promise.race([this.broken, this.seek(time)]);
  }

  /** Goes to a time in seconds, and waits until its frame is shown.
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
        // A frame reported before the seek is done may be a later one: wait for the next report.
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
}

/** Whether the media time after a seek is that of the frame. Some browsers report the time sought instead, and some go
 * on to a key frame.
 * @param {VideoFrameCallbackMetadata | undefined} shown
 * @param {number} sought
 * @returns {shown is VideoFrameCallbackMetadata} */
export function isTimeOf(shown, sought) {
  return shown !== undefined && shown.mediaTime < sought - SAME / 2;
}

/** Whether all pixels of two canvases of one size are equal.
 * @param {HTMLCanvasElement} one
 * @param {HTMLCanvasElement} other */
export function areEqual(one, other) {
  const [a, b] = [one, other].map((canvas) => {
    const data = canvas.getContext("2d")?.getImageData(0, 0, canvas.width, canvas.height).data;
    return new Uint32Array(data?.buffer ?? new ArrayBuffer(0));
  });
  return a.every((pixel, at) => pixel === b[at]);
}

/** Whether nothing was drawn on a canvas: pixels of a video are opaque.
 * @param {HTMLCanvasElement | undefined} image */
export function isEmpty(image) {
  const data = image?.getContext("2d")?.getImageData(0, 0, image.width, image.height).data;
  return !data?.some((value) => value > 0);
}

/** Frames that the rate is learned from. */
const TELLING = 9;
/** Milliseconds after which fewer frames suffice. */
const LEARNED_WITHIN = 2000;
/** Usual rates. A measured rate within the share `NEARLY` of one counts as that: some files round times to 1 ms. */
const USUAL = [10, 12, 15, 24000 / 1001, 24, 25, 30000 / 1001, 30, 48, 50, 60000 / 1001, 60, 120];
const NEARLY = 0.004;

/** Seconds from the frame before to this one, found by a seek; infinite where the browser does not say. On a busy
 * machine, playing may report no two consecutive frames.
 * @param {Playback} playback
 * @param {number} time */
async function stepTo(playback, time) {
  const sought = time - BEFORE;
  const before = await playback.reach(sought);
  return isTimeOf(before, sought) && time - before.mediaTime > SAME ? time - before.mediaTime : Infinity;
}

/** Learns the frames a second by playing the first frames of a file.
 * @param {Playback} playback */
export async function learnRate(playback) {
  const { video } = playback;
  /** @type {number[]} */
  const times = [];
  video.playbackRate = 0.5;
  video.currentTime = 0;
  await new Promise((resolve) => {
    setTimeout(resolve, LEARNED_WITHIN);
    video.onended = resolve;
    /** @type {VideoFrameRequestCallback} */
    const next = (_, { mediaTime }) => {
      times.push(mediaTime);
      if (times.length === TELLING) resolve(undefined);
      else video.requestVideoFrameCallback(next);
    };
    video.requestVideoFrameCallback(next);
    video.play().catch(resolve);
  });
  video.pause();
  const told = times.filter((time, at) => at === 0 || time - times[at - 1] > SAME);
  const steps = told.slice(1).map((time, at) => time - told[at]);
  if (steps.length === 0) return 30;
  const at = steps.indexOf(Math.min(...steps));
  const shortest = Math.min(steps[at], await stepTo(playback, told[at + 1]));
  const count = steps.reduce((sum, step) => sum + Math.round(step / shortest), 0);
  const rate = count / steps.reduce((sum, step) => sum + step, 0);
  const usual = USUAL.reduce((one, other) => (Math.abs(other - rate) < Math.abs(one - rate) ? other : one));
  return Math.abs(usual - rate) < NEARLY * rate ? usual : rate;
}
