// The page: a state machine, and what is shown in each state.

import { Beginning } from "./begin.js";
import { shownIn } from "./boxes.js";
import { button, canvas, get } from "./dom.js";
import { Editing } from "./editing.js";
import { LocalClient } from "./js/local.js";
import { Problem } from "./js/problem.js";
import { BEGINNING, FOLLOWING, GO_ON, Message } from "./message.js";
import { Opening } from "./opening.js";
import { Player } from "./player.js";
import { words } from "./problems.js";
import { Seen } from "./seen.js";
import { Stage } from "./stage.js";
import { Timeline } from "./timeline.js";

/**
 * @typedef {"start" | "opening" | "first" | "following" | "paused" | "ended"} State `first` waits for the first box;
 *   from `following` on there are rows. The attributes `data-in` and `data-on` of index.html list the states.
 */

/** Frames that the timeline has room for at the beginning. */
const LEAST_PART = 256;

export class Page {
  constructor() {
    this.local = new LocalClient();
    /** @type {Promise<Client> | undefined} */
    this.client = undefined;
    this.message = new Message(get("message"));
    this.stage = new Stage(canvas("picture"), canvas("overlay"));
    this.timeline = new Timeline(canvas("timeline"), (frame) => this.seek(frame), (by) => this.player.step(by));
    this.seen = new Seen();
    this.editing = new Editing(this);
    this.opening = new Opening(this);
    this.beginning = new Beginning(this);
    this.player = new Player(this);
    /** @type {Run | undefined} */
    this.run = undefined;
    /** @type {Picture | undefined} The earlier frame on the screen; undefined where that is the last. */
    this.viewed = undefined;
    /** @type {number[][] | undefined} The particles of the last frame: x, y, width, weight. */
    this.particles = undefined;
    /** Counts the requests to show a frame: one that is read after a later request is dropped. */
    this.view = 0;
    /** @type {Promise<Picture> | undefined} The camera's picture when the drawing began. */
    this.frozen = undefined;
    /** Whether there are results that were not saved. */
    this.isUnsaved = false;
    this.hasKey = false;
    /** @type {(() => void) | undefined} Repeats what failed for want of a key. */
    this.again = undefined;
    /** Called when rows or objects have changed. */
    this.changed = () => {};
    /** Makes it possible for a run that stops to go on later. */
    this.letGoOn = () => {};
    /** @type {State} */
    this.state = "start";
    this.enter("start");
  }

  /** The client of the service, imported on first use: tracking in the page needs none. */
  service() {
    // Requests that fail for longer than `patience` milliseconds are reported.
    this.client ??= import("./js/client.js").then(({ Client }) => new Client(new URL(".", location.href), { patience: 1500 }));
    this.client.catch(() => (this.client = undefined));
    return this.client;
  }

  get hasRows() {
    return this.state === "following" || this.state === "paused" || this.state === "ended";
  }

  /** Whether a stopped run can go on after its last frame. */
  get canGoOn() {
    const { run } = this;
    return run?.wake !== undefined && run.source.goTo !== undefined && !run.isGone;
  }

  /** The frame that is shown.
   * @returns {Picture | undefined} */
  get shown() {
    return this.viewed ?? this.run?.picture;
  }

  /** @param {State} state */
  enter(state) {
    const sources = /** @type {HTMLDetailsElement} */ (get("sources"));
    this.state = state;
    document.body.dataset.state = state;
    const has = (/** @type {string | undefined} */ states) => (states ?? "").split(" ").includes(state);
    for (const element of /** @type {NodeListOf<HTMLElement>} */ (document.querySelectorAll("[data-in]"))) {
      element.hidden = !has(element.dataset.in);
    }
    for (const control of /** @type {NodeListOf<HTMLButtonElement>} */ (document.querySelectorAll("[data-on]"))) {
      control.disabled = !has(control.dataset.on);
    }
    get("begin").hidden = state !== "first" || !this.run?.source.goTo;
    get("hand-over").hidden = !this.run?.isLocal;
    this.player.tell();
    get("resume").hidden = state !== "ended" || !this.canGoOn;
    sources.open = state === "start";
  }

  /** @param {string} text
   * @param {boolean} [isBad] */
  say(text, isBad) {
    this.message.say(text, isBad);
  }

  /** @param {unknown} error
   * @param {() => void} [again] Repeats what failed, after a key was given.
   * @param {string} [way] A sentence on what the user can do, where no key is wanted. */
  fail(error, again, way = this.wayBack(error)) {
    this.again = again;
    const wantsKey = error instanceof Problem && error.slug === "unauthorized";
    get("key-form").hidden = !wantsKey;
    if (wantsKey) get("key").focus();
    this.say(words(error, this.hasKey) + (wantsKey ? "" : way), true);
    const hasEnded = this.run?.isResting && !this.run.wake;
    if (!hasEnded || !this.hasRows) return;
    this.enter("ended");
    this.changed();
  }

  /** The tracker or the source's connection has failed. The run stops, and may go on from its last frame.
   * @param {unknown} error */
  rest(error) {
    this.letGoOn();
    this.enter("ended");
    this.repaint();
    this.changed();
    if (this.canGoOn) this.fail(error, () => this.player.goOn(), GO_ON);
    else this.fail(error, undefined, this.wayBack(error) || " Choose the video or the camera again.");
  }

  /** What the user can do if the run's file is gone; empty for other errors.
   * @param {unknown} error */
  wayBack(error) {
    const { failure, isGone, source } = this.run ?? {};
    return isGone && error === failure ? ` Choose ${source?.files?.[1] ? "the images" : source?.name} again.` : "";
  }

  reset() {
    this.run?.stop();
    this.run = undefined;
    this.again = undefined;
    this.frozen = undefined;
    this.particles = undefined;
    this.isUnsaved = false;
    this.editing.reset();
    this.seen.reset();
    this.timeline.show([], 0, 0, 0);
    get("handed").replaceChildren();
    get("key-form").hidden = true;
    this.leave();
  }

  /** @returns {RunTold} */
  told() {
    return {
      answer: (picture, answer) => this.answered(picture, answer),
      fail: (error) => this.fail(error),
      rest: (error) => this.rest(error),
      refuse: (error) => this.editing.refuse(error),
      line: (isUp) => this.message.line(isUp),
      anew: () => this.say("The service had lost the session. It goes on from the last box: draw again if it is off."),
      end: () => this.end("The video has ended. Save the results, or choose another one."),
    };
  }

  /** Shows the camera's live picture, until a box is drawn. */
  preview() {
    this.run?.source.preview?.((image) => this.stage.show(image));
  }

  /**
   * @param {Run} own
   * @param {Box} box
   */
  async follow(own, box) {
    this.message.follow();
    const { picture } = own;
    await this.beginning.going;
    const { state } = this;
    // The user may have drawn another box meanwhile, or opened another source.
    if (own !== this.run || state !== "first") return;
    this.enter("following");
    this.stage.draw(box, own.source.size.width);
    this.say(BEGINNING);
    try {
      // The bar was moved after the box was drawn: go back to the picture with the box.
      if (picture !== own.picture) own.picture = (await own.source.goTo?.(picture.time, picture.frame)) ?? picture;
      if (this.frozen) own.picture = await this.frozen;
      await own.begin(box);
      if (own !== this.run) return;
      this.stage.draw(undefined);
      if (this.state === "ended") return;
      this.say(FOLLOWING);
      // The run was stopped before its first answer, and "Go on" was pressed.
      if (own.wake && this.state === "following") await this.player.goOn();
    } catch (error) {
      if (own !== this.run) return;
      this.enter(own.isResting && !own.wake ? "ended" : "first");
      this.fail(error, () => this.follow(own, box));
      // The box stays while the page waits for a key.
      if (get("key-form").hidden) this.stage.draw(undefined);
    }
  }

  /** Shows a frame with the objects in it.
   * @param {Picture} shown
   * @param {number[][]} [particles] */
  show(shown, particles) {
    const { run } = this;
    if (!run) return;
    this.stage.show(shown.image, shownIn(run, shown.frame, shown.image, run.chosen), particles);
    this.timeline.show([...(run.chosen?.rows.values() ?? [])], run.lastFrame, shown.frame, endOf(run));
    this.editing.list.show(run.objects, run.chosen);
    this.editing.show();
    this.seen.score(run.chosen?.rows.get(shown.frame));
    const isKnown = run.chosen?.rows.has(shown.frame) ?? false;
    button("backwards").disabled = !isKnown || shown.frame === 0 || run.isOver;
  }

  repaint() {
    const isLast = this.seen.isOn && !this.viewed && this.seen.shown === this.run?.chosen;
    if (this.hasRows && this.shown) this.show(this.shown, isLast ? this.particles : undefined);
  }

  /** @type {RunTold["answer"]} */
  answered(shown, answer) {
    const { run } = this;
    if (!run) return;
    this.particles = answer?.particles;
    // An earlier frame that the user looks at stays on the screen.
    if (!this.viewed) this.show(shown, answer?.particles);
    this.seen.figures(run);
    this.isUnsaved = run.frames.times.size > 1;
    this.changed();
    if (!answer) return;
    this.seen.take(run, shown, answer);
    // Frames in flight are answered after a stop: their status is no news.
    if (this.state !== "ended") this.message.take(answer.status);
  }

  /** Pauses, and shows the tracked frame nearest to this one.
   * @param {number} frame */
  async seek(frame) {
    const { run } = this;
    if (!run || !this.hasRows || run.isRedoing || frame === this.shown?.frame) return;
    const { shown } = run.frames;
    if (shown.length === 0) return;
    const wanted = (this.view += 1);
    this.pause(true);
    const nearest = shown.reduce((one, other) => (Math.abs(other - frame) < Math.abs(one - frame) ? other : one));
    if (nearest === run.lastFrame) {
      this.leave();
      return this.repaint();
    }
    const picture = await run.frames.at(nearest).catch((error) => void this.fail(error));
    if (!picture || wanted !== this.view || run !== this.run) return;
    this.viewed = picture;
    this.show(picture);
  }

  /** Shows the last frame again. */
  leave() {
    this.view += 1;
    this.viewed = undefined;
  }

  /** @param {boolean} isPaused */
  pause(isPaused) {
    if (this.state === "ended") this.player.tell();
    else this.enter(isPaused ? "paused" : "following");
    if (!isPaused) this.leave();
    this.repaint();
    this.run?.pause(isPaused);
  }

  /** Takes no more frames.
   * @param {string} text */
  end(text) {
    this.run?.rest();
    this.enter("ended");
    this.say(text);
    this.repaint();
    this.changed();
  }
}

/** The frame at the right end of the timeline; 0 for the last tracked one. While a long video is tracked, the timeline
 * shows a part of it, which doubles as tracking nears its end: else the tracked part would be too narrow to pick from.
 * @param {Run} run */
function endOf({ hasAll, lastFrame, source: { duration = 0, rate = 0 } }) {
  const last = Math.round(duration * rate);
  const part = 2 ** Math.ceil(Math.log2(Math.max(LEAST_PART, 1.25 * lastFrame)));
  return hasAll || !Number.isFinite(last) ? 0 : Math.min(last, part);
}
