// A session: frames go in, boxes come back.

import { Problem } from "./problem.js";
import { FrameStream } from "./stream.js";

/**
 * @typedef {object} Box In pixels of the uploaded frame; it may reach over the edge.
 * @property {number} x
 * @property {number} y
 * @property {number} width
 * @property {number} height
 *
 * @typedef {object} Answer
 * @property {number} frame The number of the frame; the first of a session is 0.
 * @property {Box} box
 * @property {number} score The chance that the box overlaps the target by half or more.
 * @property {"tracking" | "uncertain" | "lost"} status
 *
 * @typedef {object} View The state of a session.
 * @property {string} id
 * @property {number} frames
 * @property {Answer} answer
 * @property {{width: number, height: number}} image
 * @property {Record<string, unknown>} parameters
 * @property {string} expires_at
 *
 * @typedef {import("./client.js").Frame} Frame
 * @typedef {{number: number, count: number, make: (number: number) => Promise<Response>}} Sent
 */

/** Most requests that are kept until the store has their frames. */
const MOST_KEPT = 256;
/** A service that is about to end may be the only one for a while: milliseconds until the next try to go elsewhere. */
const TRIES_TO_MOVE = 1000;

/** @param {Box} box */
export function boxText({ x, y, width, height }) {
  return [x, y, width, height].map((value) => Number(value.toFixed(4))).join(",");
}

export class Session {
  /**
   * @param {import("./client.js").Client} client
   * @param {string} id
   * @param {number} frame The number of its last frame.
   * @param {Box} box The box of that frame.
   * @param {Headers} headers Of the answer that told so.
   */
  constructor(client, id, frame, box, headers) {
    this.client = client;
    this.id = id;
    this.frame = frame;
    this.box = box;
    /** Whether the service is about to end: the session goes on elsewhere, as soon as another one takes it. */
    this.isDraining = false;
    /** When that was tried last. */
    this.triedToMove = 0;
    /** @type {Sent[]} What a service with a store may ask for again. */
    this.kept = [];
    /** @type {Promise<unknown>} The requests before. */
    this.before = Promise.resolve();
    /** @type {FrameStream | undefined} */
    this.open = undefined;
    this.note(headers);
  }

  /**
   * Sends the next frame. Calls are made one after the other, in the order of `track`.
   * @param {Frame} frame
   * @param {AbortSignal} [signal]
   * @returns {Promise<Answer>}
   */
  track(frame, signal) {
    return this.next(1, (number) => this.post("POST", "frames", { frame: number }, frame, signal));
  }

  /**
   * Sends several frames at once. If one is bad, none is taken.
   * @param {Frame[]} frames
   * @param {AbortSignal} [signal]
   * @returns {Promise<Answer[]>}
   */
  async trackAll(frames, signal) {
    if (frames.length === 0) return [];
    const body = new FormData();
    for (const frame of frames) body.append("frame", frame instanceof Blob ? frame : new Blob([frame]), "frame");
    const make = (/** @type {number} */ number) => this.post("POST", "frames", { frame: number }, body, signal);
    const answer = await this.next(frames.length, make);
    return answer.answers ?? [answer];
  }

  /**
   * Sends a frame as the next one with the right box in it. It may be one that was sent before.
   * @param {Frame} frame
   * @param {Box} box
   * @param {AbortSignal} [signal]
   * @returns {Promise<Answer>}
   */
  correct(frame, box, signal) {
    const text = boxText(box);
    return this.next(1, (number) => this.post("PUT", "target", { frame: number, box: text }, frame, signal));
  }

  /** The session's state; the service does not count this as a frame.
   * @returns {Promise<View>} */
  async read() {
    return (await this.call("GET", "")).json();
  }

  /** The whole session as bytes, for `client.restore`.
   * @returns {Promise<Uint8Array<ArrayBuffer>>} */
  async snapshot() {
    return new Uint8Array(await (await this.call("GET", "/snapshot")).arrayBuffer());
  }

  /** A picture (PNG) of what the tracker keeps of the target.
   * @returns {Promise<Blob>} */
  async bag() {
    return (await this.call("GET", "/bag.png")).blob();
  }

  /** A token for this session alone, to be given to a page.
   * @param {number} [seconds] How long it is good for (3600).
   * @returns {Promise<string>} */
  async token(seconds) {
    return (await (await this.call("POST", "/token", { query: { seconds } })).json()).token;
  }

  /** Sends frames over a WebSocket, many at a time. Until it is closed no frames are sent otherwise.
   * @param {import("./stream.js").StreamOptions} [options]
   * @returns {FrameStream} */
  stream(options) {
    return new FrameStream(this, options);
  }

  /** @param {FrameStream | undefined} stream What sends this session's frames now. */
  hold(stream) {
    if (stream && this.open) throw new Error("The session has a stream; close it first.");
    this.open = stream;
  }

  /** Ends the session. */
  async end() {
    try {
      await this.call("DELETE", "");
    } catch (error) {
      // It has ended: by itself, or with an answer that got lost.
      if (!(error instanceof Problem && (error.status === 404 || error.status === 410))) throw error;
    }
  }

  /**
   * @param {string} method
   * @param {string} path Below that of the session.
   * @param {import("./transport.js").Request} [request]
   */
  call(method, path, request) {
    return this.client.transport.call(method, `sessions/${this.id}${path}`, request);
  }

  /**
   * @param {string} method
   * @param {string} path
   * @param {Record<string, string | number>} query
   * @param {BodyInit} body
   * @param {AbortSignal} [signal]
   */
  post(method, path, query, body, signal) {
    // A form makes its own type, with the boundary in it.
    const type = body instanceof FormData ? undefined : "application/octet-stream";
    return this.call(method, `/${path}`, { query, body, type, signal });
  }

  /**
   * Makes a request with the next frames after those before.
   * @param {number} count
   * @param {Sent["make"]} make
   */
  next(count, make) {
    if (this.open) return Promise.reject(new Error("The session has a stream: send the frames there, or close it."));
    const made = this.before.then(() => this.send(count, make));
    this.before = made.catch(() => undefined);
    return made;
  }

  /**
   * @param {number} count
   * @param {Sent["make"]} make
   */
  async send(count, make) {
    const sent = { number: this.frame + 1, count, make };
    const response = await make(sent.number).catch((error) => this.resend(error, sent));
    const answer = await response.json();
    this.frame = answer.frame;
    this.box = answer.box;
    this.kept.push(sent);
    this.note(response.headers);
    // With a store, any replica has the session.
    const isAlone = this.isDraining && !response.headers.has("checkpoint");
    if (isAlone && Date.now() - this.triedToMove >= TRIES_TO_MOVE) await this.moveOn();
    return answer;
  }

  /** Goes on elsewhere, under another id. While there is nothing else, it goes on here. */
  async moveOn() {
    this.triedToMove = Date.now();
    const moved = await this.snapshot().then((bytes) => this.client.restore(bytes, undefined, 0)).catch(() => undefined);
    if (moved) [this.id, this.isDraining] = [moved.id, moved.isDraining];
  }

  /**
   * A replica has gone, and the store has not its last frames: they are sent again, and then this one.
   * @param {unknown} error
   * @param {Sent} sent
   */
  async resend(error, sent) {
    const expected = error instanceof Problem ? error.expectedFrame : undefined;
    const first = this.kept.findIndex(({ number }) => number === expected);
    if (first < 0) throw error;
    for (const { number, make } of this.kept.slice(first)) await make(number);
    return sent.make(sent.number);
  }

  /** @param {Headers} headers */
  note(headers) {
    this.isDraining ||= headers.get("draining") === "true";
    // Without a store there is nothing to go on with.
    const checkpoint = Number(headers.get("checkpoint") ?? Infinity);
    this.kept = this.kept.filter(({ number, count }) => number + count - 1 > checkpoint).slice(-MOST_KEPT);
  }
}
