// Follows one object by a session of the tracker, in this page or at the service.

import { LocalClient } from "./js/local.js";
import { Problem } from "./js/problem.js";

/**
 * @typedef {object} Told
 * @property {(isUp: boolean) => void} line
 * @property {() => void} anew The service had lost the session: another one goes on from the last box.
 * @property {(error: unknown) => void} fail
 */

/** Most frames sent and not answered. */
export const WINDOW = 8;

/** Collects the objects' requests for one frame into one call, so that the frame is decoded once. */
class Batch {
  /** @param {LocalClient} client */
  constructor(client) {
    this.client = client;
    /** @type {{picture: Picture, see: boolean, sessions: any[], told: ((answers: Promise<Answer[]>) => void)[]} | undefined} */
    this.open = undefined;
  }

  /**
   * @param {LocalSession} session
   * @param {Picture} picture
   * @param {boolean} see
   * @returns {Promise<Answer>}
   */
  async track(session, picture, see) {
    if (this.open?.picture !== picture) {
      this.flush();
      this.open = { picture, see: false, sessions: [], told: [] };
      // The other objects ask for this frame in the same turn of the event loop.
      queueMicrotask(() => this.flush());
    }
    const { open } = this;
    open.see ||= see;
    const at = open.sessions.push(session) - 1;
    /** @type {Promise<Answer[]>} */
    const answers = new Promise((resolve) => open.told.push(resolve));
    return (await answers)[at];
  }

  flush() {
    const { open } = this;
    if (!open) return;
    this.open = undefined;
    const answers = this.client.track(open.sessions, open.picture.image, { see: open.see });
    open.told.forEach((tell) => tell(answers));
  }
}

/** @type {WeakMap<LocalClient, Batch>} */
const batches = new WeakMap();

/** @implements {Follower} */
export class LocalFollower {
  /** @param {LocalClient} client */
  constructor(client) {
    this.client = client;
    this.batch = batches.get(client) ?? new Batch(client);
    batches.set(client, this.batch);
    /** @type {LocalSession | undefined} */
    this.session = undefined;
  }

  get own() {
    if (!this.session) throw new Error("The session is not open.");
    return this.session;
  }

  /** @param {Picture} picture
   * @param {Box} box */
  async open(picture, box) {
    const session = await this.client.open(picture.image, box);
    this.end();
    return (this.session = session);
  }

  /** @param {Uint8Array<ArrayBuffer>} saved */
  async restore(saved) {
    const session = await this.client.restore(saved);
    this.end();
    this.session = session;
    return session.frame;
  }

  /** @param {Picture} picture
   * @param {Header} header */
  track(picture, { box, see = false }) {
    return box ? this.own.correct(picture.image, box) : this.batch.track(this.own, picture, see);
  }

  async save() {
    return this.own.snapshot();
  }

  async bag() {
    return this.own.bag();
  }

  end() {
    this.session?.end().catch(() => undefined);
    this.session = undefined;
  }
}

/** @implements {Follower} */
export class ServiceFollower {
  /**
   * @param {Client} client
   * @param {boolean} isLive
   * @param {Told} told
   */
  constructor(client, isLive, told) {
    this.client = client;
    this.isLive = isLive;
    this.told = told;
    /** @type {Session | undefined} */
    this.session = undefined;
    /** @type {FrameStream | undefined} */
    this.stream = undefined;
    /** Whether the session has answered. */
    this.hasAnswered = false;
    this.isOver = false;
    /** @type {{picture: Picture, box: Box} | undefined} The last picture with an answer, and its box. */
    this.last = undefined;
    /** @type {{picture: Picture, header: Header, resolve: (answer: Answer | undefined) => void,
     *   reject: (problem: unknown) => void, by?: object}[]} Oldest first; `by` is the stream that sent it. */
    this.waiting = [];
  }

  get own() {
    if (!this.session) throw new Error("The session is not open.");
    return this.session;
  }

  /** @param {Picture} picture
   * @param {Box} box
   * @returns {Promise<Answer>} */
  async open(picture, box) {
    const session = await this.client.open(picture.blob, box);
    // `goBackBefore` may have restored a session from a state of too late a frame: end that.
    this.leave();
    this.last = { picture, box: session.box };
    this.connect(session);
    return { frame: 0, box: session.box, score: 1, status: "tracking" };
  }

  /** @param {Uint8Array<ArrayBuffer>} saved */
  async restore(saved) {
    const session = await this.client.restore(saved);
    this.leave();
    this.connect(session);
    return session.frame;
  }

  /** @param {Session} session */
  connect(session) {
    this.session = session;
    this.hasAnswered = false;
    if (this.isOver) return this.end();
    const onLine = (/** @type {boolean} */ isUp) => this.told.line(isUp);
    const stream = session.stream({ live: this.isLive, window: WINDOW, patience: Infinity, onLine });
    this.stream = stream;
    stream.ended.then((problem) => problem && this.stream === stream && this.fail(problem));
  }

  /** @param {Picture} picture
   * @param {Header} header
   * @returns {Promise<Answer | undefined>} */
  track(picture, header) {
    if (this.isOver) return Promise.resolve(undefined);
    return new Promise((resolve, reject) => {
      /** @type {ServiceFollower["waiting"][number]} */
      const sent = { picture, header, resolve, reject };
      this.waiting.push(sent);
      this.transmit(sent);
    });
  }

  /** @param {ServiceFollower["waiting"][number]} sent */
  async transmit(sent) {
    const { stream } = this;
    if (!stream || sent.by === stream) return;
    sent.by = stream;
    try {
      const answer = await stream.track(sent.picture.blob, sent.header);
      if (this.stream !== stream) return;
      this.waiting = this.waiting.filter((other) => other !== sent);
      if (answer) {
        this.hasAnswered = true;
        this.last = { picture: sent.picture, box: answer.box };
      }
      sent.resolve(answer);
    } catch (problem) {
      if (this.stream !== stream) return;
      if (!stream.isEnded) this.waiting = this.waiting.filter((other) => other !== sent);
      // The stream goes on after the service refused one frame.
      if (stream.isEnded) this.fail(problem);
      else sent.reject(problem);
    }
  }

  /** @param {unknown} problem */
  fail(problem) {
    // The service may have restarted with other keys, which do not fit the session's snapshot: begin another session.
    if (problem instanceof Problem && problem.isGone && this.hasAnswered && !this.isOver) this.goOn();
    else this.giveUp(problem);
  }

  /** @param {unknown} problem */
  giveUp(problem) {
    if (this.isOver) return;
    this.told.fail(problem);
    this.waiting.splice(0).forEach(({ reject }) => reject(problem));
  }

  /** Goes on in another session, from the last picture and its box. */
  async goOn() {
    this.session = this.stream = undefined;
    this.hasAnswered = false;
    try {
      if (!this.last) return;
      await this.open(this.last.picture, this.last.box);
      if (this.isOver) return;
      this.told.anew();
      this.waiting.forEach((sent) => this.transmit(sent));
    } catch (error) {
      this.giveUp(error);
    }
  }

  /** The present state; frames that are sent and not answered may be in it. */
  async save() {
    const taken = await this.own.call("GET", "/snapshot");
    return new Uint8Array(await taken.arrayBuffer());
  }

  async bag() {
    return this.own.bag();
  }

  end() {
    this.isOver = true;
    this.leave();
    this.waiting.splice(0).forEach(({ resolve }) => resolve(undefined));
  }

  leave() {
    const { session, stream } = this;
    // `fail` ignores the end of a stream that is not `this.stream`.
    this.session = this.stream = undefined;
    stream?.close();
    // A session that cannot be ended expires at the service.
    session?.end().catch(() => undefined);
  }
}

/** A follower for one object of a run, in the page or at the service.
 * @param {Run} run
 * @returns {Follower} */
export function followerOf(run) {
  const { client, source, told } = run;
  if (client instanceof LocalClient) return new LocalFollower(client);
  // The follower of a draft is no object's own: its caller gets the failure from `open` or `track` instead.
  const isOwn = () => run.objects.some((object) => object.follower === follower);
  const follower = new ServiceFollower(client, source.isLive, {
    line: (isUp) => told.line(isUp),
    anew: () => told.anew(),
    fail: (error) => isOwn() && run.fail(error),
  });
  return follower;
}
