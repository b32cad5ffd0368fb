// Nothing is lost: the work is kept in the browser as it goes on, and comes back when the page is loaded anew. A project
// file does the same by hand.

import { catchUp } from "./again.js";
import { openClip } from "./clip.js";
import { get, input } from "./dom.js";
import { MOST_BYTES, forget, keepFiles, keepWork, keptFiles, keptWork, tab } from "./kept.js";
import { adopt, projectOf, readProject, withoutVideo } from "./project.js";
import { openFiles } from "./sources.js";

/**
 * @typedef {import("./kept.js").Kept} Kept
 * @typedef {import("./project.js").Project} Project
 * @typedef {import("./run.js").Run} Run
 * @typedef {import("./source.js").Source} Source
 */

/** Milliseconds after a change until it is kept. */
const AFTER = 1000;
const CLIPS = ["card", "leaves"];

export class Keeping {
  /** @param {import("./page.js").Page} page */
  constructor(page) {
    this.page = page;
    /** @type {Source | undefined} The one whose files are kept. */
    this.source = undefined;
    this.hasFiles = false;
    /** Whether all of what is here is kept. */
    this.isSafe = false;
    /** @type {number | undefined} */
    this.timer = undefined;
    /** @type {Kept | undefined} What another tab has left. */
    this.offered = undefined;
    get("forget").addEventListener("click", () => this.forget());
    get("go-on").addEventListener("click", () => this.offered && this.bringBack(this.offered));
    document.addEventListener("visibilitychange", () => document.hidden && this.timer && this.keep());
  }

  /** Keeps what is here, in a moment. */
  changed() {
    this.isSafe = false;
    this.timer ??= setTimeout(() => this.keep(), AFTER);
  }

  async keep() {
    clearTimeout(this.timer);
    this.timer = undefined;
    const { run } = this.page;
    if (!run || run.objects.length === 0) return;
    try {
      const project = projectOf(run);
      if (this.source !== run.source) await this.keepSource(run.source);
      const states = Object.fromEntries(run.objects.map(({ number, saves }) => [number, saves[saves.length - 1]]));
      const clip = CLIPS.find((name) => name === run.source.name && !run.source.files);
      await keepWork({ tab: tab(), isLocal: run.isLocal, project, states, clip });
      if (run !== this.page.run) return;
      this.isSafe = this.timer === undefined && (!!clip || this.hasFiles);
      this.tell(project, clip || this.hasFiles ? "" : " The pictures are not kept.");
    } catch (error) {
      get("kept").hidden = false;
      get("kept-text").textContent = `The browser keeps nothing of this (${error instanceof Error ? error.message : error}).`;
    }
  }

  /** @param {Source} source */
  async keepSource(source) {
    const files = source.files ?? [];
    const bytes = files.reduce((sum, { size }) => sum + size, 0);
    this.hasFiles = files.length > 0 && bytes <= MOST_BYTES;
    await keepFiles(this.hasFiles ? files : []);
    this.source = source;
  }

  /** @param {Project} project
   * @param {string} [more] */
  tell({ video, objects }, more = "") {
    const rows = objects.reduce((sum, object) => sum + object.rows.length, 0);
    const count = `${objects.length} ${objects.length === 1 ? "object" : "objects"}, ${rows} rows`;
    get("kept").hidden = false;
    get("kept-text").textContent = `Kept in this browser: ${video.name}, ${count}.${more}`;
  }

  async forget() {
    clearTimeout(this.timer);
    this.timer = undefined;
    this.source = this.offered = undefined;
    this.isSafe = false;
    get("kept").hidden = true;
    await forget().catch(() => undefined);
    this.page.say("The browser has forgotten it.");
  }

  /** Brings back what this tab had; offers what another one left. */
  async begin() {
    const kept = await keptWork().catch(() => undefined);
    if (!kept || this.page.state !== "start") return;
    if (kept.tab === tab()) return this.bringBack(kept);
    this.offered = kept;
    get("go-on").hidden = false;
    this.tell(kept.project);
  }

  /** @param {Kept} kept */
  async bringBack(kept) {
    const { project, states, clip } = kept;
    get("go-on").hidden = true;
    input(kept.isLocal ? "here" : "there").checked = true;
    const files = (await keptFiles().catch(() => undefined)) ?? [];
    const open = async () => {
      if (clip) return openClip(clip);
      return files.length > 0 ? openFiles(files) : withoutVideo(project);
    };
    await this.open(project, open, states);
  }

  /** Takes a project file, alone or with its video, and the video of a project that was opened without.
   * @param {File[]} files
   * @returns {boolean} Whether it did. */
  take(files) {
    const file = files.find(({ name }) => name.endsWith(".json"));
    const others = files.filter((other) => other !== file);
    const { run } = this.page;
    if (file) this.openProject(file, others);
    else if (run?.source.isAbsent && files[0].name === run.source.name) this.open(projectOf(run), () => openFiles(files));
    else return false;
    return true;
  }

  /** @param {File} file
   * @param {File[]} video */
  async openProject(file, video) {
    try {
      const project = readProject(JSON.parse(await file.text()));
      await this.open(project, async () => (video.length > 0 ? openFiles(video) : withoutVideo(project)));
    } catch (error) {
      this.page.say(error instanceof SyntaxError ? `${file.name} is no JSON.` : String(Object(error).message), true);
    }
  }

  /**
   * @param {Project} project
   * @param {() => Promise<Source>} open
   * @param {Kept["states"]} [states]
   */
  open(project, open, states = {}) {
    return this.page.choose(open, async (run) => {
      adopt(run, project);
      for (const object of run.objects) object.saves = [states[object.number]].filter((state) => !!state);
      const last = run.frames.numbers.pop();
      run.picture = (last !== undefined && (await run.frames.at(last))) || run.picture;
      run.isResting = true;
      const { source } = run;
      const canGoOn = !project.ended && source.goTo;
      if (canGoOn) run.wake = () => wake(run);
      if (run !== this.page.run) return;
      this.page.enter(canGoOn ? "paused" : "ended");
      this.page.again = undefined;
      this.page.seen.figures(run, undefined);
      this.page.repaint();
      const isAbsent = source.isAbsent ? ` Choose ${source.name} to see its pictures.` : "";
      this.page.say(`${source.name} is here again, with ${run.tracked} frames.${isAbsent}`);
      this.changed();
    });
  }
}

/** Goes on with the frames after the last one.
 * @param {Run} run */
async function wake(run) {
  run.wake = undefined;
  await catchUp(run);
  await run.source.goTo?.(run.picture.time, run.picture.frame);
  if (!run.isOver) run.play();
}
