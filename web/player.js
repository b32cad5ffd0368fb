// Going on, pausing, and playing what was tracked.

import { button } from "./dom.js";
import { DRAW, TAP } from "./editing.js";
import { close } from "./frames.js";
import { BEGINNING, FOLLOWING } from "./message.js";

export class Player {
  /** @param {Page} page */
  constructor(page) {
    this.page = page;
    /** The frame that it shows now is this view of the page: any other one ends it. */
    this.view = -1;
  }

  get isPlaying() {
    return this.view === this.page.view && this.page.state === "ended";
  }

  /** What the button in the middle does. Where no more is tracked, it plays what was. */
  press() {
    const { state } = this.page;
    if (state === "paused") this.goOn();
    else if (state !== "ended") this.page.pause(true);
    else if (this.isPlaying) this.stop();
    else this.play();
  }

  /** Stays at the frame that it shows. */
  stop() {
    if (this.isPlaying) this.page.view += 1;
    this.tell();
  }

  /** Shows a frame that is so many before or after the one that is shown: numbers have gaps where frames were skipped.
   * @param {number} by */
  step(by) {
    const { run, shown } = this.page;
    if (!run || !shown) return;
    const numbers = run.frames.shown;
    const there = numbers.filter((number) => (by < 0 ? number < shown.frame : number > shown.frame));
    const wanted = there.at(by < 0 ? by : by - 1) ?? numbers.at(by < 0 ? 0 : -1);
    if (wanted !== undefined) this.page.seek(wanted);
  }

  /** Takes the frames after the last one. */
  async goOn() {
    const { page } = this;
    const { run, state } = page;
    if (!run || run.isRedoing || run.isOver) return;
    if (run.wantsObject && run.count > 0) return page.say(`There is no object. ${TAP}${DRAW}`);
    const isStopped = run.wake && state === "ended";
    page.enter("following");
    if (isStopped) page.say(run.wantsObject ? BEGINNING : FOLLOWING);
    page.pause(false);
    // It goes on once its first box is followed.
    if (run.wantsObject) return;
    try {
      await run.wake?.();
    } catch (error) {
      if (run === page.run) page.rest(error);
    }
  }

  /** Plays from the frame that is shown, or from the first one where that is the last. */
  async play() {
    const { page } = this;
    const { run, shown } = page;
    if (!run || !shown || run.isRedoing) return;
    const numbers = run.frames.shown;
    const left = shown.frame === run.lastFrame ? numbers : numbers.filter((number) => number > shown.frame);
    if (left.length === 0) return;
    const timeOf = (/** @type {number} */ frame) => run.frames.times.get(frame) ?? 0;
    const view = (this.view = page.view += 1);
    // One that was paused may still wait, while another plays.
    const isOwn = () => this.isPlaying && view === this.view;
    this.tell();
    const begun = performance.now() - 1000 * timeOf(left[0]);
    for (const [at, frame] of left.entries()) {
      const next = left[at + 1];
      // What is late is passed over, but the last one.
      if (next !== undefined && performance.now() - begun > 1000 * timeOf(next)) continue;
      const picture = await run.frames.at(frame).catch(() => undefined);
      const early = begun + 1000 * timeOf(frame) - performance.now();
      if (early > 0) await new Promise((resolve) => setTimeout(resolve, early));
      if (!isOwn() || (!picture && run.isGone)) break;
      if (!picture) continue;
      const { viewed } = page;
      page.viewed = picture;
      page.show(picture);
      if (viewed) close(viewed);
    }
    if (isOwn()) {
      page.leave();
      page.repaint();
    }
    this.tell();
  }

  /** Says what the button in the middle does. */
  tell() {
    const { state } = this.page;
    const rests = state === "ended" && !this.isPlaying;
    button("pause").textContent = state === "paused" ? "Go on" : rests ? "Play" : "Pause";
    button("pause").classList.toggle("playing", this.isPlaying);
  }
}
