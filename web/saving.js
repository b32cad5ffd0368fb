// The buttons that save results. What makes the files is loaded when a source is open, and needs no service later.

import { button, get } from "./dom.js";
import { words } from "./problems.js";

/** @typedef {import("./run.js").Run} Run */
/** @typedef {import("./page.js").Page} Page */

const modules = () => Promise.all([import("./save.js"), import("./recording.js")]);

/** @param {Page} page */
export function offerSaving(page) {
  get("results").addEventListener("click", async ({ target }) => {
    const format = target instanceof HTMLElement ? target.closest("button")?.id.replace("save-", "") : undefined;
    if (!format || !page.run || page.run.objects.length === 0) return;
    try {
      const [{ FORMATS, save }] = await modules();
      const found = FORMATS[format];
      if (!found) return;
      save(found.make(page.run), page.run, found.ending);
      page.isUnsaved = false;
    } catch (error) {
      page.say(words(error, page.hasKey), true);
    }
  });
  button("save-video").addEventListener("click", () => saveVideo(page));
  if (typeof VideoEncoder === "undefined") {
    button("save-video").textContent = "Video (Matroska)";
    get("no-encoder").hidden = false;
  }
}

/** Loads what makes the files, while there is a line to the service. */
export const prepareSaving = () => void modules().catch(() => undefined);

/** @param {Page} page */
async function saveVideo(page) {
  const { run } = page;
  if (!run || run.objects.length === 0) return;
  const own = button("save-video");
  const label = own.textContent;
  own.disabled = true;
  const tell = (/** @type {number} */ done, /** @type {number} */ of) => {
    own.textContent = `Making the video: ${Math.floor((100 * done) / of)} %`;
  };
  try {
    const [{ save }, { extension, makeVideo }] = await modules();
    save(await makeVideo(run, tell), run, extension);
    const [kept, of] = [run.frames.shown.length, run.tracked];
    if (kept < of) page.say(`The video has the last ${kept} of ${of} frames: no more are kept.`);
  } catch (error) {
    page.say(words(error, page.hasKey), true);
  }
  own.textContent = label;
  own.disabled = false;
}
