// Where to begin in a source: a bar under its first frame, until a box is drawn.

import { get, input } from "./dom.js";

export class Beginning {
  /** @param {Page} page */
  constructor(page) {
    this.page = page;
    /** @type {Promise<unknown>} Resolves when the source has reached the last time asked for. */
    this.going = Promise.resolve();
    this.wanted = 0;
    const bar = input("begin-at");
    /** @type {number | undefined} The frame that the step buttons reached; undefined after the bar was moved. */
    this.frame = undefined;
    bar.addEventListener("input", () => {
      this.frame = undefined;
      this.goTo(bar.valueAsNumber);
    });
  }

  /** Puts the bar at the beginning of the source. */
  reset() {
    this.frame = undefined;
    input("begin-at").max = String(this.page.run?.source.duration ?? 0);
    input("begin-at").value = "0";
    this.tell(0, 0);
  }

  /** @param {number} time
   * @param {number} [frame] */
  tell(time, frame) {
    const number = frame === undefined ? "" : `, frame ${frame}`;
    const text = `${time.toFixed(2)} s of ${(this.page.run?.source.duration ?? 0).toFixed(2)} s${number}`;
    get("begin-time").textContent = text;
    input("begin-at").setAttribute("aria-valuetext", text);
  }

  /** Moves by frames; back where `by` is negative.
   * @param {number} by */
  step(by) {
    const bar = input("begin-at");
    const { source, picture } = this.page.run ?? {};
    let time = bar.valueAsNumber + by / (source?.rate ?? 25);
    if (picture && source?.timeOf && source.count) {
      this.frame = Math.min(Math.max(0, (this.frame ?? picture.frame) + by), source.count - 1);
      time = source.timeOf(this.frame);
    }
    time = Math.min(Math.max(0, time), Number(bar.max));
    bar.value = String(time);
    this.goTo(time);
  }

  /** @param {number} time */
  goTo(time) {
    const { page } = this;
    const { run } = page;
    const wanted = (this.wanted += 1);
    this.tell(time);
    const isWanted = () => wanted === this.wanted && page.state === "first" && run === page.run;
    // The source seeks to one time after the other. A time that a later one has replaced is skipped.
    this.going = this.going.then(async () => {
      if (!run?.source.goTo || !isWanted()) return;
      const picture = await run.source.goTo(time);
      run.picture = picture;
      if (run !== page.run) return;
      page.stage.show(picture.image);
      if (isWanted()) this.tell(time, picture.frame);
    });
    this.going = this.going.catch((error) => run === page.run && page.fail(error));
  }
}
