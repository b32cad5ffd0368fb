// The message line of the page, and the messages about the status of the target.

/** Frames that a new status must last to be announced; `lost` is announced at once. */
const SAID_AFTER = 5;
export const BEGINNING = "Beginning…";
export const GO_ON = ' Press "Go on" to try again from there.';
export const FOLLOWING = "Following. Draw again to correct the box.";

export class Message {
  /** @param {HTMLElement} place */
  constructor(place) {
    this.place = place;
    /** @type {string} The status of the last frame. */
    this.last = "tracking";
    /** @type {string} The status that was announced last. */
    this.said = "tracking";
    /** For how many frames the status has been the same. */
    this.held = 0;
  }

  /**
   * @param {string} text
   * @param {boolean} [isBad]
   */
  say(text, isBad = false) {
    this.place.textContent = text;
    this.place.classList.toggle("bad", isBad);
  }

  /** Begins with the status `tracking`. */
  follow() {
    this.last = this.said = "tracking";
    this.held = 0;
  }

  /** Announces a new status once it has lasted `SAID_AFTER` frames.
   * @param {"tracking" | "uncertain" | "lost"} status */
  take(status) {
    this.held = status === this.last ? this.held + 1 : 1;
    this.last = status;
    if (status === this.said || (this.held < SAID_AFTER && status !== "lost")) return;
    if (status === "lost") this.say("The target is lost. Draw a box to show where it is, or wait for it.");
    else if (this.said === "lost") this.say("Found again. Draw again to correct the box.");
    else if (status === "uncertain") this.say("The box may be off. Draw again to correct it.");
    else this.say(FOLLOWING);
    this.said = status;
  }

  /** @param {boolean} isUp */
  line(isUp) {
    if (!isUp) this.say("The line is broken. Trying again…", true);
    else if (this.place.classList.contains("bad")) this.say("The line is back.");
  }
}
