// Undoing corrections and deletions: each brings back the rows and states of one object as they were before it.

/**
 * @typedef {object} Step An object before it is changed.
 * @property {number} number The object's.
 * @property {Map<number, Row>} [rows] Undefined for an object that is added.
 * @property {TrackerState[]} saves
 * @property {number} last The last frame.
 * @property {number} first The first frame.
 * @property {Follower} [follower] The session, if it can go on after the undo: it has not learned from the correction.
 * @property {FollowedObject} [deleted]
 */

const MOST_STEPS = 50;
/** Most bytes of the states in all steps. Over that, the oldest steps are dropped. */
const MOST_BYTES = 128 << 20;

export class Undoing {
  constructor() {
    /** @type {Step[]} */
    this.steps = [];
  }

  /** A step that restores the present rows and states of an object.
   * @param {Run} run
   * @param {FollowedObject | undefined} object Undefined for an object that is added. */
  before(run, object) {
    const { rows, saves = [], number = run.count, follower } = object ?? {};
    const [first] = run.frames.numbers;
    return { number, rows: rows && new Map(rows), saves: [...saves], last: run.lastFrame, first, follower };
  }

  /** @param {Step} step */
  push(step) {
    this.steps = [...this.steps, step].slice(-MOST_STEPS);
    while (this.steps.length > 1 && bytesIn(this.steps) > MOST_BYTES) this.steps.shift();
  }

  /** Undoes the last change.
   * @param {Run} run
   * @returns {Promise<string | undefined>} The name of the object; undefined where it is gone. */
  async undo(run) {
    const [step] = this.steps.slice(-1);
    const find = () => step.deleted ?? run.objects.find(({ number }) => number === step.number);
    let object = find();
    let name = object?.name;
    // If this throws, the step stays.
    if (object && step.rows) {
      await bringBack(run, object, step);
      forgetBefore(run, step.first);
    } else if (object) run.remove(object);
    else if (run.drawn && !run.drawn.object) {
      // The new object's box may have been sent: its object appears when the service answers.
      name = `Object ${step.number + 1}`;
      run.drawn = undefined;
      await run.alone(async () => {
        object = find();
        if (object) run.remove(object);
      });
    }
    this.drop(step);
    return name;
  }

  /** @param {Step} step One that is undone, or whose box was refused. */
  drop(step) {
    this.steps = this.steps.filter((other) => other !== step);
  }
}

/** The bytes of the states in steps. Most states are in several steps, and count once.
 * @param {Step[]} steps */
function bytesIn(steps) {
  const states = new Set(steps.flatMap(({ saves }) => saves));
  return [...states].reduce((sum, { bytes }) => sum + bytes.length, 0);
}

/** Removes frames before `first`, which were tracked backwards, if no object has a row there.
 * @param {Run} run
 * @param {number} first */
function forgetBefore(run, first) {
  const { frames, objects } = run;
  for (const number of frames.numbers) {
    if (number < first && !objects.some(({ rows }) => rows.has(number))) frames.forget(number);
  }
  run.tracked = frames.times.size;
}

/**
 * @param {Run} run
 * @param {FollowedObject} object
 * @param {Step} step
 */
async function bringBack(run, object, { rows = new Map(), saves, last, follower, deleted }) {
  run.drawn = undefined;
  await run.alone(async () => {
    const isSame = object.follower === follower;
    // Catches up in a new session where rows after `last` depend on the change, or the session goes on being used. A
    // stopped run with `wake` catches up when it goes on.
    const isAnew = !isSame && !run.source.isAbsent && (run.lastFrame > last || (!run.wake && (run.isLocal || !run.isResting)));
    const draft = object.draft(isAnew ? run.follower() : object.follower);
    draft.frames = object.frames;
    draft.rows = new Map([...rows, ...[...object.rows].filter(([frame]) => frame > last)]);
    draft.sort();
    draft.saves = [...saves, ...object.saves.filter(({ after = -1 }) => isSame && after > last)];
    try {
      if (isAnew) await (await import("./again.js")).catchUp(run, draft, last);
    } catch (error) {
      if (isAnew) draft.follower.end();
      throw error;
    }
    if (!deleted && !run.objects.includes(object)) return draft.follower.end();
    if (isAnew) object.follower.end();
    [object.follower, object.frames, object.rows, object.saves] = [draft.follower, draft.frames, draft.rows, draft.saves];
    if (!deleted) return;
    run.objects = [...run.objects, object].sort((one, other) => one.number - other.number);
    run.chosen = object;
  });
}
