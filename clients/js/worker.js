// The worker: has the trackers by the ids of their sessions, and does the calls one after the other.

import { pictureOf } from "./bag.js";
import { ofNode } from "./platform.js";
import { Problem } from "./problem.js";
import { Tracker, frameFor } from "./tracker.js";
import { close } from "./transfer.js";

/**
 * @typedef {import("./image.js").Image} Image
 * @typedef {import("./session.js").Box} Box
 *
 * @typedef {object} Calls
 * @property {{id: number, image: Image, box: Box, options?: import("./tracker.js").TrackerOptions}} open
 * @property {{id: number, snapshot: Uint8Array<ArrayBuffer>}} restore
 * @property {{image: Image, ids: number[], see?: boolean}} step
 * @property {{image: Image, id: number, box: Box}} correct
 * @property {{id: number}} save
 * @property {{id: number}} read
 * @property {{id: number}} bag
 * @property {{id: number}} end
 */

/** @type {Map<number, Tracker>} */
const trackers = new Map();

/**
 * @param {number} id
 * @param {Tracker} tracker
 */
function added(id, tracker) {
  trackers.set(id, tracker);
  return tracker.answer;
}

/** @param {number} id */
function find(id) {
  const tracker = trackers.get(id);
  if (!tracker) throw new Problem({ type: "session-not-found", status: 404, detail: "The session has ended." });
  return tracker;
}

/** @type {{[Name in keyof Calls]: (call: Calls[Name]) => unknown}} */
const calls = {
  open: async ({ id, image, box, options }) => added(id, await Tracker.create(image, box, options)),
  restore: async ({ id, snapshot }) => added(id, await Tracker.load(snapshot)),
  async step({ image, ids, see }) {
    const all = ids.map(find);
    const frame = await frameFor(image);
    try {
      const answers = [];
      for (const tracker of all) answers.push(await tracker.step(frame, { see }));
      return answers;
    } finally {
      frame.free();
    }
  },
  correct: ({ id, image, box }) => find(id).correct(image, box),
  save: ({ id }) => find(id).save(),
  read({ id }) {
    const { answer, size, parameters } = find(id);
    return { frames: answer.frame + 1, answer, image: size, parameters };
  },
  bag: ({ id }) => pictureOf(find(id).bag),
  end({ id }) {
    trackers.get(id)?.free();
    trackers.delete(id);
  },
};

/** @param {any} message */
async function answered({ number, name, call }) {
  try {
    return { number, value: await calls[/** @type {keyof Calls} */ (name)](call) };
  } catch (error) {
    const { message, slug, status } = /** @type {Problem} */ (error);
    // After a trap the WebAssembly module cannot be used again.
    const isBroken = error instanceof WebAssembly.RuntimeError;
    return { number, problem: { type: slug ?? "internal", status: status ?? 500, detail: message }, isBroken };
  } finally {
    if (call.image) close(call.image);
  }
}

/** @type {Promise<void>} */
let before = Promise.resolve();

/** @param {any} port */
function serve(port) {
  port.addEventListener("message", (/** @type {MessageEvent} */ { data }) => {
    before = before.then(async () => port.postMessage(await answered(data)));
  });
  port.start?.();
  // Some browsers lose messages that come before a worker listens, so it tells when it does.
  port.postMessage({ isReady: true });
}

// Workers of browsers have a global `postMessage`, those of Node.js do not. No top-level `await`: bundlers make workers
// that do not allow it.
if ("postMessage" in globalThis) serve(globalThis);
else ofNode("worker_threads").then(({ parentPort }) => serve(parentPort));
