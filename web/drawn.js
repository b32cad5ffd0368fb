// A box that the user drew in the last frame. It is sent when all frames in flight are answered, before later frames.

import { Problem } from "./js/problem.js";

/**
 * @typedef {object} Drawn A drawn box, until the tracker has answered.
 * @property {Box} box
 * @property {FollowedObject | undefined} object Undefined for a new object.
 * @property {() => void} sending Called right before the box is sent; saves the state for undo.
 * @property {() => void} refused Drops what `sending` saved.
 * @property {boolean} [isSent]
 */

/** Tracks the box that was drawn, if there is one and no frame is on its way.
 * @param {Run} run */
export async function sendDrawn(run) {
  const { drawn, picture } = run;
  if (!drawn || run.isRedoing || run.underWay.length > 0) return run.throttle();
  const { box, object } = drawn;
  drawn.sending();
  const sent = { picture, at: performance.now() };
  run.underWay.push(sent);
  let isLeft = false;
  try {
    // No frame is sent until the new object is added: its session would miss that frame.
    if (!object) await run.add(box);
    const asked = object?.follower.track(picture, { box });
    drawn.isSent = asked !== undefined;
    run.throttle();
    const answer = await asked;
    if (object && answer) {
      run.note(object, answer, picture, true);
      run.told.answer(picture, answer);
    }
    isLeft = run.isResting && object !== undefined && !answer;
  } catch (error) {
    // Where an object cannot be added, or the tracker refuses a box, the run goes on with the other objects.
    const isRefused = !object || (error instanceof Problem && error.slug === "invalid-box");
    if (isRefused) drawn.refused();
    if (isRefused && !run.isOver) run.told.refuse(error);
    else run.fail(error);
    isLeft = !isRefused;
  }
  run.underWay = run.underWay.filter((other) => other !== sent);
  // A box without an answer stays in `drawn`, and is sent again when the run goes on.
  drawn.isSent = false;
  if (run.drawn === drawn && !isLeft) run.drawn = undefined;
  if (isLeft) run.throttle();
  else sendDrawn(run);
  run.checkEnd();
}
