// A session: frames go in, boxes come back.

import { Kept, restoring } from "./kept.js";
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
 *
 * @typedef {object} Sent A request with the next frames.
 * @property {Frame[]} frames
 * @property {Box} [box] Where the user corrects it.
 * @property {(number: number) => Promise<Response>} make
 */

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
   * @param {import("./kept.js").Origin} [origin] What opens it again.
   */
  constructor(client, id, frame, box, headers, origin) {
    this.client = client;
    this.id = id;
    this.frame = frame;
    this.box = box;
    /** Whether the service is about to end: the session goes on elsewhere, as soon as another one takes it. */
    this.isDraining = false;
    /** When that was tried last. */
    this.triedToMove = 0;
    /** What the service may ask for again. */
    this.kept = new Kept(origin);
    /** @type {Promise<unknown>} The requests before. */
    this.before = Promise.resolve();
    /** @type {FrameStream | undefined} */
    this.open = undefined;
    this.isDraining = headers.get("draining") === "true";
  }

  /**
   * Sends the next frame. Calls are made one after the other, in the order of `track`.
   * @param {Frame} frame
   * @param {AbortSignal} [signal]
   * @returns {Promise<Answer>}
   */
  track(frame, signal) {
    const make = (/** @type {number} */ number) => this.post("POST", "frames", { frame: number }, frame, signal);
    return this.next({ frames: [frame], make });
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
    const answer = await this.next({ frames: [...frames], make });
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
    const make = (/** @type {number} */ number) => this.put(number, frame, box, signal);
    return this.next({ frames: [frame], box, make });
  }

  /** The session's state; the service does not count this as a frame.
   * @returns {Promise<View>} */
  async read() {
    return (await this.call("GET", "")).json();
  }

  /** The whole session as bytes, for `client.restore`.
   * @returns {Promise<Uint8Array<ArrayBuffer>>} */
  async snapshot() {
    const take = () => this.call("GET", "/snapshot");
    const taken = await take().catch((error) => this.goOn(error, this.frame + 1, take));
    return new Uint8Array(await taken.arrayBuffer());
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
    this.kept = new Kept();
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
   * @param {number} number
   * @param {Frame} frame
   * @param {Box} box
   * @param {AbortSignal} [signal]
   */
  put(number, frame, box, signal) {
    return this.post("PUT", "target", { frame: number, box: boxText(box) }, frame, signal);
  }

  /**
   * Makes a request with the next frames after those before.
   * @param {Sent} sent
   */
  next(sent) {
    if (this.open) return Promise.reject(new Error("The session has a stream: send the frames there, or close it."));
    const made = this.before.then(() => this.send(sent));
    this.before = made.catch(() => undefined);
    return made;
  }

  /** @param {Sent} sent */
  async send({ frames, box, make }) {
    const number = this.frame + 1;
    const response = await make(number).catch((error) => this.goOn(error, number, () => make(number)));
    const answer = await response.json();
    frames.forEach((frame, index) => this.kept.put({ number: number + index, frame, box }));
    this.frame = answer.frame;
    this.box = answer.box;
    this.isDraining ||= response.headers.get("draining") === "true";
    await this.lookAfter(response.headers.get("checkpoint"));
    return answer;
  }

  /** Makes sure, after an answer, that the session can go on elsewhere.
   * @param {string | null} checkpoint */
  async lookAfter(checkpoint) {
    // With a store, any replica has the session up to there.
    if (checkpoint !== null) this.kept.forgetUntil(Number(checkpoint));
    else if (this.isDraining && Date.now() - this.triedToMove >= TRIES_TO_MOVE) await this.moveOn();
    else if (this.isSnapshotDue) await this.renewOrigin();
    else if (!this.kept.origin) this.kept.forgetUntil(this.frame);
  }

  get isSnapshotDue() {
    const { origin } = this.kept;
    return origin !== undefined && this.frame - origin.frame >= this.client.snapshotEvery;
  }

  /** A snapshot of now or later; nothing where there is none for the moment.
   * @returns {Promise<import("./kept.js").Origin | undefined>} */
  async takeOrigin() {
    const { transport } = this.client;
    const { id, frame } = this;
    try {
      const taken = await transport.attempt("GET", transport.at(`sessions/${id}/snapshot`), {});
      return { frame, request: restoring(await taken.arrayBuffer()) };
    } catch {
      return undefined;
    }
  }

  /** Takes a snapshot; without it the older one and more frames are kept. */
  async renewOrigin() {
    const origin = await this.takeOrigin();
    if (origin) this.kept.renew(origin);
    return origin;
  }

  /** Goes on elsewhere, under another id. While there is nothing else, it goes on here. */
  async moveOn() {
    this.triedToMove = Date.now();
    const origin = await this.renewOrigin();
    if (!origin) return;
    const moved = await this.client.create({ ...origin.request, patience: 0 }).catch(() => undefined);
    if (moved) [this.id, this.isDraining] = [moved.id, moved.isDraining];
  }

  /**
   * Makes a call after the service has lost frames, or the whole session: they are sent again before it.
   * @param {unknown} error What the call failed with.
   * @param {number} number The first frame that the call does not need.
   * @param {() => Promise<Response>} call
   */
  async goOn(error, number, call) {
    const late = Date.now() + this.client.transport.patience;
    for (;;) {
      const lost = this.kept.after(await this.standing(error, number), number - 1);
      if (!lost) throw error;
      try {
        for (const { number, frame, box } of lost) {
          if (box) await this.put(number, frame, box);
          else await this.post("POST", "frames", { frame: number }, frame);
        }
        return await call();
      } catch (again) {
        if (Date.now() > late) throw again;
        error = again;
      }
    }
  }

  /**
   * The last frame that the service has, after a failure that tells so.
   * @param {unknown} error
   * @param {number} number The frame that was sent.
   */
  async standing(error, number) {
    if (!(error instanceof Problem)) throw error;
    if (error.isGone) return this.openAgain(error);
    if (error.expectedFrame === undefined || error.expectedFrame >= number) throw error;
    return error.expectedFrame - 1;
  }

  /**
   * Opens the session again after the service has lost it, under another id.
   * @param {unknown} lost What told so.
   * @returns {Promise<number>} The last frame that it has then.
   */
  async openAgain(lost) {
    const { origin } = this.kept;
    if (!origin) throw lost;
    try {
      const opened = await this.client.create(origin.request);
      [this.id, this.isDraining] = [opened.id, opened.isDraining];
      return opened.frame;
    } catch (error) {
      // Such as a service with other keys, which does not take the snapshot.
      throw error instanceof Problem && !error.isTemporary ? lost : error;
    }
  }
}
