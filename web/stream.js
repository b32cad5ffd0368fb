// A session's stream. After a broken line it takes up where it was: nothing is lost, nothing tracked twice.

import { Problem, readSession, streamToken } from "./api.js";

/**
 * @typedef {object} Sent A frame on its way.
 * @property {Blob} blob
 * @property {number} at When it was sent, in milliseconds.
 * @property {import("./api.js").Box} [box] The corrected box.
 * @property {boolean} [see] Whether the answer tells what the tracker saw.
 * @property {any} [what] The caller's own.
 *
 * @typedef {object} Answer
 * @property {number} frame
 * @property {import("./api.js").Box} box
 * @property {number} score 0 to 1.
 * @property {"tracking" | "uncertain" | "lost"} status
 * @property {number} [skipped]
 * @property {number[][]} [particles] Centre x and y, width, weight.
 * @property {number[]} [votes] One for each entry of the bag.
 */

const FIRST_WAIT = 200;
const LONGEST_WAIT = 5000;
/** The server closed it for good: with a problem, or for a newer stream. */
const FINAL = 4000;

export class FrameStream {
  /**
   * @param {string} id The session.
   * @param {boolean} drop Whether the newest frame wins.
   * @param {{answer: (answer: Answer, sent: Sent) => void, skip: (sent: Sent) => void,
   *   fail: (problem: Error) => void, line: (isUp: boolean) => void}} told
   */
  constructor(id, drop, told) {
    this.id = id;
    this.drop = drop;
    this.told = told;
    /** @type {Sent[]} Frames without an answer, oldest first. */
    this.unanswered = [];
    /** The number of the first frame without an answer. */
    this.next = 1;
    /** @type {WebSocket | undefined} */
    this.socket = undefined;
    this.isUp = false;
    this.isEnded = false;
    this.wait = FIRST_WAIT;
  }

  async open() {
    try {
      const token = await streamToken(this.id);
      if (this.isEnded) return;
      const url = new URL(`/sessions/${this.id}/stream`, location.href);
      url.protocol = url.protocol.replace("http", "ws");
      url.searchParams.set("from", String(this.next));
      if (this.drop) url.searchParams.set("drop", "true");
      const socket = new WebSocket(url, token ? ["bagtrack", token] : ["bagtrack"]);
      this.socket = socket;
      socket.onmessage = (event) => this.receive(JSON.parse(event.data));
      socket.onclose = (event) => this.closed(event.code);
    } catch (error) {
      this.fail(/** @type {Error} */ (error));
    }
  }

  /** @param {Sent} sent */
  send(sent) {
    this.unanswered.push(sent);
    if (this.isUp) this.transmit(sent);
  }

  /** @param {Sent} sent */
  transmit({ blob, box, see }) {
    if (box || see) this.socket?.send(JSON.stringify({ box, see }));
    this.socket?.send(blob);
  }

  /** @param {any} message */
  receive(message) {
    if (message.next !== undefined) return this.resume(message.next);
    if (message.type) return this.fail(new Problem(message));
    for (let count = message.skipped ?? 0; count > 0; count -= 1) {
      const skipped = this.unanswered.shift();
      if (skipped) this.told.skip(skipped);
    }
    this.next = message.frame + 1;
    const sent = this.unanswered.shift();
    if (sent) this.told.answer(message, sent);
  }

  /** The service expects frame `next`: it has those before it, and sends their answers.
   * @param {number} next */
  resume(next) {
    this.isUp = true;
    this.wait = FIRST_WAIT;
    this.told.line(true);
    const known = next - this.next;
    if (this.drop) {
      // Which of them were skipped is not known, and newer ones come.
      const old = this.unanswered.splice(0, Math.max(0, this.unanswered.length - known));
      old.forEach((sent) => this.told.skip(sent));
      return;
    }
    this.unanswered.slice(known).forEach((sent) => this.transmit(sent));
  }

  /** @param {number} code */
  async closed(code) {
    this.isUp = false;
    if (this.isEnded) return;
    if (code > FINAL) {
      const conflict = { type: "replaced", detail: "Another page has taken this session over." };
      return this.fail(new Problem(conflict));
    }
    this.told.line(false);
    await new Promise((resolve) => setTimeout(resolve, this.wait));
    this.wait = Math.min(2 * this.wait, LONGEST_WAIT);
    try {
      // A page is not told why a stream cannot be opened; this call tells.
      await readSession(this.id);
    } catch (error) {
      if (!(error instanceof Problem) || error.slug !== "unreachable") {
        return this.fail(/** @type {Error} */ (error));
      }
    }
    if (!this.isEnded) await this.open();
  }

  /** @param {Error} problem */
  fail(problem) {
    if (this.isEnded) return;
    this.end();
    this.told.fail(problem);
  }

  end() {
    this.isEnded = true;
    this.socket?.close();
  }
}
