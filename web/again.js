// Tracking frames again, forwards or backwards from a box in an earlier frame. The rows of before stay until all frames
// are tracked, so the user can cancel the work, and a failure loses nothing.

import { rowOf, scaled } from "./boxes.js";
import { close } from "./frames.js";

/**
 * @typedef {object} Redoing
 * @property {(frame: number) => void} tell Called with the number of each frame that is tracked.
 * @property {AbortSignal} signal Cancels the tracking.
 */

/**
 * Follows an object anew, from a box in an earlier frame up to the next one with a box that was drawn, or the last one.
 * @param {Run} run
 * @param {FollowedObject | undefined} known Undefined for a new object.
 * @param {number} frame
 * @param {Box} box
 * @param {Redoing} redoing
 * @returns {Promise<boolean>} False where the service refused a saved state: what was learned before may be lost.
 */
export async function trackOn(run, known, frame, box, { tell, signal }) {
  // A box that waits, because the run stopped before it was sent, is older than this one: drop it.
  if (run.underWay.length === 0) run.drawn?.refused();
  run.drawn = undefined;
  const object = known ?? run.newObject();
  const draft = object.draft(run.follower());
  await run.alone(async () => {
    const until = object.drawnAfter(frame);
    try {
      const from = await draft.goBackBefore(frame);
      for (const number of run.frames.shown) {
        if (number < (from === undefined ? frame : from + 1)) continue;
        if (number >= until) break;
        const picture = await run.frames.at(number);
        if (run.isOver || signal.aborted) return;
        if (!picture) continue;
        const isDrawn = number === frame;
        const isFirst = isDrawn && from === undefined;
        const { follower } = draft;
        const answer = await (isFirst ? follower.open(picture, box) : follower.track(picture, isDrawn ? { box } : {}));
        if (answer && number >= frame) run.note(draft, answer, picture, isDrawn);
        else if (answer) draft.frames.push(number);
        close(picture);
        tell(number);
      }
      const isGone = known && !run.objects.includes(known);
      if (run.isOver || signal.aborted || isGone) return;
      object.adopt(draft, until);
      if (!known) run.take(object);
    } finally {
      if (object.follower !== draft.follower) draft.follower.end();
    }
  });
  return !draft.isForgotten;
}

/**
 * Follows an object from a box in a frame backwards: to the box that was drawn before, or to the beginning of the video.
 * @param {Run} run
 * @param {FollowedObject} object
 * @param {number} frame A frame in which the object has a row.
 * @param {Redoing} redoing
 * @returns {Promise<number>} How many frames were tracked.
 */
export async function trackBack(run, object, frame, { tell, signal }) {
  const drawn = [...object.rows.values()].filter((row) => row.corrected && row.frame < frame).map((row) => row.frame);
  // The first box of an object counts as drawn, so its row is never overwritten.
  const until = Math.max(-1, ...drawn);
  const follower = run.follower();
  /** @type {Row[]} */
  const rows = [];
  /** @type {number[]} */
  const added = [];
  let isDone = false;
  try {
    await run.alone(async () => {
      let picture = await run.frames.at(frame);
      const row = object.rows.get(frame);
      if (!picture || !row) return;
      await follower.open(picture, scaled(row.box, picture.image, run.source.size));
      while (!run.isOver && !signal.aborted) {
        close(picture);
        picture = await run.frames.before(picture.frame);
        if (!picture || picture.frame <= until) break;
        const answer = await follower.track(picture, {});
        if (!answer) continue;
        if (!run.frames.times.has(picture.frame)) added.push(picture.frame);
        run.frames.keep(picture);
        rows.push(rowOf(answer, picture, run.source.size, false));
        tell(picture.frame);
      }
      isDone = !run.isOver && !signal.aborted;
    });
  } finally {
    follower.end();
    if (!isDone) added.forEach((number) => run.frames.forget(number));
  }
  if (!isDone) return 0;
  run.tracked = run.frames.times.size;
  rows.forEach((row) => object.set(row));
  object.sort();
  return rows.length;
}

/**
 * Brings an object in a new session up to the last frame, after the page was reloaded or a change was undone. Begins
 * with the object's last saved state, or with its last box where there is none.
 * @param {Run} run
 * @param {FollowedObject} object
 * @param {number} [last] The rows after this frame, up to the next drawn box, are replaced.
 */
export async function catchUp(run, object, last = run.lastFrame) {
  const { source } = run;
  const row = [...object.rows.values()].filter(({ frame }) => frame <= last).pop();
  if (!row) return;
  const until = object.drawnAfter(last);
  let from = await object.goBackBefore(last + 1);
  if (object.isForgotten) run.told.anew();
  object.isForgotten = false;
  if (from === undefined) {
    const known = last < run.lastFrame ? await run.frames.at(row.frame) : undefined;
    const picture = known ?? run.picture;
    await object.follower.open(picture, scaled(row.box, picture.image, source.size));
    if (known) close(known);
    from = picture.frame;
    object.frames = [from];
  }
  for (const number of run.frames.shown) {
    if (number <= from) continue;
    const passed = await run.frames.at(number);
    if (!passed) continue;
    const { box, corrected } = object.rows.get(number) ?? {};
    const header = box && corrected ? { box: scaled(box, passed.image, source.size) } : {};
    const answer = await object.follower.track(passed, header);
    if (answer && number > last && number < until) run.note(object, answer, passed, false);
    else if (answer) object.frames.push(number);
    close(passed);
  }
  object.sort();
}

/**
 * Continues after the last frame, once all frames that were sent are answered.
 * @param {Run} run
 * @param {Source} source The run's own, or a newly opened one with the same frames.
 */
async function goOn(run, source) {
  await run.alone(async () => {
    // The run was stopped again, or replaced by another one, while `alone` waited.
    if (run.wake || run.isOver) return source === run.source ? undefined : source.stop();
    if (source !== run.source) {
      run.passedOver += run.source.skipped;
      run.source.close?.();
      run.source = run.frames.source = source;
    }
    [run.isResting, run.hasAll, run.failure] = [false, false, undefined];
    for (const object of run.objects) {
      // The user may delete the object, or leave the run, while this one catches up.
      const isGone = () => run.isOver || !run.objects.includes(object);
      if (isGone()) continue;
      object.follower.end();
      object.follower = run.follower();
      await catchUp(run, object).catch((error) => {
        if (!isGone()) throw error;
      });
      if (isGone()) object.follower.end();
    }
    if (!run.isOver) await source.goTo?.(run.picture.time, run.picture.frame);
  });
  if (!run.isOver && !run.isResting) run.play();
}

/** Goes on with a run that has stopped.
 * @param {Run} run
 * @param {() => Promise<Source>} open
 * @param {Run["wake"]} own The run's `wake` at the call. If the run has another one since, this call does nothing. */
export async function wake(run, open, own = run.wake) {
  if (!own || run.wake !== own) return;
  run.wake = undefined;
  try {
    const source = await open();
    await goOn(run, source);
  } catch (error) {
    // Lets the user try again. A failure meanwhile may have set another `wake`, which opens the source anew: keep that.
    run.wake ??= own;
    run.failure = error;
    run.isResting = true;
    run.leaveSessions();
    throw error;
  }
}
