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
    item.style.setProperty("--color", object.color);
    const radio = input("radio", `Choose ${object.name}`);
    radio.name = "object";
    radio.addEventListener("change", () => this.told.choose(object));
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
    const doubt = button("doubt", `Next doubtful frame of ${object.name}`, () => this.told.doubt(object));
    const remove = button("remove", `Delete ${object.name}`, () => this.told.remove(object));
    item.append(radio, name, shown, doubt, remove);
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
  if (type !== "text") element.title = label;
  return element;
}

/**
 * @param {string} icon
 * @param {string} label
 * @param {() => void} act
 */
function button(icon, label, act) {
  const element = document.createElement("button");
  element.type = "button";
  element.className = `icon quiet ${icon}`;
  element.setAttribute("aria-label", label);
  element.title = label;
  element.addEventListener("click", act);
  return element;
}
