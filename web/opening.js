// Opening a source. The present run stays until the first frame of the new source is there. The last choice counts.

import { get, input } from "./dom.js";
import { DRAW, TAP, again } from "./editing.js";
import { UnplayableError } from "./problems.js";
import { prepareSaving } from "./saving.js";
import { offerDecoding } from "./sources.js";

/**
 * @typedef {(run: Run) => Promise<boolean>} Resume Restores the rows of a source, and resolves with whether it did.
 */

export class Opening {
  /** @param {Page} page */
  constructor(page) {
    this.page = page;
    /** Counts the choices: a source that opens after a later choice is dropped. */
    this.choice = 0;
    this.overtaken = new AbortController();
    /** Keeps the present run, and resolves with whether another source may replace it. */
    this.mayLeave = async () => true;
    /** Called when another source is open; returns a sentence about the one before it, for the message. */
    this.arrived = () => "";
  }

  /** Shows the first frame of a source and asks for a box. The present run stays until then.
   * @param {(signal: AbortSignal) => Promise<Source>} open Its signal is aborted when the user chooses another source.
   * @param {Resume} [resume] */
  async choose(open, resume) {
    const { page } = this;
    const own = (this.choice += 1);
    this.overtaken.abort();
    this.overtaken = new AbortController();
    get("decoding").hidden = true;
    if (!page.run) page.enter("opening");
    page.say("Opening…");
    try {
      const [source, { Run }] = await Promise.all([open(this.overtaken.signal), import("./run.js")]);
      const first = await source.first();
      const isLocal = input("here").checked;
      const client = isLocal ? page.local : await page.service();
      const mayLeave = own === this.choice && (await this.mayLeave());
      if (own !== this.choice || !mayLeave) {
        source.stop();
        source.close?.();
        if (own === this.choice) page.say(`${page.run?.source.name} stays.`);
        return;
      }
      await this.take(new Run(client, source, first, page.told()), resume);
    } catch (error) {
      if (own !== this.choice) return;
      if (!page.run) page.enter("start");
      page.fail(error, () => this.choose(open, resume));
      if (error instanceof UnplayableError) offerDecoding(page, error.file, resume);
    }
  }

  /** Puts a run in the place of the one before, and loads what it will need.
   * @param {Run} run
   * @param {Resume} [resume] */
  async take(run, resume) {
    const { page } = this;
    const { picture, source } = run;
    page.reset();
    page.run = run;
    run.sees = page.seen.isOn;
    page.stage.draw(undefined);
    page.stage.show(picture.image);
    if (run.isLocal) page.local.warm().catch(() => undefined);
    prepareSaving();
    again().catch(() => undefined);
    page.service().catch(() => undefined);
    page.seen.prepare().catch(() => undefined);
    if (await resume?.(run)) return;
    page.enter("first");
    page.beginning.reset();
    page.preview();
    get("picture").scrollIntoView({ block: "nearest" });
    const asked = source.isAbsent ? `The project has no boxes. Choose ${source.name} to draw one.` : TAP + DRAW;
    page.say(asked + (source.note ?? "") + this.arrived());
  }
}
