// The buttons that save results. The modules that make the files load when a source opens, so that saving works even if
// the service has gone since.

import { button, get } from "./dom.js";
import { words } from "./problems.js";

const modules = () => Promise.all([import("./save.js"), import("./recording.js"), import("./handover.js")]);

/** @param {Page} page */
export function offerSaving(page) {
  get("results").addEventListener("click", async ({ target }) => {
    const format = target instanceof HTMLElement ? target.closest("button")?.id.replace("save-", "") : undefined;
    if (!format || !page.run) return;
    // Says so for "Hand over" and "Video" too: their own listeners return silently.
    if (page.run.objects.length === 0) return page.say("There is no object to save.");
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
  button("hand-over").addEventListener("click", () => giveAway(page));
  button("save-video").addEventListener("click", () => saveVideo(page));
  restore();
  get("no-encoder").hidden = typeof VideoEncoder !== "undefined";
}

/** Loads the modules that make files, while the service can be reached. */
export function prepareSaving() {
  restore();
  button("hand-over").disabled = false;
  modules().catch(() => undefined);
}

function restore() {
  button("save-video").disabled = false;
  button("save-video").textContent = typeof VideoEncoder === "undefined" ? "Video (Matroska)" : "Video (WebM)";
}

/** @param {Page} page */
async function saveVideo(page) {
  const { run } = page;
  if (!run || run.objects.length === 0) return;
  if (run.source.isAbsent) return page.say(`A video cannot be made without pictures. Choose ${run.source.name} first.`, true);
  const own = button("save-video");
  own.disabled = true;
  // The user may open another source while the video is made.
  const isHere = () => run === page.run;
  const tell = (/** @type {number} */ done, /** @type {number} */ of) => {
    if (isHere()) own.textContent = `Making the video: ${Math.floor((100 * done) / of)} %`;
  };
  try {
    const [{ save }, { extension, makeVideo }] = await modules();
    save(await makeVideo(run, tell), run, extension);
    const [kept, of] = [run.frames.shown.length, run.tracked];
    if (isHere() && kept < of) page.say(`The video has the last ${kept} of ${of} frames: no more are kept.`);
  } catch (error) {
    if (isHere()) page.fail(error);
  }
  if (isHere()) restore();
}

/** Hands the objects over to the service, and shows their sessions.
 * @param {Page} page */
async function giveAway(page) {
  const { run } = page;
  if (!run || run.objects.length === 0) return;
  button("hand-over").disabled = true;
  try {
    const handed = await (await modules())[2].handOver(run, await page.service());
    if (run !== page.run) return;
    const links = handed.map(({ name, id }) => {
      const link = document.createElement("a");
      link.href = `sessions/${id}`;
      link.textContent = name;
      const item = document.createElement("li");
      item.append(link, ` ${id}`);
      return item;
    });
    get("handed").replaceChildren(...links);
    const isWhole = handed.every((it) => it.isWhole);
    page.say(
      isWhole
        ? "The service has the sessions, with all that was learned."
        : "The service takes no states of other trackers (it was started without --unsigned-snapshots): it got the last " +
            "frame and its boxes instead.",
    );
  } catch (error) {
    if (run === page.run) page.fail(error, () => giveAway(page));
  }
  if (run === page.run) button("hand-over").disabled = false;
}
