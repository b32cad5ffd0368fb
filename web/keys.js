// Keyboard shortcuts. They work unless the focus is in a text field, or on a control that uses the key itself.

import { button } from "./dom.js";

/** Selectors of the controls that use all keys, the arrows, or the space bar. */
const TEXT = "input:not([type=radio], [type=checkbox], [type=range])";
const ARROWS = "input, pre";
const SPACE = "input, button, a, summary";

/** The key's character; on keyboards without Latin letters, the Latin letter at that position.
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
  // While a box is being drawn, `BoxDrawing` handles the keys.
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
