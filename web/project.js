// A project: the objects with their rows, and what is known of the video. It is a file that people keep, and what the
// browser keeps of a page.

import { wake } from "./again.js";
import { FollowedObject } from "./objects.js";
import { openFiles } from "./sources.js";

const STATUSES = ["tracking", "uncertain", "lost"];
/** Bytes of a project file that tell that it is one. */
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

/** The last state of each object.
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

/** Reads a project, and fails where it is none.
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

/** The numbers of the objects, each once. One without a number has its place; one with that of another is counted on from
 * the highest.
 * @param {Project} project */
function ownNumbers({ objects }) {
  const numbers = objects.map(({ number }, at) => Number(number ?? at));
  const isOwn = numbers.map((number, at) => Number.isSafeInteger(number) && number >= 0 && numbers.indexOf(number) === at);
  let last = Math.max(-1, ...numbers.filter((_, at) => isOwn[at]));
  return numbers.map((number, at) => (isOwn[at] ? number : (last += 1)));
}

/** Brings objects and rows into a run that has none.
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

/** Brings what was tracked into a run.
 * @param {Keeping} keeping
 * @param {Run} run
 * @param {Project} project
 * @param {Kept["states"]} states
 * @param {string} [id] Its entry.
 * @returns {Promise<boolean>} Not where there is nothing: it waits for a first box. */
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
  // Also where the video is not at hand: it may be chosen later.
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

/** A source for rows whose video is not at hand: its pictures are empty.
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

/** The project among files: others end with .json, too.
 * @param {File[]} files */
async function projectIn(files) {
  const named = files.filter(({ name }) => name.endsWith(".json"));
  if (files.length === 1) return named[0];
  const heads = await Promise.all(named.map((file) => file.slice(0, HEAD).text()));
  return named.find((_, at) => heads[at].includes('"bagtrack_project"'));
}

/** In what a source differs from the video of a project; nothing where it may be that.
 * @param {Source} source
 * @param {Project} project */
function unlike({ name, size, count = Infinity }, { video, objects }) {
  // More rows than a call takes arguments.
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

/** Takes a project file, alone or with its video, and the video of a project that was opened without, or is gone.
 * @param {Keeping} keeping
 * @param {File[]} files
 * @returns {Promise<boolean>} Whether it did. */
export async function take(keeping, files) {
  const file = await projectIn(files);
  const { run } = keeping.page;
  if (file) await openProject(keeping, file, files.filter((other) => other !== file));
  else if (run && !run.source.isLive && (run.source.isAbsent || run.isGone)) await takeVideo(keeping, run, files);
  else return false;
  return true;
}

/** Takes the video of a project; opens another one for itself. One that is gone may have another name.
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
 * @param {File[]} files Of its video. */
async function openProject(keeping, file, files) {
  /** @type {Project} */
  let project;
  // Reads it as a source is opened: a choice that overtakes it says what is said.
  const open = async () => {
    const read = new Response(await file.text()).json();
    project = readProject(await read.catch(() => Promise.reject(new Error(`${file.name} is no JSON.`))));
    return files.length > 0 ? fitting(await openFiles(files), project) : withoutVideo(project);
  };
  await keeping.page.opening.choose(open, (run) => resume(keeping, run, project, {}));
}
