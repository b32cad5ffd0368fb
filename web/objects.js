// The objects that are followed, each with its rows.

/**
 * @typedef {import("./follower.js").Follower} Follower
 * @typedef {import("./js/bagtrack.js").Box} Box
 *
 * @typedef {object} Row What is known of an object in a frame.
 * @property {number} frame Its number in the video.
 * @property {number} time Seconds from the beginning of the video.
 * @property {Box} box In the video's own pixels.
 * @property {number} score
 * @property {"tracking" | "uncertain" | "lost"} status
 * @property {boolean} corrected Whether the box was drawn.
 */

export const MOST_OBJECTS = 16;
/** Frames after which the state is saved, so that one can go on from there. */
export const SAVE_EVERY = 30;
/** Told apart on any picture, together with the dark line around them. */
const COLORS = [
  ...["#3ddc97", "#ffb000", "#5aa9ff", "#ff6b9d", "#c9a0ff", "#f4f165", "#ff8a5c", "#45e0e0"],
  ...["#a4e05a", "#ff5cf0", "#9db4ff", "#ffd9a0", "#5cffb4", "#e0a45a", "#d0d0d0", "#ff7a7a"],
];

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
    /** @type {{bytes: Uint8Array<ArrayBuffer>, frames: number[]}[]} States, oldest first. */
    this.saves = [];
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
    // Without it one goes on from an older one.
    const bytes = await Promise.resolve()
      .then(() => this.follower.save())
      .catch(() => undefined);
    if (bytes) this.saves.push({ bytes, frames });
  }

  /** Follows it with another session, from a state before a frame of the video.
   * @param {Follower} follower
   * @param {number} frame
   * @returns {Promise<number | undefined>} The frame of the video that the state is of; nothing where there is none. */
  async goBackBefore(frame, follower) {
    this.follower.end();
    this.follower = follower;
    while (this.saves.length > 0) {
      const { bytes, frames } = this.saves[this.saves.length - 1];
      const at = await follower.restore(bytes);
      if (frames[at] < frame) {
        this.frames = frames.slice(0, at + 1);
        return frames[at];
      }
      this.saves.pop();
    }
    this.frames = [];
    return undefined;
  }

  /** Forgets the rows from a frame on.
   * @param {number} frame */
  forgetFrom(frame) {
    for (const number of [...this.rows.keys()]) if (number >= frame) this.rows.delete(number);
  }

  /** The first frame after this one where the status gets worse; else the first of all.
   * @param {number} frame */
  nextDoubtful(frame) {
    const rows = [...this.rows.values()];
    const worse = rows.filter((row, at) => row.status !== "tracking" && rows[at - 1]?.status !== row.status);
    return (worse.find((row) => row.frame > frame) ?? worse[0])?.frame;
  }
}
