// Tracking frames again: on from a box in an earlier frame, or back from it.

import { rowOf, scaled } from "./boxes.js";
import { close } from "./frames.js";

/**
 * @typedef {import("./js/bagtrack.js").Box} Box
 * @typedef {import("./objects.js").FollowedObject} FollowedObject
 * @typedef {import("./run.js").Run} Run
 * @typedef {(frame: number) => void} Tell Is told of each frame.
 */

/**
 * Follows an object anew, from a box in an earlier frame up to the last one.
 * @param {Run} run
 * @param {FollowedObject | undefined} known Nothing for a new one.
 * @param {number} frame
 * @param {Box} box
 * @param {Tell} tell
 */
export function trackOn(run, known, frame, box, tell) {
  return run.alone(async () => {
    const object = known ?? run.newObject();
    const from = await object.goBackBefore(frame, run.follower());
    object.forgetFrom(frame);
    for (const number of run.frames.shown) {
      if (run.isOver || number < (from === undefined ? frame : from + 1)) continue;
      const picture = await run.frames.at(number);
      if (!picture) continue;
      const isDrawn = number === frame;
      const isFirst = isDrawn && from === undefined;
      const { follower } = object;
      const answer = await (isFirst ? follower.open(picture, box) : follower.track(picture, isDrawn ? { box } : {}));
      if (!run.objects.includes(object)) run.take(object);
      if (answer && number >= frame) run.note(object, answer, picture, isDrawn);
      else if (answer) object.frames.push(number);
      close(picture);
      tell(number);
    }
  });
}

/**
 * Follows an object from a box in a frame backwards: to the box that was drawn before, or to the beginning of the video.
 * @param {Run} run
 * @param {FollowedObject} object
 * @param {number} frame A frame with a row of it.
 * @param {Tell} tell
 * @returns {Promise<number>} How many frames were tracked.
 */
export async function trackBack(run, object, frame, tell) {
  let count = 0;
  const drawn = [...object.rows.values()].filter((row) => row.corrected && row.frame < frame).map((row) => row.frame);
  // An object's first box was drawn, too, and is kept.
  const until = Math.max(-1, ...drawn);
  const follower = run.follower();
  await run.alone(async () => {
    let picture = await run.frames.at(frame);
    const row = object.rows.get(frame);
    if (!picture || !row) return;
    await follower.open(picture, scaled(row.box, picture.image, run.source.size));
    while (!run.isOver) {
      close(picture);
      picture = await run.frames.before(picture.frame);
      if (!picture || picture.frame <= until) break;
      const answer = await follower.track(picture, {});
      if (!answer) continue;
      run.frames.keep(picture);
      object.set(rowOf(answer, picture, run.source.size, false));
      count += 1;
      tell(picture.frame);
    }
    object.sort();
  });
  follower.end();
  return count;
}

/**
 * Brings all objects to the last frame again, after the page was loaded anew: from their states, or from their last boxes.
 * @param {Run} run
 */
export async function catchUp(run) {
  const { picture } = run;
  for (const object of run.objects) {
    const last = [...object.rows.values()].pop();
    if (!last) continue;
    const from = await object.goBackBefore(run.lastFrame + 1, run.follower());
    if (from === undefined) {
      await object.follower.open(picture, scaled(last.box, picture.image, run.source.size));
      object.frames = [picture.frame];
      continue;
    }
    for (const number of run.frames.shown.filter((number) => number > from)) {
      const passed = await run.frames.at(number);
      if (!passed || !(await object.follower.track(passed, {}))) continue;
      object.frames.push(number);
      close(passed);
    }
  }
}
