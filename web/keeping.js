// Nothing is lost: each run is kept in the browser as it goes on. It comes back when the page is loaded anew, and can be
// gone on with when another source has taken its place. A project file does the same by hand.

import { get, input } from "./dom.js";
import { again } from "./editing.js";
import { MOST_BYTES, claim, forget, freeWorks, giveUp, opened } from "./kept.js";
import { keepWork, keptFiles, keptWork, ownWork, setOwnWork } from "./kept.js";
import { isReadable } from "./problems.js";
import { openFiles } from "./sources.js";

/** Milliseconds after a change until it is kept, and one more for so many rows: all of them are written each time. */
const AFTER = 1000;
const ROWS = 10;
const CLIPS = ["card", "leaves"];
/** @type {Promise<typeof import("./project.js")> | undefined} */
let loaded;
/** The first screen does not need these. A page that is left imports nothing anew. */
const projects = () =>
  (loaded ??= import("./project.js").catch((error) => {
    loaded = undefined;
    throw error;
  }));
const openClip = async (/** @type {string} */ name) => (await import("./clip.js")).openClip(name);

export class Keeping {
  /** @param {Page} page */
  constructor(page) {
    this.page = page;
    /** The entry of what is here. */
    this.id = "";
    /** @type {Source | undefined} The one whose files are kept. */
    this.source = undefined;
    /** @type {IDBDatabase | undefined} Where they are kept. */
    this.store = undefined;
    this.hasFiles = false;
    /** Whether all of what is here is kept. */
    this.isSafe = false;
    /** @type {number | undefined} */
    this.timer = undefined;
    /** How often the browser was to forget what is here. */
    this.forgotten = 0;
    /** What was left for another source. */
    this.left = "";
    get("forget").addEventListener("click", () => this.forget());
    document.addEventListener("visibilitychange", () => {
      if (!document.hidden) this.offer();
      else if (this.timer) this.keep();
    });
  }

  /** Keeps what is here, in a moment. */
  changed() {
    this.isSafe = false;
    const rows = this.page.run?.objects.reduce((sum, object) => sum + object.rows.size, 0) ?? 0;
    this.timer ??= setTimeout(() => this.keep(), AFTER + rows / ROWS);
  }

  /** @returns {Promise<boolean>} Whether all of what was here is kept. */
  async keep() {
    clearTimeout(this.timer);
    this.timer = undefined;
    const { id, forgotten, page: { run } } = this;
    if (!run) return false;
    try {
      if (run.objects.length === 0) return await this.keepNothing();
      const { projectOf, statesOf } = await projects();
      const project = projectOf(run);
      const { isLocal, source } = run;
      const store = await opened();
      const files = this.source === source && this.store === store ? undefined : smallFiles(source);
      const clip = clipOf(source);
      const { imageNames } = source;
      // In one step: a page that is left ends it, and begins no other.
      const work = { id, at: Date.now(), isLocal, project, states: statesOf(run), clip, imageNames };
      const hasRoom = await keepWork(work, files);
      if (forgotten !== this.forgotten) return forget(id).then(() => false);
      const hasFiles = files ? hasRoom && files.length > 0 : this.hasFiles;
      const isWhole = !!clip || hasFiles || source.isAbsent === true || run.isGone;
      if (run !== this.page.run) return isWhole;
      this.hasFiles = hasFiles;
      [this.source, this.store] = [source, store];
      this.isSafe = this.timer === undefined && isWhole;
      this.tell(`Kept in this browser: ${told(project)}.${isWhole ? "" : " The pictures are not kept."}`);
      return isWhole;
    } catch (error) {
      this.tell(`The browser keeps nothing of this (${error instanceof Error ? error.message || error.name : error}).`);
      return false;
    }
  }

  /** All objects were deleted. */
  async keepNothing() {
    this.source = undefined;
    await forget(this.id);
    this.isSafe = this.timer === undefined;
    this.tell("");
    return true;
  }

  /** A run that is about to be stopped can go on later, where its source can be opened again. */
  letGoOn() {
    const { run } = this.page;
    if (!run?.source.goTo) return;
    const { files = [], name, imageNames } = run.source;
    const clip = clipOf(run.source);
    if (!clip && files.length === 0) return;
    const open = async () => {
      const source = await (clip ? openClip(clip) : openFiles(files, imageNames));
      await source.first();
      return Object.assign(source, { name, imageNames });
    };
    /** @type {() => Promise<void>} */
    const own = async () => (await again()).wake(run, open, own);
    run.wake = own;
  }

  /** @param {string} text Of what is here; empty where nothing is kept of it. */
  tell(text) {
    get("kept-own").hidden = text === "";
    get("kept-text").textContent = text;
    get("kept").hidden = text === "" && get("works").children.length === 0;
  }

  async forget() {
    clearTimeout(this.timer);
    this.timer = undefined;
    this.source = undefined;
    this.isSafe = false;
    this.forgotten += 1;
    this.tell("");
    await forget(this.id).catch(() => undefined);
    this.page.say("The browser has forgotten it.");
  }

  /** Before another source takes the place of what is here: keeps that, and asks where not all of it can be kept.
   * @returns {Promise<boolean>} Whether it may be left. */
  async leave() {
    const { run } = this.page;
    this.left = "";
    if (!run || run.objects.length === 0) return true;
    const isKept = (this.isSafe && this.timer === undefined) || (await this.keep());
    this.left = isKept ? run.source.name : "";
    const question = `Not all of ${run.source.name} can be kept, and its results were not saved. Leave it?`;
    return isKept || !this.page.isUnsaved || confirm(question);
  }

  /** Another source is here.
   * @param {string} [id] Its entry, where it has one.
   * @returns {string} What is to be said of the one before it. */
  arrived(id = crypto.getRandomValues(new Uint32Array(2)).join("-")) {
    clearTimeout(this.timer);
    this.timer = undefined;
    this.isSafe = false;
    if (this.id === id) this.left = "";
    else giveUp(this.id);
    this.id = id;
    claim(id);
    setOwnWork(id);
    this.tell("");
    this.offer();
    return this.left && ` ${this.left} is kept: below you can go on with it.`;
  }

  /** Brings back what this tab had; offers what others left. */
  async begin() {
    const own = ownWork();
    // A tab that was duplicated has it open.
    const kept = own && (await claim(own)) ? await keptWork(own).catch(() => undefined) : undefined;
    if (kept && this.page.state === "start") return this.bringBack(kept, true);
    if (own && own !== this.id) {
      giveUp(own);
      if (ownWork() === own) setOwnWork("");
    }
    await this.offer();
  }

  /** Offers what was left and no tab has open. */
  async offer() {
    const works = await freeWorks().catch(() => []);
    get("works").replaceChildren(...works.map((work) => this.item(work)));
    this.tell(get("kept-text").textContent ?? "");
  }

  /** @param {Kept} kept */
  item(kept) {
    const item = document.createElement("li");
    item.className = "row";
    const day = new Date(kept.at).toLocaleString(undefined, { dateStyle: "medium", timeStyle: "short" });
    item.append(`Kept in this browser: ${told(kept.project)}, ${day}.`);
    /** @type {[string, string, () => Promise<unknown>][]} */
    const buttons = [
      ["go-on", "Go on with it", () => this.bringBack(kept)],
      ["quiet", "Forget it", () => forget(kept.id).then(() => giveUp(kept.id))],
    ];
    for (const [name, text, act] of buttons) {
      const button = document.createElement("button");
      [button.type, button.className, button.textContent] = ["button", name, text];
      button.addEventListener("click", async () => {
        if (await claim(kept.id)) await act();
        else this.page.say("Another tab has it open.", true);
        this.offer();
      });
      item.append(button);
    }
    return item;
  }

  /** @param {Kept} kept That this page has open.
   * @param {boolean} [isOwn] Whether this tab left it. */
  async bringBack({ id, isLocal, project, states, clip, imageNames }, isOwn = false) {
    const files = (await keptFiles(id).catch(() => undefined)) ?? [];
    const open = async () => {
      input(isLocal ? "here" : "there").checked = true;
      if (clip) return openClip(clip);
      // Some browsers do not copy a file, and it may be gone since.
      if (!files[0] || !(await isReadable(files[0]))) return (await projects()).withoutVideo(project);
      // Files that were kept have lost their folder.
      return Object.assign(await openFiles(files, imageNames), { name: project.video.name, imageNames });
    };
    // Another tab may have it open where browsers do not tell: then this one has a copy.
    const own = isOwn || navigator.locks ? id : undefined;
    await this.page.opening.choose(open, async (run) => (await projects()).resume(this, run, project, states, own));
    if (this.id !== id) giveUp(id);
  }

  /** Takes a project file, alone or with its video, and the video of a project that was opened without.
   * @param {File[]} files
   * @returns {Promise<boolean>} Whether it did. */
  async take(files) {
    return (await projects()).take(this, files);
  }
}

/** @param {Project} project */
function told({ video, objects }) {
  const rows = objects.reduce((sum, object) => sum + object.rows.length, 0);
  return `${video.name}, ${objects.length} ${objects.length === 1 ? "object" : "objects"}, ${rows} rows`;
}

/** The sample that a source is.
 * @param {Source} source */
const clipOf = ({ name, files }) => CLIPS.find((clip) => clip === name && !files);

/** The files of a source, where they are small enough to be copied.
 * @param {Source} source */
function smallFiles({ files = [] }) {
  return files.reduce((sum, { size }) => sum + size, 0) <= MOST_BYTES ? files : [];
}
