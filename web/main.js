// The entry of the page: connects buttons and keys with their actions.

import { get, input } from "./dom.js";
import { Keeping } from "./keeping.js";
import { offerSaving } from "./saving.js";
import { press } from "./keys.js";
import { offerSources } from "./sources.js";
import { Page } from "./page.js";
import { playWelcome } from "./welcome.js";

const page = new Page();

const keeping = new Keeping(page);

page.changed = () => keeping.changed();
page.opening.mayLeave = () => keeping.leave();
page.opening.arrived = () => keeping.arrived();
page.letGoOn = () => keeping.letGoOn();
keeping.begin();
offerSources(
  (open) => page.opening.choose(open),
  (files) => keeping.take(files),
);
offerSaving(page);
playWelcome();

get("draw").addEventListener("click", () => page.editing.drawing.arm(!page.editing.drawing.isArmed));
get("pause").addEventListener("click", () => page.player.press());
get("resume").addEventListener("click", () => page.player.goOn());
get("add").addEventListener("click", () => page.editing.toggleAdding());
get("backwards").addEventListener("click", () => page.editing.trackBack());
get("undo").addEventListener("click", () => page.editing.undo());
get("cancel").addEventListener("click", () => page.editing.cancel());
get("stop").addEventListener("click", () => {
  keeping.letGoOn();
  page.end(page.canGoOn ? "Stopped. Save the results, or go on." : "Stopped. Save the results, or choose another video.");
});

/** Goes to the frame before or after the one that is shown.
 * @param {number} by */
function step(by) {
  if (page.state === "first") page.beginning.step(by);
  else page.player.step(by);
}
get("back").addEventListener("click", () => step(-1));
get("forward").addEventListener("click", () => step(1));
addEventListener("keydown", (event) => press(event, page, step));
// Takes the focus off a button after a mouse click, so that Space is a shortcut again. One reached by Tab keeps it.
addEventListener("click", ({ target, detail }) => {
  const clicked = detail > 0 && target instanceof Element ? target.closest("button") : undefined;
  if (clicked && clicked === document.activeElement) clicked.blur();
});

input("see").addEventListener("change", () => {
  if (page.run) page.run.sees = page.seen.isOn;
  page.seen.fit();
  page.repaint();
});
addEventListener("click", ({ target }) => {
  const sources = /** @type {HTMLDetailsElement} */ (get("sources"));
  if (page.run && target instanceof Node && !sources.contains(target)) sources.open = false;
});
get("sources").addEventListener("keydown", (event) => {
  const sources = /** @type {HTMLDetailsElement} */ (get("sources"));
  if (!page.run || event.key !== "Escape") return;
  // Escape closes the menu only: `press` ignores a prevented event.
  event.preventDefault();
  sources.open = false;
  sources.querySelector("summary")?.focus();
});
get("key-form").addEventListener("submit", async (event) => {
  event.preventDefault();
  (await page.service()).key = input("key").value;
  page.hasKey = true;
  get("key-form").hidden = true;
  page.say(page.again ? "" : "Choose the video or the camera again.");
  page.again?.();
});
addEventListener("beforeunload", (event) => {
  if (page.isUnsaved && !keeping.isSafe) event.preventDefault();
});
for (const host of document.querySelectorAll(".host")) host.textContent = new URL(".", location.href).href.slice(0, -1);
