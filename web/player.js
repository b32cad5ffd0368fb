// Going on, pausing, and playing the tracked frames.

import { button } from "./dom.js";
import { DRAW, TAP } from "./editing.js";
import { close } from "./frames.js";
import { BEGINNING, FOLLOWING } from "./message.js";

export class Player {
  /** @param {Page} page */
  constructor(page) {
    this.page = page;
    /** The value of `page.view` while this plays: showing any other frame changes that, and so ends playing. */
    this.view = -1;
  }

  get isPlaying() {
    return this.view === this.page.view && this.page.state === "ended";
  }

  /** The button in the middle: pauses or goes on; after the end, plays the tracked frames. */
  press() {
    const { state } = this.page;
    if (state === "paused") this.goOn();
    else if (state !== "ended") this.page.pause(true);
    else if (this.isPlaying) this.stop();
    else this.play();
  }

  /** Stops playing at the present frame. */
  stop() {
    if (this.isPlaying) this.page.view += 1;
    this.tell();
  }

  /** Shows the tracked frame so many places before or after the present one: skipped frames do not count.
   * @param {number} by */
  step(by) {
    const { run, shown } = this.page;
    if (!run || !shown) return;
    const numbers = run.frames.shown;
    const there = numbers.filter((number) => (by < 0 ? number < shown.frame : number > shown.frame));
    const wanted = there.at(by < 0 ? by : by - 1) ?? numbers.at(by < 0 ? 0 : -1);
    if (wanted !== undefined) this.page.seek(wanted);
  }

  /** Goes on tracking after the last frame. */
  async goOn() {
    const { page } = this;
    const { run, state } = page;
    if (!run || run.isRedoing || run.isOver) return;
    if (run.wantsObject && run.count > 0) return page.say(`There is no object. ${TAP}${DRAW}`);
    const isStopped = run.wake && state === "ended";
    page.enter("following");
    if (isStopped) page.say(run.wantsObject ? BEGINNING : FOLLOWING);
    page.pause(false);
    // `Page.follow` goes on once the first box is answered.
    if (run.wantsObject) return;
    try {
      await run.wake?.();
    } catch (error) {
      if (run === page.run) page.rest(error);
    }
  }

  /** Plays from the present frame; from the first one, if the present one is the last. */
  async play() {
    const { page } = this;
    const { run, shown } = page;
    if (!run || !shown || run.isRedoing) return;
    const numbers = run.frames.shown;
    const left = shown.frame === run.lastFrame ? numbers : numbers.filter((number) => number > shown.frame);
    if (left.length === 0) return;
    const timeOf = (/** @type {number} */ frame) => run.frames.times.get(frame) ?? 0;
    const view = (this.view = page.view += 1);
    // An earlier call that was stopped may still wait while this one plays.
    const isOwn = () => this.isPlaying && view === this.view;
    this.tell();
    const begun = performance.now() - 1000 * timeOf(left[0]);
    for (const [at, frame] of left.entries()) {
      const next = left[at + 1];
      // Skips a frame whose successor is due already.
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

  /** Sets the text of the button in the middle. */
  tell() {
    const { state } = this.page;
    const rests = state === "ended" && !this.isPlaying;
    button("pause").textContent = state === "paused" ? "Go on" : rests ? "Play" : "Pause";
    button("pause").classList.toggle("playing", this.isPlaying);
  }
}
