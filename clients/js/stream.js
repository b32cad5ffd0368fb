// A session's stream. After a broken line it takes up where it was: nothing is lost, nothing tracked twice. A session
// that the service has lost is opened again.

import { boxOf, bytesOf, checkNumber, checkWindow, frameOf } from "./given.js";
import { Problem } from "./problem.js";
import { documentOf, longest, pause } from "./transport.js";

/**
 * @typedef {object} Seen What the tracker saw, where that was asked for.
 * @property {number[][]} [particles] Centre x and y, width, weight; likeliest first.
 * @property {number[]} [votes] One for each entry of the bag.
 *
 * @typedef {import("./session.js").Answer & Seen} StreamAnswer
 *
 * @typedef {object} StreamOptions
 * @property {boolean} [live] Whether the newest frame wins: one that waits is skipped when a newer one comes.
 * @property {number} [window] Frames on their way at a time, 1 to 32 (8).
 * @property {number} [patience] Milliseconds in which a broken line is opened again; as the client's when left out. It
 *   ends before that where the service answers eight times, and gives no stream.
 * @property {(isUp: boolean) => void} [onLine] Is told when the line breaks and when it is up again.
 *
 * @typedef {object} Socket What a stream needs of a WebSocket: that of the package `ws` has less than a browser's.
 * @property {((event: any) => void) | null} onmessage
 * @property {((event: any) => void) | null} onclose
 * @property {((event: any) => void) | null} onerror
 * @property {(data: any) => void} send
 * @property {() => void} close
 *
 * @typedef {object} Waiting A frame without an answer.
 * @property {Blob | Uint8Array<ArrayBuffer>} frame
 * @property {{box?: import("./session.js").Box, see?: boolean}} header
 * @property {(answer: StreamAnswer | undefined) => void} resolve
 * @property {(problem: unknown) => void} reject
 */

const FIRST_PAUSE = 200;
const LONGEST_PAUSE = 5000;
/**
 * After so many failures in a row to open a stream or to keep a session, though the service answers, the stream ends.
 */
const MOST_TRIES = 8;
/** Close codes above this are the sum of this and an HTTP status: the service closed the stream for good. */
const OF_STATUS = 4000;
const UNAUTHORIZED = 401;
/** The close code that browsers give for a line that broke. */
const ABNORMAL = 1006;
/** The HTTP status of the handshake of a stream. */
const SWITCHED = 101;

const NO_SOCKET = "its stream cannot be opened: a proxy may let no WebSocket through.";
const LOSES = "it loses each session at once: a balancer may send requests to several instances without a common store.";

/** @param {string} why */
const noStream = (why) => new Problem({ type: "no-stream", detail: `The service answers, but ${why}` });

/** The bytes of a frame that was sent: a file is read before it is sent.
 * @param {Waiting} sent */
const sentFrame = ({ frame }) => /** @type {Uint8Array<ArrayBuffer>} */ (frame);

/** The parsed message of the service; a problem if the text is none of its messages.
 * @param {any} data */
function messageOf(data) {
  try {
    const message = JSON.parse(data);
    if (message.next !== undefined || message.type || (message.box && message.frame !== undefined)) return message;
  } catch {
    // A message that is no JSON is reported below.
  }
  const detail = `The stream sent what is no answer of bagtrack: ${JSON.stringify(String(data).slice(0, 60))}`;
  return new Problem({ type: "", status: SWITCHED, detail });
}

export class FrameStream {
  /**
   * @param {import("./session.js").Session} session
   * @param {StreamOptions} [options]
   */
  constructor(session, options = {}) {
    this.session = session;
    this.live = options.live ?? false;
    this.window = checkWindow(options.window ?? 8);
    this.patience = checkNumber("patience", options.patience ?? session.client.transport.patience);
    this.onLine = options.onLine ?? (() => undefined);
    /** @type {Waiting[]} Oldest first. */
    this.waiting = [];
    /** How many of those that wait are on their way. */
    this.sent = 0;
    /** How many of those have a number that is not theirs any more, since a frame before them was refused. */
    this.outOfOrder = 0;
    /** @type {Waiting | undefined} Whose frame is being read: the next one to be sent. */
    this.reading = undefined;
    /** @type {Socket | undefined} */
    this.socket = undefined;
    /** @type {ReturnType<typeof setTimeout> | undefined} Ends a line that is silent. */
    this.silence = undefined;
    this.isUp = false;
    /** Whether it was told that the line is broken. */
    this.isDown = false;
    /** How often the session could be read since the line broke, so that only the stream cannot be opened. */
    this.readings = 0;
    /** How often the session was opened again since the last answer. */
    this.reopened = 0;
    this.isEnded = false;
    this.wait = FIRST_PAUSE;
    /** When the line broke. */
    this.downSince = Date.now();
    /** @type {Problem | undefined} */
    this.lastProblem = undefined;
    /** @type {Problem | undefined} The service has lost the session; it is opened again with the next frame. */
    this.lost = undefined;
    /** @type {{origin: import("./kept.js").Origin, until: number} | undefined} A snapshot of a frame up to `until`. */
    this.newer = undefined;
    this.isRenewing = false;
    /** @type {Error | undefined} What a frame is told that comes too late. */
    this.whyEnded = undefined;
    /** @type {(problem: Error | undefined) => void} */
    this.resolveEnded = () => undefined;
    /** @type {Promise<Error | undefined>} The stream has ended: why, if it was not by `close`. */
    this.ended = new Promise((resolve) => (this.resolveEnded = resolve));
    /** Browsers tell when the network goes. A socket does not, for long. */
    this.offline = () => this.drop();
    globalThis.addEventListener?.("offline", this.offline);
    session.hold(this);
    this.resendFrom(session.frame + 1);
    // The service may have these frames from an earlier stream; its first message tells.
    this.sent = this.waiting.length;
    this.connect();
  }

  /**
   * Sends the next frame. Many may be sent without waiting for their answers.
   * @param {import("./client.js").Frame} frame
   * @param {object} [header]
   * @param {import("./session.js").Box} [header.box] The right box in this frame, which may be one that was sent before.
   * @param {boolean} [header.see] Whether the answer shall tell what the tracker saw.
   * @returns {Promise<StreamAnswer | undefined>} Nothing where the frame was skipped, in a live stream.
   */
  track(frame, { box, see } = {}) {
    if (this.isEnded) return Promise.reject(this.whyEnded);
    return new Promise((resolve, reject) => {
      const own = frameOf(frame);
      const header = { box: box == null ? undefined : boxOf(box), see };
      if (this.live) this.skip(box != null);
      this.waiting.push({ frame: own, header, resolve, reject });
      if (this.lost) {
        // The session was lost while no frame waited.
        this.downSince = Date.now();
        this.reopen(this.lost);
      } else this.transmit();
    });
  }

  /** Of live frames that cannot be sent yet, the newest is kept. One with a box is skipped for another one with a box.
   * @param {boolean} hasBox Whether the newest has one. */
  skip(hasBox) {
    // A frame that is being read counts as sent: if reading took longer than the next frame, none would ever be sent.
    const unsent = Math.max(this.sent, this.waiting.findIndex((other) => other === this.reading) + 1);
    for (const older of this.waiting.splice(unsent)) {
      if (older.header.box && !hasBox) this.waiting.push(older);
      else older.resolve(undefined);
    }
  }

  /** Ends the stream; the session goes on. Nobody is told the answers to frames on their way, but those frames count. */
  close() {
    this.end(undefined);
  }

  transmit() {
    while (this.isUp && !this.outOfOrder && this.sent < Math.min(this.waiting.length, this.window)) {
      const next = this.waiting[this.sent];
      const { frame, header } = next;
      if (!ArrayBuffer.isView(frame)) return this.read(next);
      const number = this.live ? undefined : this.session.frame + 1 + this.sent;
      this.sent += 1;
      this.socket?.send(JSON.stringify({ frame: number, ...header }));
      this.socket?.send(frame);
      this.listen();
    }
  }

  /** Takes the line for broken where what is asked for does not come: not every line that breaks tells. */
  listen() {
    clearTimeout(this.silence);
    const { socket } = this;
    if (!socket || (this.isUp && this.sent === 0)) return;
    const bytes = this.waiting.slice(0, this.sent).reduce((sum, sent) => sum + sentFrame(sent).length, 0);
    // The service itself may let a frame wait for half of this time.
    this.silence = setTimeout(() => this.socket === socket && this.drop(), 2 * longest(bytes));
  }

  /** Takes the line for broken. */
  drop() {
    const { socket } = this;
    if (!socket) return;
    this.socket = undefined;
    socket.close();
    this.closed(ABNORMAL);
  }

  /** Reads a frame that may be a file, and goes on. A socket that cannot read it would not tell.
   * @param {Waiting} next */
  async read(next) {
    if (this.reading === next) return;
    this.reading = next;
    try {
      next.frame = await bytesOf(next.frame);
    } catch (problem) {
      this.waiting = this.waiting.filter((other) => other !== next);
      next.reject(problem);
    }
    this.reading = undefined;
    this.transmit();
  }

  /** @param {any} message */
  receive(message) {
    if (message instanceof Problem) return this.end(message);
    if (message.next !== undefined) return this.resume(message.next);
    if (message.type) return this.refused(new Problem(message));
    for (let count = message.skipped ?? 0; count > 0; count -= 1) this.acknowledge()?.resolve(undefined);
    this.reopened = 0;
    this.session.take(message);
    this.session.isDraining ||= message.draining === true;
    const answered = this.acknowledge();
    if (answered) this.session.kept.put({ number: message.frame, frame: sentFrame(answered), box: answered.header.box });
    this.checkpoint(message.checkpoint);
    answered?.resolve(message);
    this.transmit();
  }

  /** Makes sure, after an answer, that the session can be opened again.
   * @param {number | undefined} stored The last frame that a store has. */
  async checkpoint(stored) {
    const { session } = this;
    if (stored !== undefined) return session.kept.forgetUntil(stored);
    if (this.newer && session.frame >= this.newer.until) {
      session.kept.renew(this.newer.origin);
      this.newer = undefined;
    }
    if (!session.takesSnapshots) return session.kept.forgetUntil(session.frame);
    if (!session.isSnapshotDue || this.newer || this.isRenewing) return;
    this.isRenewing = true;
    const { id } = session;
    const origin = await session.takeOrigin();
    this.isRenewing = false;
    // Frames go on meanwhile, and the snapshot may include them: it is used once they are answered.
    if (origin && session.id === id) this.newer = { origin, until: session.frame + this.sent };
  }

  /** Takes the oldest frame on its way, which has an answer. */
  acknowledge() {
    if (this.sent === 0) return undefined;
    this.sent -= 1;
    return this.waiting.shift();
  }

  /** @param {Problem} problem */
  refused(problem) {
    this.lastProblem = problem;
    // The token was refused, not the frame: the service closes the stream next.
    if (problem.status === UNAUTHORIZED) return;
    if (problem.isGone) return this.gone(problem);
    if (this.outOfOrder > 0) {
      this.outOfOrder -= 1;
      // All frames with wrong numbers were refused: they are sent again with their new numbers.
      if (this.outOfOrder === 0) this.sent = 0;
    } else {
      this.acknowledge()?.reject(problem);
      if (!this.live) this.outOfOrder = this.sent;
    }
    this.transmit();
  }

  /** The service expects frame `next`: it has those before it, and sends their answers.
   * @param {number} next */
  resume(next) {
    const known = next - 1 - this.session.frame;
    if (known > this.sent) {
      const detail = "Another client has sent frames to this session.";
      return this.end(new Problem({ type: "replaced", status: 409, detail }));
    }
    // It is not known which of the live frames were skipped; the oldest count as skipped, since newer ones matter more.
    if (this.live) this.waiting.splice(0, this.sent - known).forEach((skipped) => skipped.resolve(undefined));
    this.sent = known;
    this.outOfOrder = 0;
    this.isUp = true;
    this.isDown = false;
    this.readings = 0;
    this.wait = FIRST_PAUSE;
    this.onLine(true);
    this.transmit();
  }

  /** The service has no frames from `next` on any more: they are sent again before those that wait.
   * @param {number} next */
  resendFrom(next) {
    const { kept, frame } = this.session;
    if (next <= frame && !this.live && !kept.find(next)) {
      const detail = `The service needs frame ${next} again, which is not kept any more.`;
      return this.end(new Problem({ type: "frame-out-of-order", status: 409, detail, expected_frame: next }));
    }
    const again = this.live && next <= frame ? [] : kept.after(next - 1);
    const nobody = () => undefined;
    this.waiting.unshift(...again.map(({ frame, box }) => ({ frame, header: { box }, resolve: nobody, reject: nobody })));
    kept.forgetAfter(next - 1);
    this.session.frame = Math.min(frame, next - 1);
    if (next <= frame) this.sent = 0;
  }

  /** The service has lost the session.
   * @param {Problem} problem */
  gone(problem) {
    const { socket } = this;
    this.socket = undefined;
    socket?.close();
    if (this.isEnded || !this.session.kept.origin) return this.end(problem);
    this.breakLine();
    this.newer = undefined;
    this.lost = problem;
    // While no frame waits, the session is not opened again: it would take up room at the service.
    if (this.waiting.length > 0) return this.reopen(problem);
    this.onLine(true);
  }

  /** Opens the session again, and the stream with it.
   * @param {Problem} problem What told that the service has lost it. */
  async reopen(problem) {
    this.lost = undefined;
    this.readings = 0;
    // The first time the session is opened again without a pause.
    if (this.reopened > 0) {
      if (this.isLate) return this.end(problem);
      if (this.reopened >= MOST_TRIES) return this.end(noStream(LOSES));
      await this.rest();
      if (this.isEnded) return;
    }
    this.reopened += 1;
    try {
      const at = await this.session.reopen(problem);
      if (this.isEnded) return;
      this.sent = 0;
      this.outOfOrder = 0;
      this.resendFrom(at + 1);
      await this.connect();
    } catch (error) {
      if (error instanceof Problem && error.isTemporary) return this.closed(ABNORMAL);
      this.end(/** @type {Error} */ (error));
    }
  }

  async connect() {
    const { client, id, frame } = this.session;
    try {
      const token = await this.token();
      if (this.isEnded) return;
      const url = client.transport.at(`sessions/${id}/stream`, { from: frame + 1, drop: this.live ? "true" : undefined });
      url.protocol = url.protocol.replace("http", "ws");
      if (!client.WebSocket)
        throw new Error("This platform has no WebSocket, as Node.js before 22: new Client(url, { WebSocket }) takes one.");
      const socket = new client.WebSocket(url, token ? ["bagtrack", token] : ["bagtrack"]);
      this.socket = socket;
      socket.onmessage = (event) => {
        if (this.socket !== socket) return;
        this.receive(messageOf(event.data));
        this.listen();
      };
      const down = (/** @type {number} */ code) => {
        if (this.socket !== socket) return;
        this.socket = undefined;
        this.closed(code);
      };
      socket.onclose = (event) => down(event.code);
      // Some platforms fire `error` but no `close` for a socket that could not be opened.
      socket.onerror = () => down(ABNORMAL);
      this.listen();
    } catch (error) {
      const isTemporary = error instanceof Problem && error.isTemporary && !this.isLate;
      if (isTemporary) this.closed(ABNORMAL);
      else this.refusedFor(/** @type {Error} */ (error));
    }
  }

  /** Whether the line has been broken for so long that it is not opened again. */
  get isLate() {
    return Date.now() - this.downSince > this.patience;
  }

  /** A socket cannot send the key. It takes a token, as which a key that is a token itself will do. */
  async token() {
    const { key } = this.session.client.transport;
    if (!key) return "";
    return this.session.token().catch((error) => {
      if (error instanceof Problem && error.slug === "forbidden") return key;
      throw error;
    });
  }

  /**
   * @param {number} code
   * @returns {Promise<void>}
   */
  async closed(code) {
    if (this.isEnded) return;
    // After 401 the token has expired. The key gives a new one, unless it has expired, too: the call below tells.
    const isFinal = code > OF_STATUS && code !== OF_STATUS + UNAUTHORIZED;
    if (isFinal) return this.refusedFor(this.reason(code - OF_STATUS));
    if (this.readings > 0 && (this.isLate || this.readings >= MOST_TRIES)) return this.end(noStream(NO_SOCKET));
    this.breakLine();
    await this.rest();
    if (this.isEnded) return;
    // Browsers do not tell why a WebSocket cannot be opened; the answer to this call does.
    const { transport } = this.session.client;
    const url = transport.at(`sessions/${this.session.id}`);
    const asked = transport.attempt("GET", url, {}).then((response) => documentOf(response, "frames"));
    const seen = await asked.catch((error) => error);
    if (this.isEnded) return;
    if (seen instanceof Error) {
      this.readings = 0;
      const isTemporary = seen instanceof Problem && seen.isTemporary;
      return isTemporary && !this.isLate ? this.closed(code) : this.refusedFor(seen);
    }
    this.readings += 1;
    this.resendFrom(seen.frames);
    await this.connect();
  }

  /** Waits before another try, longer each time. */
  async rest() {
    const { wait } = this;
    this.wait = Math.min(2 * wait, LONGEST_PAUSE);
    await pause(wait);
  }

  breakLine() {
    clearTimeout(this.silence);
    if (this.isDown) return;
    this.isDown = true;
    this.isUp = false;
    this.downSince = Date.now();
    this.onLine(false);
  }

  /** The service does not take this stream.
   * @param {Error} problem */
  refusedFor(problem) {
    if (problem instanceof Problem && problem.isGone) this.gone(problem);
    else this.end(problem);
  }

  /** @param {number} status */
  reason(status) {
    if (this.lastProblem?.status === status) return this.lastProblem;
    const detail = "A newer stream of this session has taken the place of this one.";
    return new Problem(status === 409 ? { type: "replaced", status, detail } : { type: "", status });
  }

  /** @param {Error | undefined} problem */
  end(problem) {
    if (this.isEnded) return;
    clearTimeout(this.silence);
    globalThis.removeEventListener?.("offline", this.offline);
    this.isEnded = true;
    this.isUp = false;
    const { socket } = this;
    // Answers that are under way are not taken any more.
    this.socket = undefined;
    socket?.close();
    this.session.hold(undefined);
    const left = this.waiting.splice(0);
    // The service may have these frames, so they are kept: a post or the next stream sends them again before its own.
    const { kept, frame: last } = this.session;
    const sent = this.outOfOrder ? [] : left.slice(0, this.sent);
    sent.forEach((it, index) => kept.put({ number: last + 1 + index, frame: sentFrame(it), box: it.header.box }));
    this.whyEnded = problem ?? new Error("The stream has ended.");
    left.forEach(({ reject }) => reject(this.whyEnded));
    this.resolveEnded(problem);
  }
}
