// What the tracker sees beside the picture: the target as given and as found, the bag with its votes, the figures.

import { canvas, get, input } from "./dom.js";

/**
 * @typedef {import("./js/bagtrack.js").StreamAnswer} Answer
 * @typedef {import("./run.js").Run} Run
 * @typedef {import("./stage.js").Stage} Stage
 */

/** From this width of the window on there is room beside the picture. */
const ROOM = matchMedia("(min-width: 64rem)");
/** Milliseconds after which the bag is shown again. */
const BAG_EVERY = 2000;

export class Seen {
  constructor() {
    this.hasShown = false;
    this.bagShownAt = 0;
    input("see").checked = ROOM.matches;
  }

  get isOn() {
    return input("see").checked;
  }

  reset() {
    this.hasShown = false;
    this.bagShownAt = 0;
  }

  /** The target as it was given.
   * @param {Stage} stage
   * @param {import("./js/bagtrack.js").Box} box */
  given(stage, box) {
    stage.copyPatch(canvas("first-patch"), box);
    stage.copyPatch(canvas("patch"), box);
  }

  /** @param {Run} run
   * @param {Answer | undefined} answer Of the chosen object. */
  figures(run, answer) {
    const set = (/** @type {string} */ id, /** @type {string} */ text) => (get(id).textContent = text);
    set("frames", String(run.tracked));
    set("rate", run.rate.toFixed(0));
    set("trip", `${run.trip.toFixed(0)} ms`);
    set("skipped", String(run.skipped));
    if (!answer) return;
    set("status", answer.status);
    get("status").className = answer.status;
    set("score", answer.score.toFixed(2));
  }

  /**
   * @param {Run} run
   * @param {Answer} answer Of the chosen object.
   * @param {Stage} stage
   */
  take(run, answer, stage) {
    if (!answer.votes || !this.isOn) return;
    this.hasShown = true;
    get("seen").hidden = false;
    this.bag(run);
    showVotes(canvas("votes"), answer.votes);
    if (answer.status !== "lost") stage.copyPatch(canvas("patch"), answer.box);
  }

  /** Shows the bag, now and then.
   * @param {Run} run */
  async bag(run) {
    const now = performance.now();
    if (now - this.bagShownAt < BAG_EVERY) return;
    this.bagShownAt = now;
    // The session may end meanwhile; then the last picture stays.
    const blob = await run.chosen?.follower.bag().catch(() => undefined);
    const shown = /** @type {HTMLImageElement} */ (get("bag"));
    if (!blob) return;
    if (shown.src) URL.revokeObjectURL(shown.src);
    shown.src = URL.createObjectURL(blob);
    shown.hidden = false;
  }
}

/** The votes as bars.
 * @param {HTMLCanvasElement} chart
 * @param {number[]} votes */
function showVotes(chart, votes) {
  const ratio = devicePixelRatio;
  chart.width = Math.round(chart.clientWidth * ratio);
  chart.height = Math.round(chart.clientHeight * ratio);
  const context = chart.getContext("2d");
  if (!context || votes.length === 0) return;
  const most = Math.max(...votes);
  const width = chart.width / votes.length;
  context.fillStyle = getComputedStyle(chart).getPropertyValue("--accent");
  votes.forEach((vote, index) => {
    const height = (vote / most) * (chart.height - 8 * ratio);
    context.fillRect(index * width + ratio, chart.height - height, width - 2 * ratio, height);
  });
  const first = Math.round(100 * votes[0]);
  chart.setAttribute("aria-label", `${votes.length} subspaces; the first has ${first} % of the vote`);
}
