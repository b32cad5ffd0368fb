// A project: the objects with their rows, and the name, size and rate of the video. Users save it as a file, and the
// browser's database has it for each run.

import { wake } from "./again.js";
import { FollowedObject } from "./objects.js";
import { openFiles } from "./sources.js";

const STATUSES = ["tracking", "uncertain", "lost"];
/** Bytes at the beginning of a project file that contain its mark. */
const HEAD = 100;
const NOT_ONE = "This file is no project of this page: ";

/** @param {Run} run
 * @returns {Project} */
export function projectOf(run) {
  const { name, size, rate, isLive } = run.source;
  const objects = run.objects.map(({ number, name, color, isShown, rows }) => ({
    number,
    name,
    color,
    shown: isShown,
    rows: [...rows.values()].map(stored),
  }));
  const video = { name, ...size, rate, live: isLive || undefined };
  return { bagtrack_project: 1, video, ended: run.isResting && !run.wake, skipped: run.skipped, objects };
}

/** The last saved state of each object, by its number.
 * @param {Run} run */
export const statesOf = (run) =>
  Object.fromEntries(run.objects.map(({ number, saves }) => [number, saves[saves.length - 1]]));

/** @param {Row} row
 * @returns {StoredRow} */
function stored({ frame, time, box: { x, y, width, height }, score, status, corrected }) {
  return [frame, time, x, y, width, height, score, status, corrected ? 1 : 0];
}

/** @param {StoredRow} stored
 * @returns {Row} */
function rowOf([frame, time, x, y, width, height, score, status, isKey]) {
  return { frame, time, box: { x, y, width, height }, score, status, corrected: isKey === 1 };
}

/** Checks a document for being a project, and throws if it is none. Drops objects without rows.
 * @param {unknown} document
 * @returns {Project} */
function readProject(document) {
  const project = /** @type {Project} */ (document);
  if (project?.bagtrack_project !== 1) throw new Error(`${NOT_ONE}it has no "bagtrack_project": 1.`);
  const { video, objects } = project;
  const isVideo = typeof video?.name === "string" && video.width > 0 && video.height > 0;
  if (!isVideo || !Array.isArray(objects)) throw new Error(`${NOT_ONE}its video or its objects are missing.`);
  for (const { rows } of objects) {
    const isRow = (/** @type {StoredRow} */ row) =>
      Array.isArray(row) && row.slice(0, 7).every(Number.isFinite) && STATUSES.includes(row[7]);
    if (!Array.isArray(rows) || !rows.every(isRow)) throw new Error(`${NOT_ONE}a row of it is damaged.`);
  }
  return { ...project, objects: objects.filter(({ rows }) => rows.length > 0) };
}

/** Unique numbers of the objects. An object without a number gets its index; one with an invalid number, or that of an
 * earlier object, gets the next one after the highest.
 * @param {Project} project */
function ownNumbers({ objects }) {
  const numbers = objects.map(({ number }, at) => Number(number ?? at));
  const isOwn = numbers.map((number, at) => Number.isSafeInteger(number) && number >= 0 && numbers.indexOf(number) === at);
  let last = Math.max(-1, ...numbers.filter((_, at) => isOwn[at]));
  return numbers.map((number, at) => (isOwn[at] ? number : (last += 1)));
}

/** Adds the objects and rows of a project to a run without any.
 * @param {Run} run
 * @param {Project} project */
function adopt(run, project) {
  const numbers = ownNumbers(project);
  for (const [at, { name, color, shown, rows }] of project.objects.entries()) {
    const object = new FollowedObject(numbers[at], run.follower());
    object.name = String(name ?? object.name);
    object.color = String(color ?? object.color);
    object.isShown = shown !== false;
    for (const row of rows.map(rowOf)) {
      object.set(row);
      run.frames.times.set(row.frame, row.time);
    }
    object.sort();
    run.objects.push(object);
    run.count = Math.max(run.count, object.number + 1);
  }
  run.chosen = run.objects[0];
  run.tracked = run.frames.times.size;
  run.passedOver = project.skipped || 0;
}

/** Restores a project in a run that has just been opened.
 * @param {Keeping} keeping
 * @param {Run} run
 * @param {Project} project
 * @param {Kept["states"]} states
 * @param {string} [id] The project's entry in the database.
 * @returns {Promise<boolean>} False where the project has no objects: the run then waits for a first box. */
export async function resume(keeping, run, project, states, id) {
  if (project.objects.length === 0) return false;
  // Another source was chosen while this module was loaded.
  if (run !== keeping.page.run) return true;
  const left = keeping.arrived(id);
  adopt(run, project);
  for (const object of run.objects) object.saves = [states[object.number]].filter((state) => !!state);
  const last = run.frames.numbers.pop();
  run.picture = (last !== undefined && (await run.frames.at(last))) || run.picture;
  run.isResting = true;
  const { source } = run;
  // Set even if the video is not at hand: the user may choose it later.
  if (!project.ended) run.wake = () => wake(run, async () => source);
  const canGoOn = run.wake && source.goTo;
  if (run !== keeping.page.run) return true;
  keeping.page.enter(canGoOn ? "paused" : "ended");
  keeping.page.seen.figures(run);
  keeping.page.repaint();
  const wanted = source.isLive ? " Pictures of the camera are not kept." : ` Choose ${source.name} to see its pictures.`;
  keeping.page.say(`${source.name} is here again, with ${run.tracked} frames.${source.isAbsent ? wanted : ""}${left}`);
  keeping.changed();
  return true;
}

/** A source for a project whose video is not at hand, with empty pictures.
 * @param {Project} project
 * @returns {Source} */
export function withoutVideo({ video, objects }) {
  const image = document.createElement("canvas");
  [image.width, image.height] = [video.width, video.height];
  const picture = (/** @type {number} */ frame, /** @type {number} */ time) => ({ image, blob: new Blob(), time, frame });
  const [frame = 0, time = 0] = objects[0]?.rows[0] ?? [];
  return {
    name: video.name,
    isLive: video.live === true,
    size: { width: video.width, height: video.height },
    rate: video.rate,
    skipped: 0,
    isAbsent: true,
    first: async () => picture(frame, time),
    at: async (frame, time) => picture(frame, time),
    start: async (_, end) => end(),
    hold() {},
    stop() {},
  };
}

/** The project among files. Other files may end with .json too, so the beginning of each is read.
 * @param {File[]} files */
async function projectIn(files) {
  const named = files.filter(({ name }) => name.endsWith(".json"));
  if (files.length === 1) return named[0];
  const heads = await Promise.all(named.map((file) => file.slice(0, HEAD).text()));
  return named.find((_, at) => heads[at].includes('"bagtrack_project"'));
}

/** How a source differs from the video of a project; empty where it may be that video.
 * @param {Source} source
 * @param {Project} project */
function unlike({ name, size, count = Infinity }, { video, objects }) {
  // `Math.max` with a spread would fail: there may be more rows than a call can take arguments.
  const last = objects.flatMap(({ rows }) => rows).reduce((last, [frame]) => Math.max(last, frame), 0);
  if (size.width !== video.width || size.height !== video.height) {
    const other = `the video of this project (${video.name}) ${video.width} × ${video.height}`;
    return `${name} has ${size.width} × ${size.height} pixels, ${other}: it is another one.`;
  }
  if (last < count) return "";
  return `${name} has ${count} frames, and this project (${video.name}) a box in frame ${last}: it is another video.`;
}

/** @param {Source} source
 * @param {Project} project */
function fitting(source, project) {
  const fault = unlike(source, project);
  if (!fault) return source;
  source.stop();
  source.close?.();
  throw new Error(fault);
}

/** Opens a project file, alone or with its video; or the video of a project that was opened without it, or lost it.
 * @param {Keeping} keeping
 * @param {File[]} files
 * @returns {Promise<boolean>} False where the files are neither. */
export async function take(keeping, files) {
  const file = await projectIn(files);
  const { run } = keeping.page;
  if (file) await openProject(keeping, file, files.filter((other) => other !== file));
  else if (run && !run.source.isLive && (run.source.isAbsent || run.isGone)) await takeVideo(keeping, run, files);
  else return false;
  return true;
}

/** Opens the video of the present project. Another video is opened as a new source. A video that had become unreadable
 * may have another name by now: then its size and date tell that it is the same.
 * @param {Keeping} keeping
 * @param {Run} run
 * @param {File[]} files */
async function takeVideo(keeping, run, files) {
  const project = projectOf(run);
  const states = statesOf(run);
  const [{ id }, { isAbsent, name, files: [gone] = [] }] = [keeping, run.source];
  const open = async () => {
    const source = await openFiles(files);
    return isAbsent && source.name === name ? fitting(source, project) : source;
  };
  const bringBack = async (/** @type {Run} */ opened) => {
    const [{ source }, [file] = []] = [opened, opened.source.files];
    const isRenamed = file?.size === gone?.size && file?.lastModified === gone?.lastModified;
    const isSame = isAbsent || isRenamed || source.name === name;
    return isSame && !unlike(source, project) && resume(keeping, opened, project, states, id);
  };
  await keeping.page.opening.choose(open, bringBack);
}

/**
 * @param {Keeping} keeping
 * @param {File} file
 * @param {File[]} files The project's video; may be empty. */
async function openProject(keeping, file, files) {
  /** @type {Project} */
  let project;
  // Reads the project within `open`, so that after a later choice, no error of this one is shown.
  const open = async () => {
    const read = new Response(await file.text()).json();
    project = readProject(await read.catch(() => Promise.reject(new Error(`${file.name} is no JSON.`))));
    return files.length > 0 ? fitting(await openFiles(files), project) : withoutVideo(project);
  };
  await keeping.page.opening.choose(open, (run) => resume(keeping, run, project, {}));
}
