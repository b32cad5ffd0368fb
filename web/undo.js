// Undoing corrections: each brings back the rows and states of one object as they were before it.

/**
 * @typedef {import("./objects.js").FollowedObject} FollowedObject
 * @typedef {import("./run.js").Run} Run
 *
 * @typedef {object} Step An object before it is corrected.
 * @property {number} number Of the object.
 * @property {Map<number, import("./objects.js").Row>} [rows] Nothing for an object that is added.
 * @property {import("./kept.js").State[]} saves
 * @property {number} last The last frame.
 * @property {import("./follower.js").Follower} [follower] The session, where it learns nothing of the correction.
 */

const MOST_STEPS = 50;

export class Undoing {
  constructor() {
    /** @type {Step[]} */
    this.steps = [];
  }

  /** What brings an object back to how it is now.
   * @param {Run} run
   * @param {FollowedObject | undefined} object Nothing for one that is added.
   * @returns {Step} */
  before(run, object) {
    const { rows, saves = [], number = run.count, follower } = object ?? {};
    return { number, rows: rows && new Map(rows), saves: [...saves], last: run.lastFrame, follower };
  }

  /** @param {Step} step */
  push(step) {
    this.steps = [...this.steps, step].slice(-MOST_STEPS);
  }

  /** Brings back what was before the last correction of an object that there is.
   * @param {Run} run
   * @returns {Promise<string>} The name of the object; empty where there is none. */
  async undo(run) {
    for (let step = this.steps.pop(); step; step = this.steps.pop()) {
      const object = run.objects.find(({ number }) => number === step?.number);
      if (!object) continue;
      if (step.rows) await bringBack(run, object, step);
      else run.remove(object);
      return object.name;
    }
    return "";
  }
}

/**
 * @param {Run} run
 * @param {FollowedObject} object
 * @param {Step} step
 */
async function bringBack(run, object, { rows = new Map(), saves, last, follower }) {
  await run.alone(async () => {
    const later = [...object.rows].filter(([frame]) => frame > last);
    object.rows = new Map([...rows, ...later]);
    object.sort();
    const isSame = object.follower === follower;
    object.saves = [...saves, ...object.saves.filter(({ after = -1 }) => isSame && after > last)];
    // A run that goes on later catches up then.
    const isAtWork = !run.wake && (run.isLocal || !run.isResting);
    if (!isSame && isAtWork) await (await import("./again.js")).catchUp(run, [object]);
  });
}
