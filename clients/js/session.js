// A session: frames go in, boxes come back.

import { Backoff } from "./backoff.js";
import { boxOf, boxText, bytesOf, frameOf } from "./given.js";
import { Kept, restoring } from "./kept.js";
import { Problem } from "./problem.js";
import { FrameStream } from "./stream.js";
import { documentOf, pause, snapshotOf } from "./transport.js";

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
 * @property {(Blob | Uint8Array<ArrayBuffer>)[]} frames
 * @property {Box} [box] Where the user corrects it.
 * @property {(number: number, frames: Uint8Array<ArrayBuffer>[]) => Promise<Response>} make
 * @property {AbortSignal} [signal]
 */

/** Milliseconds between tries to leave a service that is about to end, which may be the only one for a while. */
const MOVE_EVERY = 1000;
/** The members that an answer to a frame must have. */
const ANSWER = ["frame", "box"];

export class Session {
  /**
   * @param {import("./client.js").Client} client
   * @param {string} id
   * @param {Answer} answer The last one.
   * @param {Headers} headers Of the answer that told so.
   * @param {import("./kept.js").Origin} [origin] What opens it again.
   * @param {boolean} [isOwn] Whether this client has opened it.
   */
  constructor(client, id, answer, headers, origin, isOwn = false) {
    this.client = client;
    this.id = id;
    /** The number of its last frame. */
    this.frame = answer.frame;
    /** The box of that frame. */
    this.box = answer.box;
    this.score = answer.score;
    this.status = answer.status;
    this.isOwn = isOwn;
    /** The last frame that the service has, as far as is known. */
    this.lastAcknowledged = answer.frame;
    /** Whether the service is about to end: the session goes on elsewhere, as soon as another one takes it. */
    this.isDraining = false;
    /** When that was tried last. */
    this.triedToMove = 0;
    /** What the service may ask for again. */
    this.kept = new Kept(origin);
    /** @type {Promise<unknown>} The requests before. */
    this.before = Promise.resolve();
    /** @type {Set<Promise<unknown>>} What is being read of it. */
    this.reading = new Set();
    this.isEnded = false;
    /** @type {FrameStream | undefined} */
    this.open = undefined;
    this.isDraining = headers.get("draining") === "true";
  }

  /** @param {Answer} answer */
  take({ frame, box, score, status }) {
    Object.assign(this, { frame, box, score, status });
  }

  /**
   * Sends the next frame. Calls are made one after the other, in the order of `track`. A frame that got no answer, or
   * whose call was aborted, is kept: the next call sends it before its own.
   * @param {Frame} frame
   * @param {AbortSignal} [signal]
   * @returns {Promise<Answer>}
   */
  async track(frame, signal) {
    /** @type {Sent["make"]} */
    const make = (number, [own]) => this.post("POST", "frames", { frame: number }, own, signal);
    return this.next({ frames: [frameOf(frame)], make, signal });
  }

  /**
   * Sends several frames at once. If one is bad, none is taken.
   * @param {Iterable<Frame>} frames
   * @param {AbortSignal} [signal]
   * @returns {Promise<Answer[]>}
   */
  async trackAll(frames, signal) {
    const own = [...frames].map(frameOf);
    if (own.length === 0) return [];
    /** @type {Sent["make"]} */
    const make = (number, parts) => {
      const body = new FormData();
      for (const part of parts) body.append("frame", new Blob([part]), "frame");
      return this.post("POST", "frames", { frame: number }, body, signal);
    };
    const answer = await this.next({ frames: own, make, signal });
    return answer.answers ?? [answer];
  }

  /**
   * Sends a frame as the next one with the right box in it. It may be one that was sent before.
   * @param {Frame} frame
   * @param {Box} box
   * @param {AbortSignal} [signal]
   * @returns {Promise<Answer>}
   */
  async correct(frame, box, signal) {
    const ownBox = boxOf(box);
    /** @type {Sent["make"]} */
    const make = (number, [own]) => this.put(number, own, ownBox, signal);
    return this.next({ frames: [frameOf(frame)], box: ownBox, make, signal });
  }

  /** The session's state; the service does not count this as a frame.
   * @returns {Promise<View>} */
  async read() {
    return documentOf(await this.call("GET", ""), "id", "answer");
  }

  /** The whole session as bytes, for `client.restore`.
   * @returns {Promise<Uint8Array<ArrayBuffer>>} */
  async snapshot() {
    return snapshotOf(await this.deliver(this.frame + 1, () => this.call("GET", "/snapshot")));
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
    return (await documentOf(await this.call("POST", "/token", { query: { seconds } }), "token")).token;
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
    this.lastAcknowledged = this.frame;
  }

  /** Ends the session, and its stream. */
  async end() {
    // The service closes the stream of an ended session only at its next frame; without one, the line would stay open.
    this.open?.close();
    this.kept = new Kept();
    this.isEnded = true;
    // Reads under way would fail with 404 after the end, which a page's console would show.
    await Promise.allSettled(this.reading);
    try {
      await this.call("DELETE", "");
    } catch (error) {
      // The session has expired, or the answer to an earlier try to end it got lost.
      if (!(error instanceof Problem && (error.status === 404 || error.status === 410))) throw error;
    }
  }

  /**
   * @param {string} method
   * @param {string} path Below that of the session.
   * @param {import("./transport.js").Request} [request]
   */
  call(method, path, request) {
    const called = this.client.transport.call(method, `sessions/${this.id}${path}`, request);
    return method === "GET" ? this.noteReading(called) : called;
  }

  /** @param {Promise<Response>} called */
  noteReading(called) {
    const read = called.finally(() => this.reading.delete(read));
    this.reading.add(read);
    return read;
  }

  /**
   * @param {string} method
   * @param {string} path
   * @param {Record<string, string | number>} query
   * @param {BodyInit} body
   * @param {AbortSignal} [signal]
   */
  post(method, path, query, body, signal) {
    // `fetch` sets the type of a form, with the boundary in it.
    const type = body instanceof FormData ? undefined : "application/octet-stream";
    return this.call(method, `/${path}`, { query, body, type, signal });
  }

  /**
   * @param {number} number
   * @param {Uint8Array<ArrayBuffer>} frame
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
  async next(sent) {
    if (this.open) throw new Error("The session has a stream: send the frames there, or close it.");
    const made = this.before.then(() => this.send(sent));
    this.before = made.catch(() => undefined);
    return made;
  }

  /** @param {Sent} sent */
  async send({ frames: given, box, make, signal }) {
    // Files are read only now: many calls may wait, and their frames need not be in memory.
    const frames = await Promise.all(given.map(bytesOf));
    signal?.throwIfAborted();
    const number = (this.kept.last ?? this.frame) + 1;
    // From here on the frames count: without an answer they are sent again before the next ones.
    frames.forEach((frame, index) => this.kept.put({ number: number + index, frame, box }));
    try {
      const response = await this.deliver(number, (at) => make(at, frames), signal);
      const answer = await documentOf(response, ...ANSWER);
      this.take(answer);
      this.lastAcknowledged = Math.max(this.lastAcknowledged, this.frame);
      this.isDraining ||= response.headers.get("draining") === "true";
      await this.checkpoint(response.headers.get("checkpoint"));
      return answer;
    } catch (error) {
      const isRefused = error instanceof Problem && !error.isTemporary;
      if (isRefused) this.kept.forgetAfter(Math.max(this.lastAcknowledged, this.frame));
      throw error;
    }
  }

  /** Makes sure, after an answer, that the session can go on elsewhere.
   * @param {string | null} stored The last frame that a store has. */
  async checkpoint(stored) {
    // With a store, any replica can go on from that frame.
    if (stored !== null) this.kept.forgetUntil(Number(stored));
    else if (this.isDraining && Date.now() - this.triedToMove >= MOVE_EVERY) await this.move();
    else if (this.isSnapshotDue) await this.renewOrigin();
    else if (!this.takesSnapshots) this.kept.forgetUntil(this.frame);
  }

  get takesSnapshots() {
    return this.isOwn && this.client.snapshotEvery > 0;
  }

  get isSnapshotDue() {
    const { origin } = this.kept;
    return this.takesSnapshots && (!origin || this.frame - origin.frame >= this.client.snapshotEvery);
  }

  /** A snapshot of now or later; nothing where there is none for the moment.
   * @returns {Promise<import("./kept.js").Origin | undefined>} */
  async takeOrigin() {
    if (this.isEnded) return undefined;
    const { transport } = this.client;
    const { id, frame } = this;
    const taken = this.noteReading(transport.attempt("GET", transport.at(`sessions/${id}/snapshot`), {}));
    const snapshot = await taken.then(snapshotOf).catch(() => undefined);
    return snapshot && { frame, request: restoring(snapshot) };
  }

  /** Takes a snapshot; without it the older one and more frames are kept. */
  async renewOrigin() {
    const origin = await this.takeOrigin();
    if (origin) this.kept.renew(origin);
    return origin;
  }

  /** Goes on elsewhere, under another id. While there is nothing else, it goes on here. */
  async move() {
    this.triedToMove = Date.now();
    const origin = await this.renewOrigin();
    if (!origin) return;
    const moved = await this.client.create({ ...origin.request, patience: 0 }).catch(() => undefined);
    if (moved) [this.id, this.lastAcknowledged, this.isDraining] = [moved.id, moved.frame, moved.isDraining];
  }

  /**
   * Makes a call for which the service must have the frames before one, and sends those that it does not have.
   * @param {number} number The first frame that the call does not need.
   * @param {(number: number) => Promise<Response>} call
   * @param {AbortSignal} [signal]
   */
  async deliver(number, call, signal) {
    const backoff = new Backoff(this.client.transport.patience);
    for (let tries = 0; ; tries += 1) {
      try {
        while (this.lastAcknowledged < number - 1) await this.resend(this.lastAcknowledged + 1, signal);
        return await call(number);
      } catch (error) {
        const next = this.recovery(error, number);
        // If every replica loses the session again, this loop ends with the time for retries.
        const pausing = tries === 0 ? 0 : backoff.next();
        if (pausing === undefined) throw error;
        if (pausing > 0) await pause(pausing, signal);
        const lost = /** @type {Problem} */ (error);
        this.lastAcknowledged = next === undefined ? await this.reopen(lost, signal) : next - 1;
      }
    }
  }

  /**
   * @param {number} number A frame that the service does not have.
   * @param {AbortSignal} [signal]
   */
  async resend(number, signal) {
    const kept = this.kept.find(number);
    if (!kept) throw new Error(`The service needs frame ${number} again, which is not kept any more.`);
    const { frame, box } = kept;
    const sent = box ? this.put(number, frame, box, signal) : this.post("POST", "frames", { frame: number }, frame, signal);
    // A proxy's page in place of an answer does not mean that the service has the frame.
    await documentOf(await sent, ...ANSWER);
    this.lastAcknowledged = number;
  }

  /**
   * The frame to go on with after an error; undefined: the session is to be opened again. Throws the error where neither
   * helps.
   * @param {unknown} error
   * @param {number} number The first frame that the call does not need.
   * @returns {number | undefined}
   */
  recovery(error, number) {
    if (!(error instanceof Problem)) throw error;
    const { expectedFrame, isGone } = error;
    if (isGone) return undefined;
    if (expectedFrame === undefined) throw error;
    const sent = this.lastAcknowledged + 1;
    // The service needs an older frame. If that is not kept, the service has a copy of the session from before its
    // origin, as another replica may.
    if (expectedFrame < sent) return this.kept.find(expectedFrame) ? expectedFrame : undefined;
    // The service already has frames that are sent again here, perhaps those of the call, too.
    if (sent < expectedFrame && sent < number) return Math.min(expectedFrame, number);
    throw error;
  }

  /**
   * Opens the session again after the service has lost it, under another id.
   * @param {Problem} lost What told so.
   * @param {AbortSignal} [signal]
   * @returns {Promise<number>} The last frame that it has then.
   */
  async reopen(lost, signal) {
    const { origin } = this.kept;
    if (!origin) throw lost;
    try {
      const opened = await this.client.create({ ...origin.request, signal });
      [this.id, this.isDraining] = [opened.id, opened.isDraining];
      return opened.frame;
    } catch (error) {
      // The session cannot be opened again, such as by a service with other keys, which refuses the snapshot.
      if (!(error instanceof Problem) || error.isTemporary) throw error;
      lost.cause = error;
      throw lost;
    }
  }
}
