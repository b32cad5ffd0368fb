// A box that was drawn in the last frame: tracked once the frames on their way are answered, before those behind it.

import { Problem } from "./js/problem.js";

/**
 * @typedef {object} Drawn A box until it is answered.
 * @property {Box} box
 * @property {FollowedObject | undefined} object Nothing for a new one.
 * @property {() => void} sending Notes what is there before it, once the frames on their way are answered.
 * @property {() => void} refused Takes back what was noted of it.
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
    // Until then no frame is sent: a new object would not know it.
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
    // An object that cannot be added, or a box that cannot be followed, is no end of what is followed.
    const isRefused = !object || (error instanceof Problem && error.slug === "invalid-box");
    if (isRefused) drawn.refused();
    if (isRefused && !run.isOver) run.told.refuse(error);
    else run.fail(error);
    isLeft = !isRefused;
  }
  run.underWay = run.underWay.filter((other) => other !== sent);
  // What is left comes again where one goes on.
  drawn.isSent = false;
  if (run.drawn === drawn && !isLeft) run.drawn = undefined;
  if (isLeft) run.throttle();
  else sendDrawn(run);
  run.checkEnd();
}
