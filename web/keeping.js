// Keeps each run in the browser as it goes on. It comes back when the page is reloaded, and is offered again after
// another source took its place. A project file does the same by hand.

import { get, input } from "./dom.js";
import { again } from "./editing.js";
import { MOST_BYTES, claim, forget, freeWorks, giveUp, opened } from "./kept.js";
import { keepWork, keptFiles, keptWork, ownWork, setOwnWork } from "./kept.js";
import { isReadable } from "./problems.js";
import { openFiles } from "./sources.js";

/** Milliseconds from a change until it is kept, plus one for every `ROWS` rows: each time, all rows are written. */
const AFTER = 1000;
const ROWS = 10;
const CLIPS = ["card", "leaves"];
/** @type {Promise<typeof import("./project.js")> | undefined} */
let loaded;
/** Loads the module once: the first screen does without, and a page that is being left can import nothing. */
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
    /** The id of the present run's entry. */
    this.id = "";
    /** @type {Source | undefined} The source whose files are in the entry. */
    this.source = undefined;
    /** @type {IDBDatabase | undefined} The database that has them. */
    this.store = undefined;
    this.hasFiles = false;
    /** Whether the entry has the whole run, with its files, and no change since. */
    this.isSafe = false;
    /** @type {number | undefined} */
    this.timer = undefined;
    /** How often the user pressed "Forget": a write that began before is undone. */
    this.forgotten = 0;
    /** The name of the source that another one has replaced, if it is kept. */
    this.left = "";
    get("forget").addEventListener("click", () => this.forget());
    document.addEventListener("visibilitychange", () => {
      if (!document.hidden) this.offer();
      else if (this.timer) this.keep();
    });
  }

  /** Keeps the run after a delay. */
  changed() {
    this.isSafe = false;
    const rows = this.page.run?.objects.reduce((sum, object) => sum + object.rows.size, 0) ?? 0;
    this.timer ??= setTimeout(() => this.keep(), AFTER + rows / ROWS);
  }

  /** @returns {Promise<boolean>} Whether the whole run is kept. */
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
      // One transaction for everything: a page that is being left completes it, but begins no other.
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

  /** Removes the entry, after all objects were deleted. */
  async keepNothing() {
    this.source = undefined;
    await forget(this.id);
    this.isSafe = this.timer === undefined;
    this.tell("");
    return true;
  }

  /** Lets a run that is about to stop go on later, if its source can be opened again. */
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

  /** @param {string} text About the present run; empty where nothing of it is kept. */
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

  /** Keeps the run before another source replaces it. Asks the user if not all of it can be kept.
   * @returns {Promise<boolean>} Whether the other source may replace it. */
  async leave() {
    const { run } = this.page;
    this.left = "";
    if (!run || run.objects.length === 0) return true;
    const isKept = (this.isSafe && this.timer === undefined) || (await this.keep());
    this.left = isKept ? run.source.name : "";
    const question = `Not all of ${run.source.name} can be kept, and its results were not saved. Leave it?`;
    return isKept || !this.page.isUnsaved || confirm(question);
  }

  /** Begins an entry for a new source, or takes the one with this id.
   * @param {string} [id] The source's entry, where it has one.
   * @returns {string} A sentence about the source before it, for the message; empty where there is none. */
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

  /** Brings back the run that this tab had before the reload, or offers those that no tab has open. */
  async begin() {
    const own = ownWork();
    // A duplicated tab has the same id, but its original holds the entry.
    const kept = own && (await claim(own)) ? await keptWork(own).catch(() => undefined) : undefined;
    if (kept && this.page.state === "start") return this.bringBack(kept, true);
    if (own && own !== this.id) {
      giveUp(own);
      if (ownWork() === own) setOwnWork("");
    }
    await this.offer();
  }

  /** Lists the kept runs that no tab has open. */
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

  /** @param {Kept} kept An entry that this page has claimed.
   * @param {boolean} [isOwn] Whether this tab had it before the reload. */
  async bringBack({ id, isLocal, project, states, clip, imageNames }, isOwn = false) {
    const files = (await keptFiles(id).catch(() => undefined)) ?? [];
    const open = async () => {
      input(isLocal ? "here" : "there").checked = true;
      if (clip) return openClip(clip);
      // Some browsers store a reference to a file only, and the file may be gone since.
      if (!files[0] || !(await isReadable(files[0]))) return (await projects()).withoutVideo(project);
      // Stored files have lost the path in their folder, so the names come from the entry.
      return Object.assign(await openFiles(files, imageNames), { name: project.video.name, imageNames });
    };
    // Without `navigator.locks`, another tab may have the entry open: then this run gets a new entry, a copy.
    const own = isOwn || navigator.locks ? id : undefined;
    await this.page.opening.choose(open, async (run) => (await projects()).resume(this, run, project, states, own));
    if (this.id !== id) giveUp(id);
  }

  /** Opens a project file, alone or with its video; or the video of a project that was opened without it.
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

/** The name of the sample clip, if the source is one.
 * @param {Source} source */
const clipOf = ({ name, files }) => CLIPS.find((clip) => clip === name && !files);

/** The files of a source; none where they are too large to be copied into the browser's database.
 * @param {Source} source */
function smallFiles({ files = [] }) {
  return files.reduce((sum, { size }) => sum + size, 0) <= MOST_BYTES ? files : [];
}
