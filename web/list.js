// The list of objects.

import { get } from "./dom.js";

/**
 * @typedef {object} Told
 * @property {(object: FollowedObject) => void} choose
 * @property {(object: FollowedObject) => void} remove
 * @property {(object: FollowedObject) => void} doubt Shows the next frame where its box may be wrong.
 * @property {() => void} change A name or the visibility of an object has changed.
 */

export class ObjectList {
  /**
   * @param {HTMLElement} place
   * @param {Told} told
   */
  constructor(place, told) {
    this.place = place;
    this.told = told;
    /** @type {Map<FollowedObject, HTMLElement>} */
    this.items = new Map();
    /** @type {WeakSet<FollowedObject>} The objects that were deleted, and may come back by undo. */
    this.deleted = new WeakSet();
  }

  /**
   * @param {FollowedObject[]} objects
   * @param {FollowedObject | undefined} chosen
   */
  show(objects, chosen) {
    const { items, place } = this;
    for (const [object, item] of items) if (!objects.includes(object)) this.remove(object, item);
    objects.forEach((object, at) => {
      if (items.has(object)) return;
      const item = this.item(object);
      items.set(object, item);
      place.insertBefore(item, place.children[at]);
      // Undo brought the object back. The focus may be on another one's delete button: move it away, so that Enter
      // does not delete that one. A new object does not move the focus.
      const isBack = this.deleted.has(object) && document.querySelector("#list .remove:focus-visible, #add:focus-visible");
      if (isBack) item.querySelector("input")?.focus();
    });
    [...place.children].forEach((item, at) => item.classList.toggle("chosen", objects[at] === chosen));
    place.querySelectorAll("input[type=radio]").forEach((radio, at) => {
      /** @type {HTMLInputElement} */ (radio).checked = objects[at] === chosen;
    });
  }

  /** Removes an object's item. If it had the focus, the next item gets it, or else the button that adds an object.
   * @param {FollowedObject} object
   * @param {HTMLElement} item */
  remove(object, item) {
    const beside = item.nextElementSibling ?? item.previousElementSibling;
    // After a click with the mouse, `:focus-visible` does not match, and the focus stays with the page's shortcuts.
    const hadFocus = item.querySelector(":focus-visible");
    item.remove();
    this.items.delete(object);
    this.deleted.add(object);
    if (hadFocus) /** @type {HTMLElement} */ (beside?.lastElementChild ?? get("add")).focus();
  }

  /** @param {FollowedObject} object */
  item(object) {
    const item = document.createElement("li");
    item.style.setProperty("--color", object.color);
    const [radio, name, shown] = [input("radio"), input("text"), input("checkbox")];
    const doubt = button("doubt", () => this.told.doubt(object));
    const remove = button("remove", () => this.told.remove(object));
    const label = () => {
      tell(radio, `Choose ${object.name}`);
      tell(shown, `Show ${object.name}`);
      tell(doubt, `Next doubtful frame of ${object.name}`);
      tell(remove, `Delete ${object.name}`);
    };
    label();
    radio.name = "object";
    radio.addEventListener("change", () => this.told.choose(object));
    name.setAttribute("aria-label", "Name");
    name.dir = "auto";
    name.value = object.name;
    name.addEventListener("input", () => {
      object.name = name.value;
      label();
      this.told.change();
    });
    shown.checked = object.isShown;
    shown.addEventListener("change", () => {
      object.isShown = shown.checked;
      this.told.change();
    });
    item.append(radio, name, shown, doubt, remove);
    return item;
  }
}

/** Sets the label and the tooltip of a control.
 * @param {HTMLElement} control
 * @param {string} text */
function tell(control, text) {
  control.setAttribute("aria-label", text);
  control.title = text;
}

/** @param {string} type */
function input(type) {
  const element = document.createElement("input");
  element.type = type;
  return element;
}

/**
 * @param {string} icon
 * @param {() => void} act
 */
function button(icon, act) {
  const element = document.createElement("button");
  element.type = "button";
  element.className = `icon quiet ${icon}`;
  element.addEventListener("click", act);
  return element;
}
