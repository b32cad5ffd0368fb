// How long to wait before a request is sent again.

const FIRST = 100;
const LONGEST = 5000;
const LONGEST_TIMER = 2 ** 31 - 1;

/** Pauses that grow, until the time is up. */
export class Backoff {
  /** @param {number} patience Milliseconds. */
  constructor(patience) {
    this.late = Date.now() + patience;
    this.own = FIRST;
  }

  /**
   * The next pause, at least as long as the service asks for; nothing where the time would be up then.
   * @param {number} [asked] Milliseconds.
   */
  next(asked = 0) {
    // The random part keeps clients that were cut off together from coming back together.
    const pausing = Math.max(this.own * (0.5 + Math.random() / 2), asked);
    this.own = Math.min(2 * this.own, LONGEST);
    // A timer with a longer delay would fire at once.
    return Date.now() + pausing > this.late ? undefined : Math.min(pausing, LONGEST_TIMER);
  }
}
