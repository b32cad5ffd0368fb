// Shortcuts. They work wherever the focus is, but where one writes, and where a control takes the key itself.

import { button } from "./dom.js";

/** What takes keys of its own. */
const TEXT = "input:not([type=radio], [type=checkbox], [type=range])";
const ARROWS = "input, pre";
const SPACE = "input, button, a, summary";

/** A key as it is on a Latin keyboard: others have letters of their own on it.
 * @param {KeyboardEvent} event */
const keyOf = ({ key, code }) => (/^[^\0-~]$/.test(key) && code.startsWith("Key") ? code[3].toLowerCase() : key);

/**
 * @param {KeyboardEvent} event
 * @param {Page} page
 * @param {(by: number) => void} step Shows the frame before or after.
 */
export function press(event, page, step) {
  const { target, defaultPrevented } = event;
  const key = keyOf(event);
  const isIn = (/** @type {string} */ controls) => target instanceof Element && target.closest(controls) !== null;
  if (!page.run || defaultPrevented || isIn(TEXT)) return;
  if (key === "Escape") return page.editing.escape();
  // While a box is moved, the keys are its own.
  if (page.editing.drawing.box) return;
  const isUndoing = key.toLowerCase() === "z" && (event.ctrlKey || event.metaKey) && !event.shiftKey && !event.altKey;
  const isChord = event.ctrlKey || event.metaKey || event.altKey;
  const isSpace = key === " " && page.hasRows && !isIn(SPACE);
  const isArrow = key.startsWith("Arrow") && !isIn(ARROWS);
  if (isUndoing) page.editing.undo();
  else if (isChord) return;
  else if (isSpace && !event.repeat) button("pause").click();
  else if (key.toLowerCase() === "d" || (isArrow && key === "ArrowLeft")) step(-1);
  else if (key.toLowerCase() === "f" || (isArrow && key === "ArrowRight")) step(1);
  else if (!isSpace) return;
  event.preventDefault();
}
