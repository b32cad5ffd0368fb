// The list of objects.

/**
 * @typedef {import("./objects.js").FollowedObject} FollowedObject
 *
 * @typedef {object} Told
 * @property {(object: FollowedObject) => void} choose
 * @property {(object: FollowedObject) => void} remove
 * @property {(object: FollowedObject) => void} doubt Shows the next frame where it may be off.
 * @property {() => void} change A name, or what is shown, has changed.
 */

export class ObjectList {
  /**
   * @param {HTMLElement} place
   * @param {Told} told
   */
  constructor(place, told) {
    this.place = place;
    this.told = told;
    /** @type {FollowedObject[]} */
    this.objects = [];
  }

  /**
   * @param {FollowedObject[]} objects
   * @param {FollowedObject | undefined} chosen
   */
  show(objects, chosen) {
    const isSame = objects.length === this.objects.length && objects.every((object, at) => object === this.objects[at]);
    if (!isSame) this.place.replaceChildren(...objects.map((object) => this.item(object)));
    this.objects = [...objects];
    [...this.place.children].forEach((item, at) => item.classList.toggle("chosen", objects[at] === chosen));
    this.place.querySelectorAll("input[type=radio]").forEach((radio, at) => {
      /** @type {HTMLInputElement} */ (radio).checked = objects[at] === chosen;
    });
  }

  /** @param {FollowedObject} object */
  item(object) {
    const item = document.createElement("li");
    const radio = input("radio", `Choose ${object.name}`);
    radio.name = "object";
    radio.addEventListener("change", () => this.told.choose(object));
    const swatch = document.createElement("span");
    swatch.className = "swatch";
    swatch.style.setProperty("background", object.color);
    const name = input("text", "Name");
    name.value = object.name;
    name.addEventListener("input", () => {
      object.name = name.value;
      this.told.change();
    });
    const shown = input("checkbox", `Show ${object.name}`);
    shown.checked = object.isShown;
    shown.addEventListener("change", () => {
      object.isShown = shown.checked;
      this.told.change();
    });
    const doubt = button("Next doubt", `Next doubtful frame of ${object.name}`, () => this.told.doubt(object));
    const remove = button("Delete", `Delete ${object.name}`, () => this.told.remove(object));
    item.append(radio, swatch, name, shown, doubt, remove);
    return item;
  }
}

/**
 * @param {string} type
 * @param {string} label
 */
function input(type, label) {
  const element = document.createElement("input");
  element.type = type;
  element.setAttribute("aria-label", label);
  return element;
}

/**
 * @param {string} text
 * @param {string} label
 * @param {() => void} act
 */
function button(text, label, act) {
  const element = document.createElement("button");
  element.type = "button";
  element.textContent = text;
  element.setAttribute("aria-label", label);
  element.addEventListener("click", act);
  return element;
}
