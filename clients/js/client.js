// The client of a service, which opens sessions there.

import { boxText, bytesOf, checkNumber, frameOf, snapshotBytes } from "./given.js";
import { MOST_KEPT, restoring } from "./kept.js";
import { Session } from "./session.js";
import { Transport, documentOf } from "./transport.js";

/**
 * @typedef {Blob | ArrayBuffer | Uint8Array} Frame A JPEG, PNG or WebP file.
 *
 * @typedef {object} OpenOptions
 * @property {"robust" | "paper"} [preset]
 * @property {number} [seed] Seed of all random draws; a random one when left out.
 * @property {Record<string, unknown>} [parameters] Parameters that are set otherwise than in the preset.
 * @property {AbortSignal} [signal]
 *
 * @typedef {new (url: URL, protocols: string[]) => import("./stream.js").Socket} SocketClass
 */

/** A random UUID. Pages that do not come over HTTPS have no `crypto.randomUUID`. */
function newId() {
  const bytes = crypto.getRandomValues(new Uint8Array(16));
  bytes[6] = (bytes[6] & 0x0f) | 0x40;
  bytes[8] = (bytes[8] & 0x3f) | 0x80;
  const hex = Array.from(bytes, (byte) => byte.toString(16).padStart(2, "0")).join("");
  return hex.replace(/^(.{8})(.{4})(.{4})(.{4})/, "$1-$2-$3-$4-");
}

export class Client {
  /**
   * @param {string | URL} url Where the service is, with its base path, where it has one.
   * @param {object} [options]
   * @param {string} [options.key] An API key or a session token, where the service has keys.
   * @param {number} [options.patience] Milliseconds in which a call that fails for a moment is made again (20,000).
   * @param {number} [options.snapshotEvery] Frames after which a session takes a snapshot, to go on after the service has
   *   lost it (30). At 0 it takes none, and such a session has ended.
   * @param {SocketClass} [options.WebSocket] For streams, where the platform has none: Node before 22.
   */
  constructor(url, options = {}) {
    const patience = checkNumber("patience", options.patience ?? 20_000);
    this.transport = new Transport(url, options.key ?? "", patience);
    this.snapshotEvery = Math.min(checkNumber("snapshotEvery", options.snapshotEvery ?? 30), MOST_KEPT / 2);
    /** @type {SocketClass | undefined} */
    this.WebSocket = options.WebSocket ?? globalThis.WebSocket;
  }

  /** The key that is sent with every call. */
  set key(/** @type {string} */ key) {
    this.transport.key = key;
  }

  /**
   * Opens a session. The client makes its id, so that asking twice opens one session.
   * @param {Frame} frame The first frame.
   * @param {import("./session.js").Box} box The target's box in it.
   * @param {OpenOptions} [options]
   * @returns {Promise<Session>}
   */
  async open(frame, box, { preset, seed, parameters, signal } = {}) {
    const json = parameters && JSON.stringify(parameters);
    // The client draws the seed, so that a session that is opened again gives the same boxes.
    const drawn = seed ?? crypto.getRandomValues(new Uint32Array(1))[0];
    const query = { box: boxText(box), preset, seed: drawn, parameters: json };
    return this.create({ query, body: await bytesOf(frameOf(frame)), type: "application/octet-stream", signal });
  }

  /**
   * Opens a session that goes on where a snapshot was taken, here or at another instance with the same secret.
   * @param {Frame} snapshot
   * @param {AbortSignal} [signal]
   * @param {number} [patience] Milliseconds in which a call that fails for a moment is made again; as the client's.
   * @returns {Promise<Session>}
   */
  async restore(snapshot, signal, patience) {
    if (patience !== undefined) checkNumber("patience", patience);
    const session = await this.create({ ...restoring(await snapshotBytes(snapshot)), signal, patience });
    try {
      // The answer that opens a session has no score.
      const response = await this.transport.call("GET", `sessions/${session.id}`, { signal, patience });
      session.take((await documentOf(response, "answer")).answer);
      return session;
    } catch (error) {
      // Nobody else knows the session's id, so nobody else would end it.
      session.end().catch(() => undefined);
      throw error;
    }
  }

  /**
   * A session that is open already, such as one that a page was given a token for. When the service loses it, it has
   * ended: only a session that this client has opened goes on.
   * @param {string} id
   * @returns {Promise<Session>}
   */
  async attach(id) {
    const response = await this.transport.call("GET", `sessions/${encodeURIComponent(id)}`);
    const view = await documentOf(response, "id", "answer");
    return new Session(this, view.id, view.answer, response.headers);
  }

  /** @param {import("./transport.js").Request} request */
  async create(request) {
    const response = await this.transport.call("PUT", `sessions/${newId()}`, request);
    const { id, frame, box } = await documentOf(response, "id", "frame", "box");
    const { query, body, type } = request;
    const origin = this.snapshotEvery > 0 ? { frame, request: { query, body, type } } : undefined;
    // The answer to the first frame is the given box.
    const answer = /** @type {const} */ ({ frame, box, score: 1, status: "tracking" });
    return new Session(this, id, answer, response.headers, origin, true);
  }
}
