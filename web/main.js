// What the buttons do.

import { button, get, input } from "./dom.js";
import { Keeping } from "./keeping.js";
import { offerSaving } from "./saving.js";
import { offerSources } from "./sources.js";
import { Page } from "./page.js";
import { playWelcome } from "./welcome.js";

const page = new Page();

const keeping = new Keeping(page);

page.changed = () => keeping.changed();
page.mayLeave = () => keeping.leave();
page.arrived = () => keeping.arrived();
keeping.begin();
offerSources(
  (open) => page.choose(open),
  (files) => keeping.take(files),
);
offerSaving(page);
playWelcome();

get("draw").addEventListener("click", () => page.editing.drawing.arm(!page.editing.drawing.isArmed));
get("pause").addEventListener("click", () => page.pause(page.state !== "paused"));
get("add").addEventListener("click", () => page.editing.toggleAdding());
get("backwards").addEventListener("click", () => page.editing.trackBack());
get("undo").addEventListener("click", () => page.editing.undo());
get("cancel").addEventListener("click", () => page.editing.cancel());
get("stop").addEventListener("click", () => page.end("Stopped. Save the results, or choose another video."));

/** Goes to the frame before or after the one that is shown.
 * @param {number} by */
function step(by) {
  if (page.state === "first") page.beginning.step(by);
  else if (page.shown) page.timeline.go(page.shown.frame + by);
}
get("back").addEventListener("click", () => step(-1));
get("forward").addEventListener("click", () => step(1));
addEventListener("keydown", (event) => {
  const { target, key } = event;
  if (key === "Escape") page.editing.cancel();
  const isTyping = target instanceof HTMLInputElement && target.type !== "radio" && target.type !== "checkbox";
  if (key === "z" && (event.ctrlKey || event.metaKey) && !event.shiftKey && !isTyping) {
    event.preventDefault();
    page.editing.undo();
  }
  const isTaken = target instanceof HTMLElement && target.closest("input, button, a, #picture, #timeline, summary");
  const isSpace = key === " ";
  if (!page.run || (isTaken && !(isSpace && target.id === "timeline"))) return;
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  if (isSpace && page.hasRows) {
    event.preventDefault();
    button("pause").click();
  } else if (key === "d" || key === "ArrowLeft") step(-1);
  else if (key === "f" || key === "ArrowRight") step(1);
});
get("timeline").addEventListener("keydown", ({ key }) => (key === "d" ? step(-1) : key === "f" && step(1)));

input("see").addEventListener("change", () => {
  if (page.run) page.run.sees = page.seen.isOn;
  page.seen.fit();
});
addEventListener("click", ({ target }) => {
  const sources = /** @type {HTMLDetailsElement} */ (get("sources"));
  if (page.run && target instanceof Node && !sources.contains(target)) sources.open = false;
});
get("sources").addEventListener("keydown", ({ key }) => {
  const sources = /** @type {HTMLDetailsElement} */ (get("sources"));
  if (!page.run || key !== "Escape") return;
  sources.open = false;
  sources.querySelector("summary")?.focus();
});
get("key-form").addEventListener("submit", (event) => {
  event.preventDefault();
  page.client.key = input("key").value;
  page.hasKey = true;
  get("key-form").hidden = true;
  page.say("");
  page.again?.();
});
addEventListener("beforeunload", (event) => {
  if (page.isUnsaved && !keeping.isSafe) event.preventDefault();
});
for (const host of document.querySelectorAll(".host")) host.textContent = new URL(".", location.href).href.slice(0, -1);
