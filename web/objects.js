// The objects that are followed, each with its rows: its boxes by frame.

import { Problem } from "./js/problem.js";

export const MOST_OBJECTS = 16;
/** Frames between two saved states of the tracker, from which tracking can go on. */
export const SAVE_EVERY = 30;
/** Most saved states of an object; a state has about 70 kB. */
const MOST_SAVES = 128;
/** Distinguishable on any picture, together with the dark outline of a box. */
const COLORS = [
  ...["#3ddc97", "#ffb000", "#5aa9ff", "#ff6b9d", "#c9a0ff", "#f4f165", "#ff8a5c", "#45e0e0"],
  ...["#a4e05a", "#ff5cf0", "#9db4ff", "#ffd9a0", "#5cffb4", "#e0a45a", "#d0d0d0", "#ff7a7a"],
];

/** Turns the refusal of a state into undefined: a service that restarted with other keys refuses older states. Throws
 * any other error.
 * @param {unknown} error
 * @returns {undefined} */
export function refusedState(error) {
  if (!(error instanceof Problem && error.slug === "invalid-snapshot")) throw error;
}

/** Drops states over `MOST_SAVES`, so that the rest lie closer together near the last frame. A correction costs the
 * frames after it, and those between it and the state before: a gap counts relative to the distance to the last frame.
 * @param {TrackerState[]} saves */
function thin(saves) {
  const at = (/** @type {number} */ index) => saves[index].after ?? 0;
  while (saves.length > MOST_SAVES) {
    const cost = (/** @type {number} */ index) => (at(index + 1) - at(index - 1)) / (at(saves.length - 1) - at(index));
    let least = 1;
    for (let index = 2; index < saves.length - 1; index += 1) if (cost(index) < cost(least)) least = index;
    saves.splice(least, 1);
  }
}

export class FollowedObject {
  /**
   * @param {number} number
   * @param {Follower} follower
   */
  constructor(number, follower) {
    this.number = number;
    this.name = `Object ${number + 1}`;
    this.color = COLORS[number % COLORS.length];
    this.isShown = true;
    this.follower = follower;
    /** @type {Map<number, Row>} By frame number of the video, ascending. */
    this.rows = new Map();
    /** @type {number[]} For each frame of the session, its number in the video. */
    this.frames = [];
    /** @type {TrackerState[]} Oldest first. */
    this.saves = [];
    /** Whether the service has refused a state. */
    this.isForgotten = false;
  }

  /** @param {Row} row */
  note(row) {
    this.frames.push(row.frame);
    this.rows.set(row.frame, row);
    if (this.frames.length % SAVE_EVERY === 0) this.save();
  }

  /** Adds a row that the present session has not tracked.
   * @param {Row} row */
  set(row) {
    this.rows.set(row.frame, row);
  }

  /** Brings the rows into the order of the frames. */
  sort() {
    this.rows = new Map([...this.rows].sort(([one], [other]) => one - other));
  }

  async save() {
    const { frames } = this;
    const after = frames[frames.length - 1];
    // If saving fails, tracking again begins at an older state.
    const bytes = await Promise.resolve()
      .then(() => this.follower.save())
      .catch(() => undefined);
    // `goBackBefore` may have replaced `frames` during the save: then the state is of another past.
    if (bytes && frames === this.frames) this.saves.push({ bytes, frames, after });
    thin(this.saves);
  }

  /** The same object in another session. Its rows take effect when `adopt` is called with it.
   * @param {Follower} follower */
  draft(follower) {
    const draft = new FollowedObject(this.number, follower);
    draft.saves = [...this.saves];
    return draft;
  }

  /** Takes the rows of a draft; its session too, if that has tracked up to the last frame.
   * @param {FollowedObject} draft
   * @param {number} until The draft's rows end before this frame; infinite where they reach the last one. */
  adopt(draft, until) {
    this.rows = new Map([...this.rows, ...draft.rows]);
    this.sort();
    if (until < Infinity) {
      this.saves = [...draft.saves, ...this.saves.filter(({ after = -1 }) => after >= until)];
      return thin(this.saves);
    }
    this.follower.end();
    [this.follower, this.frames, this.saves] = [draft.follower, draft.frames, draft.saves];
  }

  /** The first frame after this one with a drawn box; infinite where there is none.
   * @param {number} frame */
  drawnAfter(frame) {
    const drawn = [...this.rows.values()].filter((row) => row.corrected && row.frame > frame);
    return Math.min(Infinity, ...drawn.map((row) => row.frame));
  }

  /** Restores the session from the last state before a frame of the video. Drops later and refused states.
   * @param {number} frame
   * @returns {Promise<number | undefined>} The frame of the state; undefined where there is no state. */
  async goBackBefore(frame) {
    while (this.saves.length > 0) {
      const { bytes, frames } = this.saves[this.saves.length - 1];
      const at = await this.follower.restore(bytes).catch(refusedState);
      this.isForgotten ||= at === undefined;
      if (at !== undefined && frames[at] < frame) {
        this.frames = frames.slice(0, at + 1);
        return frames[at];
      }
      this.saves.pop();
    }
    this.frames = [];
    return undefined;
  }

  /** The next frame after this one where a status other than `tracking` begins; after the last such frame, the first.
   * @param {number} frame */
  nextDoubtful(frame) {
    const rows = [...this.rows.values()];
    const worse = rows.filter((row, at) => row.status !== "tracking" && rows[at - 1]?.status !== row.status);
    return (worse.find((row) => row.frame > frame) ?? worse[0])?.frame;
  }
}
