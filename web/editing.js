// What the user does to objects: draw and correct boxes in any frame, track again, name and delete.

import { BoxDrawing } from "./box.js";
import { button, canvas, get } from "./dom.js";
import { ObjectList } from "./list.js";
import { MOST_OBJECTS } from "./objects.js";
import { words } from "./problems.js";
import { Undoing } from "./undo.js";

/** The module for tracking again, imported when a source opens: the first screen does without. */
export const again = () => import("./again.js");

export const DRAW = "Draw a box around what to follow.";
export const TAP = matchMedia("(pointer: coarse)").matches ? "Tap Draw. " : "";
const ABSENT = "Nothing can be tracked without the video.";
const ADD = "Draw a box around the object to add.";
const ON_ITS_WAY = "The box of the new object is on its way. Draw once it is followed.";

export class Editing {
  /** @param {Page} page */
  constructor(page) {
    this.page = page;
    /** Whether the next box makes a new object. */
    this.isAdding = false;
    this.undoing = new Undoing();
    /** Cancels the tracking of frames again. */
    this.cancelling = new AbortController();
    this.drawing = this.makeDrawing();
    this.list = this.makeList();
  }

  makeDrawing() {
    return new BoxDrawing(canvas("picture"), {
      start: () => this.startDrawing(),
      change: (box) => {
        this.page.stage.draw(box, this.page.run?.source.size.width);
        if (box) return;
        if (this.page.hasRows) this.page.run?.pause(this.page.state === "paused");
        else this.page.preview();
      },
      finish: (box) => this.drawn(box),
      tap: () => {
        if (this.page.run && !this.page.run.isOver) this.page.say(`${TAP}${this.page.hasRows ? "Then draw the box anew." : DRAW}`);
      },
      arm(isArmed) {
        get("picture").classList.toggle("armed", isArmed);
        get("draw").setAttribute("aria-pressed", String(isArmed));
      },
    });
  }

  /** Whether the video is not at hand; then also asks the user to choose it.
   * @param {Run} run */
  wantsVideo({ source }) {
    if (source.isAbsent) this.page.say(`${ABSENT} Choose ${source.name} first.`, true);
    return source.isAbsent ?? false;
  }

  startDrawing() {
    const { run } = this.page;
    if (!run || run.isOver || run.isRedoing || this.page.state === "opening" || this.wantsVideo(run)) return false;
    // The first box was sent, and is not answered yet.
    if (this.page.hasRows && run.count === 0) return false;
    const { drawn, isResting, underWay } = run;
    // A second box cannot follow one of a new object that still waits; only a stopped run replaces it.
    if (drawn && !drawn.object && !(isResting && underWay.length === 0)) {
      this.page.say(ON_ITS_WAY);
      return false;
    }
    this.page.player.stop();
    if (this.page.hasRows) run.pause(true);
    else if (run.source.isLive) {
      const frozen = (this.page.frozen = run.source.first());
      frozen.then(({ image }) => this.page.state === "first" && this.page.stage.show(image)).catch((error) => this.page.fail(error));
    }
    return true;
  }

  /** Takes a box that was drawn: the first one, a correction, or one for a new object.
   * @param {Box} box */
  drawn(box) {
    const { run } = this.page;
    if (!run) return;
    // The first box stays on the picture until the tracker has answered.
    if (this.page.state === "first") return void this.page.follow(run, box);
    this.page.stage.draw(undefined);
    const object = this.isAdding ? undefined : run.chosen;
    this.add(false);
    run.pause(this.page.state === "paused");
    if (this.page.viewed || run.isResting) return void this.trackOn(run, object, (this.page.viewed ?? run.picture).frame, box);
    // Undo needs a new session, because the present one learns from the box: so `follower` is not kept.
    const before = () => ({ ...this.undoing.before(run, object), follower: undefined });
    const step = before();
    this.undoing.push(step);
    run.draw(box, object, () => Object.assign(step, before()), () => this.undoing.drop(step));
    this.page.say(object ? "The box is corrected." : "Following another object.");
  }

  /** Follows an object again from an earlier frame on.
   * @param {Run} run
   * @param {FollowedObject | undefined} object
   * @param {number} frame
   * @param {Box} box */
  trackOn(run, object, frame, box) {
    const anew = object ? " anew" : "";
    const tell = (/** @type {number} */ done) => this.page.say(`Following${anew}: frame ${done} of ${run.lastFrame}.`);
    return this.tracksAgain(run, object, async (signal) => {
      const { trackOn } = await again();
      const isWhole = await trackOn(run, object, frame, box, { tell, signal });
      const from = `Followed${anew} from frame ${frame}`;
      return isWhole ? `${from}.` : `${from}, by the box alone: the service had lost what was learned before.`;
    });
  }

  /** Follows the chosen object backwards from the frame that is shown. */
  async trackBack() {
    const { run, shown } = this.page;
    if (!run?.chosen || !shown || run.isRedoing || run.isOver || this.wantsVideo(run)) return;
    this.page.pause(true);
    const { chosen } = run;
    const tell = (/** @type {number} */ at) => this.page.say(`Following backwards: frame ${at}.`);
    await this.tracksAgain(run, chosen, async (signal) => {
      const { trackBack } = await again();
      const count = await trackBack(run, chosen, shown.frame, { tell, signal });
      return count > 0 ? `Followed ${count} frames backwards.` : "There is no frame before it, or a box was drawn there.";
    });
  }

  /**
   * @param {Run} run
   * @param {FollowedObject | undefined} object
   * @param {(signal: AbortSignal) => Promise<string>} track Resolves with the message for the user.
   */
  async tracksAgain(run, object, track) {
    const before = this.undoing.before(run, object);
    this.page.player.stop();
    const { signal } = (this.cancelling = new AbortController());
    get("cancel").hidden = false;
    try {
      const done = await track(signal);
      if (run !== this.page.run) return;
      if (signal.aborted) return this.page.say("Cancelled. Nothing has changed.");
      this.undoing.push(before);
      this.page.isUnsaved = true;
      this.page.say(done);
      this.page.seen.figures(run);
      this.page.changed();
    } catch (error) {
      if (run === this.page.run) this.page.fail(error, () => this.tracksAgain(run, object, track));
    } finally {
      get("cancel").hidden = true;
      if (run === this.page.run) this.page.repaint();
    }
  }

  cancel() {
    this.cancelling.abort();
  }

  /** Escape: drops the box that is being drawn; without one, ends drawing and cancels the tracking of frames again. */
  escape() {
    const { drawing } = this;
    if (drawing.box || drawing.from) return drawing.cancel();
    if (this.isAdding) this.toggleAdding();
    drawing.arm(false);
    this.cancel();
  }

  async undo() {
    const { run } = this.page;
    if (!run || run.isRedoing || run.isOver || this.undoing.steps.length === 0) return;
    try {
      const name = await this.undoing.undo(run);
      if (run !== this.page.run) return;
      const done = name ? `The last change to ${name} is undone.` : "There is nothing to undo.";
      this.page.say(done + (run.chosen ? "" : ` ${TAP}${DRAW}`));
      this.page.isUnsaved = true;
      // The frame on the screen may be one that was tracked backwards, and that undoing has removed.
      if (!run.frames.times.has(this.page.shown?.frame ?? 0)) this.page.leave();
      this.page.seen.figures(run);
      this.page.repaint();
      this.page.changed();
    } catch (error) {
      if (run === this.page.run) this.page.fail(error, () => this.undo());
    }
  }

  /** Says that the tracker refused a box.
   * @param {unknown} error */
  refuse(error) {
    this.page.say(words(error, this.page.hasKey), true);
    this.page.repaint();
  }

  show() {
    button("undo").disabled = this.undoing.steps.length === 0;
  }

  reset() {
    this.cancel();
    this.undoing = new Undoing();
    this.drawing.cancel();
    this.drawing.arm(false);
    this.add(false);
    this.list.show([], undefined);
    this.show();
    button("backwards").disabled = true;
  }

  /** Says whether the next box makes a new object.
   * @param {boolean} isOn */
  add(isOn) {
    this.isAdding = isOn;
    get("add").setAttribute("aria-pressed", String(isOn));
  }

  toggleAdding() {
    const { run } = this.page;
    if (!run || run.isOver || this.wantsVideo(run)) return;
    const isOn = !this.isAdding;
    if (isOn && run.objects.length >= MOST_OBJECTS) return this.page.say(`No more than ${MOST_OBJECTS} objects are followed.`);
    this.add(isOn);
    this.drawing.arm(isOn);
    this.page.say(isOn ? ADD : "Adding is given up.");
  }

  makeList() {
    return new ObjectList(get("list"), {
      choose: (object) => {
        if (this.page.run) this.page.run.chosen = object;
        this.page.repaint();
      },
      remove: (object) => {
        const { run, seen } = this.page;
        if (!run) return;
        this.undoing.push({ ...this.undoing.before(run, object), follower: undefined, deleted: object });
        run.remove(object);
        if (object === seen.shown || !run.chosen) seen.reset();
        seen.figures(run);
        if (!run.chosen) this.page.say(TAP + DRAW);
        this.page.isUnsaved = true;
        this.page.repaint();
        this.page.changed();
      },
      doubt: (object) => {
        if (!this.page.run) return;
        this.page.run.chosen = object;
        const frame = object.nextDoubtful(this.page.shown?.frame ?? 0);
        if (frame === undefined) this.page.say(`${object.name} is tracked in all frames.`);
        else this.page.seek(frame);
        this.page.repaint();
      },
      change: () => {
        this.page.repaint();
        this.page.changed();
      },
    });
  }
}
