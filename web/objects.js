// The objects that are followed, each with its rows.

import { Problem } from "./js/problem.js";

export const MOST_OBJECTS = 16;
/** Frames after which the state is saved, so that one can go on from there. */
export const SAVE_EVERY = 30;
/** Most states of an object, of 70 kB each. */
const MOST_SAVES = 128;
/** Told apart on any picture, together with the dark line around them. */
const COLORS = [
  ...["#3ddc97", "#ffb000", "#5aa9ff", "#ff6b9d", "#c9a0ff", "#f4f165", "#ff8a5c", "#45e0e0"],
  ...["#a4e05a", "#ff5cf0", "#9db4ff", "#ffd9a0", "#5cffb4", "#e0a45a", "#d0d0d0", "#ff7a7a"],
];

/** A service that was started again with other keys takes no states of before. What else fails is a failure.
 * @param {unknown} error
 * @returns {undefined} */
export function refusedState(error) {
  if (!(error instanceof Problem && error.slug === "invalid-snapshot")) throw error;
}

/** Gives up states where there are too many. What is left lies closer the nearer the last frame is: the frames after a
 * correction are tracked again, and those from a state to it come on top.
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
    /** @type {Map<number, Row>} By frames of the video, ascending. */
    this.rows = new Map();
    /** @type {number[]} The frame of the video that each frame of the session was. */
    this.frames = [];
    /** @type {TrackerState[]} Oldest first. */
    this.saves = [];
    /** Whether the service has not taken a state. */
    this.isForgotten = false;
  }

  /** @param {Row} row */
  note(row) {
    this.frames.push(row.frame);
    this.rows.set(row.frame, row);
    if (this.frames.length % SAVE_EVERY === 0) this.save();
  }

  /** Has a row that the session at work knows nothing of.
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
    // Without it one goes on from an older one.
    const bytes = await Promise.resolve()
      .then(() => this.follower.save())
      .catch(() => undefined);
    // Meanwhile it may have gone back to an earlier frame.
    if (bytes && frames === this.frames) this.saves.push({ bytes, frames, after });
    thin(this.saves);
  }

  /** The same object in another session: what is tracked with it counts when it is adopted.
   * @param {Follower} follower */
  draft(follower) {
    const draft = new FollowedObject(this.number, follower);
    draft.saves = [...this.saves];
    return draft;
  }

  /** Takes the rows of a draft, and its session where that has come to the last frame.
   * @param {FollowedObject} draft
   * @param {number} until Its rows are of frames before this one. */
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

  /** The first frame after this one with a box that was drawn; infinite where there is none.
   * @param {number} frame */
  drawnAfter(frame) {
    const drawn = [...this.rows.values()].filter((row) => row.corrected && row.frame > frame);
    return Math.min(Infinity, ...drawn.map((row) => row.frame));
  }

  /** Goes on with its session from a state before a frame of the video.
   * @param {number} frame
   * @returns {Promise<number | undefined>} The frame of the video that the state is of; nothing where there is none. */
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

  /** The first frame after this one where the status gets worse; else the first of all.
   * @param {number} frame */
  nextDoubtful(frame) {
    const rows = [...this.rows.values()];
    const worse = rows.filter((row, at) => row.status !== "tracking" && rows[at - 1]?.status !== row.status);
    return (worse.find((row) => row.frame > frame) ?? worse[0])?.frame;
  }
}
