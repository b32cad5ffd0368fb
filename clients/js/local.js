// Sessions in this page or process: no service, nothing is uploaded. The same calls as those of `Client` and `Session`.

import { snapshotBytes } from "./given.js";
import { ofNode } from "./platform.js";
import { Problem } from "./problem.js";
import { close, sendable } from "./transfer.js";

/**
 * @typedef {import("./image.js").Image} Image
 * @typedef {import("./session.js").Answer} Answer
 * @typedef {import("./session.js").Box} Box
 * @typedef {import("./session.js").View} View
 * @typedef {import("./stream.js").StreamAnswer} StreamAnswer
 *
 * @typedef {{resolve: (value: any) => void, reject: (problem: unknown) => void}} Waiting
 */

/**
 * The id of the newest session. It counts on over all clients and threads: no session is taken for one of another
 * thread.
 */
let lastId = 0;

const ENDED = { type: "session-not-found", status: 404, detail: "The session has ended." };

/** Browsers do not tell why a worker cannot be loaded; these are the usual reasons. */
const NOT_LOADED =
  "The worker with the tracker cannot be loaded: its file is missing where the page looks for it, such as one that a " +
  "bundler has left out, or a content security policy refuses it.";

/** Whether a call needs sessions that were opened before.
 * @param {string} name
 * @param {{ids?: number[]}} call */
const isOfSessions = (name, { ids }) => name !== "open" && name !== "restore" && ids?.length !== 0;

/** A thread with trackers. Sessions of one client share it, and decode a frame once for all of them. */
export class LocalClient {
  constructor() {
    /** @type {Promise<any> | undefined} */
    this.worker = undefined;
    /** @type {Problem | undefined} Why the worker before has ended. */
    this.lastProblem = undefined;
    /** @type {Map<number, Waiting>} Calls without an answer. */
    this.waiting = new Map();
    this.calls = 0;
    /** @type {Promise<unknown>} The calls before are sent. */
    this.before = Promise.resolve();
  }

  /** Loads the tracker, so that the first session need not wait for it. */
  async warm() {
    await this.started();
  }

  /**
   * Opens a session.
   * @param {Image} image The first frame.
   * @param {Box} box The target's box in it.
   * @param {import("./tracker.js").TrackerOptions & {signal?: AbortSignal}} [options]
   */
  async open(image, box, { signal, ...options } = {}) {
    const id = ++lastId;
    const answer = await this.call("open", { id, image, box, options }, signal);
    return new LocalSession(this, id, answer);
  }

  /** Opens a session that goes on where a snapshot was taken: here, by another local session, or by the service.
   * @param {import("./client.js").Frame} snapshot
   * @param {AbortSignal} [signal] */
  async restore(snapshot, signal) {
    const id = ++lastId;
    const answer = await this.call("restore", { id, snapshot: await snapshotBytes(snapshot) }, signal);
    return new LocalSession(this, id, answer);
  }

  /**
   * Tracks the next frame of several sessions.
   * @param {LocalSession[]} sessions
   * @param {Image} image
   * @param {{see?: boolean, signal?: AbortSignal}} [options]
   * @returns {Promise<StreamAnswer[]>} Theirs, in their order.
   */
  async track(sessions, image, { see, signal } = {}) {
    const answers = await this.call("step", { image, see, ids: sessions.map(({ id }) => id) }, signal);
    sessions.forEach((session, at) => session.take(answers[at]));
    return answers;
  }

  /** Ends the thread, and all sessions with it. */
  async close() {
    const { worker } = this;
    this.fail(new Problem({ type: "session-not-found", status: 404, detail: "The client is closed." }));
    await (await worker)?.terminate();
  }

  /** @param {Problem} problem */
  fail(problem) {
    this.worker = undefined;
    this.lastProblem = problem;
    for (const { reject } of this.waiting.values()) reject(problem);
    this.waiting.clear();
  }

  /**
   * Makes a call to the thread. Calls are answered in their order. One that is aborted before it is sent has no effect.
   * @param {keyof import("./worker.js").Calls} name
   * @param {any} call
   * @param {AbortSignal} [signal]
   * @returns {Promise<any>}
   */
  call(name, call, signal) {
    if (signal?.aborted) return Promise.reject(signal.reason);
    const taken = "image" in call ? sendable(call.image) : undefined;
    taken?.catch(() => undefined);
    const { lastProblem } = this;
    const sending = this.before.then(async () => {
      this.check(lastProblem);
      // A new worker would not have the session.
      if (!this.worker && isOfSessions(name, call)) throw new Problem(ENDED);
      const worker = await this.started();
      const { sent, handed } = (await taken) ?? { sent: undefined, handed: [] };
      this.check(lastProblem);
      signal?.throwIfAborted();
      this.calls += 1;
      const number = this.calls;
      // Throws if a value cannot be copied to the worker; then no call waits for an answer.
      worker.postMessage({ number, name, call: taken ? { ...call, image: sent } : call }, handed);
      const answer = new Promise((resolve, reject) => this.waiting.set(number, { resolve, reject }));
      answer.catch(() => undefined);
      worker.ref?.();
      return { answer };
    });
    // A call that could not be sent closes the image that was made for it, and does not block the calls after it.
    const givenUp = sending.catch(() => taken?.then(({ sent, handed }) => handed.length > 0 && close(sent)));
    this.before = givenUp.catch(() => undefined);
    return sending.then(({ answer }) => answer);
  }

  /** Refuses a call whose worker has ended since it was made: another one would not know what it is about.
   * @param {Problem | undefined} lastProblem The last one at that time. */
  check(lastProblem) {
    if (this.lastProblem !== lastProblem) throw this.lastProblem;
  }

  /** The worker, which is started where there is none. */
  started() {
    if (this.worker) return this.worker;
    const worker = this.start((problem) => {
      // The end of an older worker must not end the calls of the present one.
      if (this.worker === worker) this.fail(problem);
    });
    this.worker = worker;
    return worker;
  }

  /** @param {(problem: Problem) => void} ends */
  async start(ends) {
    // Bundlers recognise a worker by exactly this expression.
    const isBrowser = typeof Worker !== "undefined";
    const worker = isBrowser ? new Worker(new URL("./worker.js", import.meta.url), { type: "module" }) : await startThread();
    await new Promise((resolve, reject) => {
      const fail = (/** @type {string} */ detail) => {
        const problem = new Problem({ type: "internal", status: 500, detail });
        reject(problem);
        ends(problem);
      };
      worker.addEventListener("message", (/** @type {MessageEvent} */ { data }) => {
        if (data.isReady) resolve(undefined);
        else this.receive(worker, data, ends);
      });
      worker.addEventListener("error", (/** @type {ErrorEvent} */ { message }) =>
        fail(message || NOT_LOADED),
      );
      // Only Node.js has an event for a worker that ends without an error.
      worker.addEventListener("exit", () => fail("The worker with the tracker has ended, and all sessions with it."));
    });
    return worker;
  }

  /**
   * @param {any} worker
   * @param {any} answer
   * @param {(problem: Problem) => void} ends
   */
  receive(worker, { number, value, problem, isBroken }, ends) {
    const waiting = this.waiting.get(number);
    this.waiting.delete(number);
    if (problem) waiting?.reject(new Problem(problem));
    else waiting?.resolve(value);
    if (isBroken) {
      worker.terminate();
      ends(new Problem(problem));
    }
    // A process of Node.js may end while no call waits for an answer.
    if (this.waiting.size === 0) worker.unref?.();
  }
}

/** Starts a worker of Node.js, and gives it the `addEventListener` of a browser's worker. */
async function startThread() {
  const { Worker } = await ofNode("worker_threads");
  // Not the expression above: a bundler would recognise it, and add the file once more.
  const here = import.meta.url;
  const worker = new Worker(new URL("worker.js", here));
  worker.addEventListener = (/** @type {string} */ kind, /** @type {(event: any) => void} */ listen) =>
    worker.on(kind, (/** @type {any} */ told) => listen(kind === "message" ? { data: told } : told));
  return worker;
}

/** A session in this page or process. */
export class LocalSession {
  /**
   * @param {LocalClient} client
   * @param {number} id
   * @param {Answer} answer
   */
  constructor(client, id, answer) {
    this.client = client;
    this.id = id;
    /** The number of its last frame. */
    this.frame = answer.frame;
    /** The box of that frame. */
    this.box = answer.box;
    this.score = answer.score;
    this.status = answer.status;
  }

  /** @param {Answer} answer */
  take({ frame, box, score, status }) {
    Object.assign(this, { frame, box, score, status });
  }

  /**
   * Tracks the next frame.
   * @param {Image} image
   * @param {AbortSignal} [signal]
   * @returns {Promise<Answer>}
   */
  async track(image, signal) {
    return (await this.client.track([this], image, { signal }))[0];
  }

  /**
   * Tracks several frames.
   * @param {Iterable<Image>} images
   * @param {AbortSignal} [signal]
   * @returns {Promise<Answer[]>}
   */
  async trackAll(images, signal) {
    const answers = [];
    for (const image of images) answers.push(await this.track(image, signal));
    return answers;
  }

  /**
   * Takes the next frame with the right box in it. It may be one that was tracked before.
   * @param {Image} image
   * @param {Box} box
   * @param {AbortSignal} [signal]
   * @returns {Promise<Answer>}
   */
  async correct(image, box, signal) {
    const answer = await this.client.call("correct", { id: this.id, image, box }, signal);
    this.take(answer);
    return answer;
  }

  /** The session's state.
   * @returns {Promise<Omit<View, "id" | "expires_at">>} */
  read() {
    return this.client.call("read", { id: this.id });
  }

  /** The whole session as bytes: for `restore` of a local client, and of a client whose service takes unsigned ones.
   * @returns {Promise<Uint8Array<ArrayBuffer>>} */
  snapshot() {
    return this.client.call("save", { id: this.id });
  }

  /** A picture (PNG) of what the tracker keeps of the target, in browsers.
   * @returns {Promise<Blob>} */
  bag() {
    return this.client.call("bag", { id: this.id });
  }

  /** Frames as of a stream of a service.
   * @param {{live?: boolean}} [options] */
  stream(options) {
    return new LocalStream(this, options);
  }

  /** Ends the session.
   * @returns {Promise<void>} */
  async end() {
    try {
      await this.client.call("end", { id: this.id });
    } catch (error) {
      // The session has ended with its client.
      if (!(error instanceof Problem && error.isGone)) throw error;
    }
  }
}

/** Frames one after the other; the newest of live ones. */
export class LocalStream {
  /**
   * @param {LocalSession} session
   * @param {{live?: boolean}} [options]
   */
  constructor(session, { live = false } = {}) {
    this.session = session;
    this.live = live;
    this.isEnded = false;
    this.underWay = 0;
    /** @type {(problem: unknown) => void} */
    this.resolveEnded = () => undefined;
    /** @type {Promise<unknown>} The stream has ended: why, if it was not by `close`. */
    this.ended = new Promise((resolve) => (this.resolveEnded = resolve));
  }

  /**
   * @param {Image} image
   * @param {{box?: Box, see?: boolean}} [header]
   * @returns {Promise<StreamAnswer | undefined>} Nothing where the frame was skipped, in a live stream.
   */
  async track(image, { box, see } = {}) {
    if (this.isEnded) throw new Error("The stream has ended.");
    if (this.live && !box && this.underWay > 1) return undefined;
    this.underWay += 1;
    try {
      if (box) return await this.session.correct(image, box);
      return (await this.session.client.track([this.session], image, { see }))[0];
    } finally {
      this.underWay -= 1;
    }
  }

  close() {
    this.isEnded = true;
    this.resolveEnded(undefined);
  }
}
