// The panel beside the picture: where the tracker searches, the target as drawn and as found, the bag with its votes,
// and the figures.

import { scaled } from "./boxes.js";
import { canvas, get, input } from "./dom.js";
import { close } from "./frames.js";
import { copyPatch } from "./stage.js";

/** The least width of the window with room beside the picture: there the panel is on at first. */
const ROOM = matchMedia("(min-width: 64rem)");
/** Milliseconds from one picture of the bag to the next. */
const BAG_EVERY = 1000;

export class Seen {
  constructor() {
    /** @type {{search: import("./search.js").Search, votes: import("./votes.js").Votes} | undefined} */
    this.views = undefined;
    this.hasShown = false;
    this.bagShownAt = 0;
    this.bagSize = 0;
    /** @type {FollowedObject | undefined} The object in the panel. */
    this.shown = undefined;
    input("see").checked = ROOM.matches;
    this.fit();
  }

  get isOn() {
    return input("see").checked;
  }

  /** Imports the modules that draw the panel: the first screen does without. */
  async prepare() {
    const [{ Search }, { Votes }] = await Promise.all([import("./search.js"), import("./votes.js")]);
    this.views ??= { search: new Search(canvas("search")), votes: new Votes(canvas("votes"), canvas("bag")) };
  }

  reset() {
    this.hasShown = false;
    this.shown = undefined;
    this.views?.votes.reset();
    this.fit();
    this.score(undefined);
    for (const id of ["frames", "rate", "trip", "skipped"]) get(id).textContent = "–";
  }

  fit() {
    get("seen-now").hidden = !this.isOn || !this.hasShown;
    get("seen-later").hidden = !this.isOn || this.hasShown;
  }

  /** @param {Run} run */
  figures(run) {
    const set = (/** @type {string} */ id, /** @type {string} */ text) => (get(id).textContent = text);
    set("frames", String(run.tracked));
    set("rate", run.pace.rate.toFixed(0));
    set("trip", `${run.pace.trip.toFixed(0)} ms`);
    set("skipped", String(run.skipped));
  }

  /** @param {Row | undefined} row Of the chosen object in the frame that is shown. */
  score(row) {
    get("status").textContent = row?.status ?? "–";
    get("score").textContent = row?.score.toFixed(2) ?? "–";
    get("figures").className = row?.status ?? "";
    get("figures").style.setProperty("--score", String(row?.score ?? 0));
  }

  /**
   * @param {Run} run
   * @param {Picture} picture
   * @param {Answer} answer Of the chosen object.
   */
  take(run, { image }, { box, status, particles = [], votes }) {
    const [{ chosen }, { views }] = [run, this];
    if (!votes || !this.isOn || !chosen || !views) return;
    this.hasShown = true;
    this.fit();
    if (chosen !== this.shown) this.given(run, chosen);
    this.bag(chosen, votes.length);
    views.search.show(image, box, particles, chosen.color);
    views.votes.show(votes);
    if (status !== "lost") copyPatch(canvas("patch"), image, box);
  }

  /** Shows an object as it was drawn first.
   * @param {Run} run
   * @param {FollowedObject} object */
  async given(run, object) {
    this.shown = object;
    this.bagShownAt = 0;
    const row = [...object.rows.values()].find(({ corrected }) => corrected);
    const picture = row && (await run.frames.at(row.frame).catch(() => undefined));
    if (!picture) return;
    if (this.shown === object) copyPatch(canvas("first-patch"), picture.image, scaled(row.box, picture.image, run.source.size));
    close(picture);
  }

  /** Shows the bag of an object, every `BAG_EVERY` and when its size changes.
   * @param {FollowedObject} object
   * @param {number} size */
  async bag(object, size) {
    const now = performance.now();
    if (now - this.bagShownAt < BAG_EVERY && size === this.bagSize) return;
    this.bagShownAt = now;
    this.bagSize = size;
    // The session may end during the request; then the last picture of the bag stays.
    const blob = await object.follower.bag().catch(() => undefined);
    if (blob && object === this.shown) await this.views?.votes.take(blob);
  }
}
