// Opening sources: by buttons, and by files or folders that are chosen, dropped or pasted.

import { button, get, input } from "./dom.js";
import { GONE, UnplayableError, isReadable } from "./problems.js";

/** The modules that open sources, imported when the user is about to choose one. */
const modules = () =>
  Promise.all([import("./video.js"), import("./images.js"), import("./camera.js"), import("./clip.js")]);

/** Opens files as a source: one video, or images. Of several videos, the first.
 * @param {File[]} files
 * @param {string[]} [names] The paths of images that were opened before.
 * @returns {Promise<Source>} */
export async function openFiles(files, names) {
  const [{ openVideo }, { isImage, openAnimated, openImages }] = await modules();
  const videos = files.filter((file) => file.type.startsWith("video/"));
  if (videos.length === 0 && files.some(isImage)) {
    const animated = files.length === 1 && !names ? await openAnimated(files[0]) : undefined;
    return animated ?? openImages(files, names);
  }
  const [file, ...others] = videos.length > 0 ? videos : files;
  if (file.size === 0) throw new Error(`${file.name} is empty.`);
  if (!(await isReadable(file))) throw GONE;
  const source = await openVideo(file, get("stage")).catch((error) => {
    if (error.name !== "NotSupportedError") throw error;
    throw isNoVideo(file) ? new Error(`${file.name} is neither a video nor an image.`) : new UnplayableError(file);
  });
  if (others.length > 0) source.note = ` Of ${others.length + 1} videos this is ${file.name}: open one at a time.`;
  return source;
}

/** Whether the type of a file says that it is no video. Some systems give MPEG transport streams the type of a text.
 * @param {File} file */
const isNoVideo = ({ name, type }) =>
  /^(text|font)\/|^application\/(json|pdf|xml|zip|javascript|vnd\.)/.test(type) && !/\.m?2?ts$/i.test(name);

/** All files of a drop, with those in folders.
 * @param {DataTransfer} dropped */
async function filesOf(dropped) {
  const entries = [...dropped.items].map((item) => item.webkitGetAsEntry?.()).filter((entry) => !!entry);
  // A drop that a script made has no entries.
  if (!entries.some(({ isDirectory }) => isDirectory)) return [...dropped.files];
  return (await Promise.all(entries.map(filesIn))).flat();
}

/** @param {FileSystemEntry} entry
 * @returns {Promise<File[]>} */
async function filesIn(entry) {
  if (entry.isFile) {
    const { file } = /** @type {FileSystemFileEntry & {file: any}} */ (entry);
    return [await new Promise((resolve, reject) => file.call(entry, resolve, reject))];
  }
  const reader = /** @type {FileSystemDirectoryEntry} */ (entry).createReader();
  /** @type {File[]} */
  const files = [];
  for (;;) {
    /** @type {FileSystemEntry[]} Some browsers give a hundred at a time. */
    const some = await new Promise((resolve, reject) => reader.readEntries(resolve, reject));
    if (some.length === 0) return files;
    files.push(...(await Promise.all(some.map(filesIn))).flat());
  }
}

/** Offers to upload a file to the service, which decodes it.
 * @param {Page} page
 * @param {File} file
 * @param {import("./opening.js").Resume} [resume] */
export function offerDecoding(page, file, resume) {
  get("decoding").hidden = false;
  // The button names the file: the message line may be about another one by then.
  button("decode").textContent = `Let the service decode ${file.name}`;
  button("decode").onclick = () => {
    const open = async (/** @type {AbortSignal} */ signal) => {
      const tell = (/** @type {number} */ count) => {
        if (!signal.aborted) page.say(`The service decodes ${file.name}: ${count} frames…`);
      };
      const { key } = (await page.service()).transport;
      return (await import("./decoded.js")).openDecoded(file, key, tell, signal);
    };
    page.opening.choose(open, resume);
  };
  button("decode").focus();
}

/**
 * @param {(open: () => Promise<Source>) => void} choose
 * @param {(files: File[]) => Promise<boolean>} take Takes a project's files; resolves with false for others.
 */
export function offerSources(choose, take) {
  const open = async (/** @type {File[]} */ files) => {
    if (files.length === 0) return;
    try {
      if (!(await take(files))) choose(() => openFiles(files));
    } catch (error) {
      choose(() => Promise.reject(error));
    }
  };
  for (const kind of ["pointerover", "focusin", "dragenter"]) {
    addEventListener(kind, () => modules().catch(() => undefined), { once: true });
  }
  for (const clip of ["card", "leaves"]) {
    get(clip).addEventListener("click", () => choose(async () => (await import("./clip.js")).openClip(clip)));
  }
  get("camera").addEventListener("click", () => {
    choose(async () => (await modules())[2].openCamera(get("stage")));
  });
  for (const id of ["file", "folder"]) {
    const chosen = () => {
      open([...(input(id).files ?? [])]);
      input(id).value = "";
    };
    input(id).addEventListener("change", chosen);
    // Over a slow connection, the user may have chosen a file before this script ran.
    chosen();
  }
  for (const kind of ["dragover", "dragleave", "drop"]) {
    addEventListener(kind, async (event) => {
      // Otherwise the browser would leave the page, and show the file.
      event.preventDefault();
      document.body.classList.toggle("drop", kind === "dragover");
      const { dataTransfer } = /** @type {DragEvent} */ (event);
      if (kind === "drop" && dataTransfer) open(await filesOf(dataTransfer));
    });
  }
  addEventListener("paste", ({ target, clipboardData }) => {
    const isTaken = target instanceof Element && target.closest('input:is([type="text"], [type="password"])');
    if (!isTaken) open([...(clipboardData?.files ?? [])]);
  });
}
