// The tracker in this thread: `Tracker.create(image, box)`, `tracker.step(image)`.

import { boxOf, snapshotBytes } from "./given.js";
import { pixelsOf } from "./image.js";
import { load } from "./module.js";
import { Problem } from "./problem.js";
import { trackerOf } from "./snapshot.js";
import { Frame, Parameters, Tracker as Wasm } from "./wasm/bagtrack_wasm.js";

/**
 * @typedef {import("./image.js").Image} Image
 * @typedef {import("./session.js").Box} Box
 * @typedef {import("./session.js").Answer} Answer
 * @typedef {import("./stream.js").StreamAnswer} StreamAnswer
 *
 * @typedef {object} TrackerOptions
 * @property {"robust" | "paper"} [preset]
 * @property {number} [seed] Seed of all random draws; a random one when left out.
 * @property {Record<string, unknown>} [parameters] Parameters that are set otherwise than in the preset.
 */

/** How the tracker's error messages begin, and the kinds that the service gives such problems. */
const KINDS = /** @type {const} */ ([
  ["the box", "invalid-box"],
  ["the snapshot", "invalid-snapshot"],
  ["the frame", "frame-size-mismatch"],
  ["the preset", "invalid-parameter"],
  ["parameter", "invalid-parameter"],
  ["there is no parameter", "invalid-parameter"],
  ["`", "invalid-parameter"],
]);

/** A frame for any number of trackers, which its caller frees.
 * @param {Image} image */
export async function frameFor(image) {
  await load();
  const pixels = await pixelsOf(image);
  return refusing(() => frameOf(pixels));
}

/** Runs `run`, and turns the tracker's errors into problems.
 * @template T
 * @param {() => T} run
 * @returns {T} */
function refusing(run) {
  try {
    return run();
  } catch (error) {
    const isTold = error instanceof Problem || !(error instanceof Error);
    if (isTold || error instanceof WebAssembly.RuntimeError) throw error;
    const { message } = error;
    const kind = KINDS.find(([words]) => message.startsWith(words))?.[1] ?? "frame-damaged";
    const detail = `${message.charAt(0).toUpperCase()}${message.slice(1)}.`;
    throw new Problem({ type: kind, status: 422, detail });
  }
}

/** @param {TrackerOptions} options */
function parametersOf({ preset = "robust", seed, parameters = {} }) {
  const made = new Parameters(preset);
  // The draw has 32 bits; the service takes seeds of up to 53 bits.
  made.set("seed", seed ?? crypto.getRandomValues(new Uint32Array(1))[0]);
  for (const [name, value] of Object.entries(parameters)) made.set(name, typeof value === "number" ? value : NaN);
  if (seed !== undefined) made.set("seed", seed);
  return made;
}

/** @param {import("./image.js").Pixels | import("./image.js").Planes} image */
function frameOf(image) {
  const { width, height } = image;
  // The module would convert any value to a whole number of 32 bits.
  if (![width, height].every((side) => side > 0 && side >>> 0 === side)) {
    const detail = "The width and height of an image are whole numbers from 1 on.";
    throw new Problem({ type: "frame-damaged", status: 422, detail });
  }
  if ("luma" in image) return Frame.fromPlanes(width, height, image.luma, image.cb, image.cr);
  const { data } = image;
  return Frame.fromRgba(width, height, new Uint8Array(data.buffer, data.byteOffset, data.byteLength));
}

/** @param {Box} box */
const numbers = (box) => new Float64Array(Object.values(boxOf(box)));

/** Rounded as the service does: to a hundredth of a pixel, and a thousandth of the score.
 * @param {import("./wasm/bagtrack_wasm.js").Estimate} estimate
 * @returns {Answer} */
function answerOf(estimate) {
  const { frame, status } = estimate;
  const round = (/** @type {number} */ value, /** @type {number} */ parts) => Math.round(value * parts) / parts;
  const [x, y, width, height] = [estimate.x, estimate.y, estimate.width, estimate.height].map((side) => round(side, 100));
  const score = round(estimate.score, 1000);
  estimate.free();
  return { frame, box: { x, y, width, height }, score, status: /** @type {Answer["status"]} */ (status) };
}

/** Runs `run` with a frame, which is made from the image unless that is one already.
 * @template T
 * @param {Image | Frame} image
 * @param {(frame: Frame) => T} run
 * @param {Promise<unknown>} [before] What must have ended: of two files the first may be decoded last. */
async function withFrame(image, run, before) {
  const isGiven = image instanceof Frame;
  const making = isGiven ? Promise.resolve(image) : frameFor(image);
  const [made] = await Promise.allSettled([making, before]);
  if (made.status === "rejected") throw made.reason;
  try {
    return refusing(() => run(made.value));
  } finally {
    if (!isGiven) made.value.free();
  }
}

/**
 * @param {Float32Array} values
 * @param {number} columns
 * @param {number} rows
 */
function vectorsOf(values, columns, rows) {
  const cells = columns * rows;
  return Array.from({ length: values.length / cells }, (_, at) => values.slice(at * cells, (at + 1) * cells));
}

/** Follows one object. A call that fails leaves it as it was. */
export class Tracker {
  /** @param {Wasm} wasm */
  constructor(wasm) {
    /** @type {Wasm | undefined} */
    this.own = wasm;
    /** The last answer. */
    this.answer = answerOf(wasm.estimate);
    /** @type {Promise<unknown>} The calls before. */
    this.before = Promise.resolve();
  }

  /**
   * Starts on the first frame, with the target's box in it.
   * @param {Image | Frame} image
   * @param {Box} box
   * @param {TrackerOptions} [options]
   */
  static create(image, box, options = {}) {
    return withFrame(image, (frame) => new Tracker(new Wasm(frame, numbers(box), parametersOf(options))));
  }

  get wasm() {
    if (this.own) return this.own;
    throw new Problem({ type: "session-not-found", status: 404, detail: "The tracker is freed." });
  }

  /** Runs with the next frame, after the calls before it.
   * @template T
   * @param {Image | Frame} image
   * @param {(frame: Frame) => T} run */
  next(image, run) {
    const made = withFrame(image, run, this.before);
    this.before = made.catch(() => undefined);
    return made;
  }

  /** A tracker that goes on from a snapshot: of `save`, or of the service.
   * @param {import("./client.js").Frame} snapshot */
  static async load(snapshot) {
    await load();
    const bytes = await trackerOf(await snapshotBytes(snapshot));
    return refusing(() => new Tracker(Wasm.load(bytes)));
  }

  /** The whole state as bytes: for `load`, and for a service that takes unsigned snapshots. */
  save() {
    return /** @type {Uint8Array<ArrayBuffer>} */ (this.wasm.save());
  }

  /**
   * Finds the target in the next frame. Frames are taken in the order of the calls.
   * @param {Image | Frame} image
   * @param {object} [options]
   * @param {boolean} [options.see] Whether the answer shall tell what the tracker saw.
   * @returns {Promise<StreamAnswer>}
   */
  step(image, { see = false } = {}) {
    return this.next(image, (frame) => {
      if (!see) return (this.answer = answerOf(this.wasm.step(frame)));
      const seen = this.wasm.see(frame);
      const { particles: flat, votes } = seen;
      this.answer = answerOf(seen.estimate);
      seen.free();
      const particles = Array.from({ length: flat.length / 4 }, (_, at) => [...flat.subarray(4 * at, 4 * at + 4)]);
      return { ...this.answer, particles, votes: [...votes] };
    });
  }

  /** Takes the next frame with the right box in it.
   * @param {Image | Frame} image
   * @param {Box} box */
  correct(image, box) {
    return this.next(image, (frame) => (this.answer = answerOf(this.wasm.correct(frame, numbers(box)))));
  }

  /** The number of the last frame; that of the first is 0. */
  get frame() {
    return this.answer.frame;
  }

  get box() {
    return this.answer.box;
  }

  get score() {
    return this.answer.score;
  }

  get status() {
    return this.answer.status;
  }

  /** Of the frames, in pixels. */
  get size() {
    const [width, height] = this.wasm.size;
    return { width, height };
  }

  get parameters() {
    const { parameters } = this.wasm;
    const pairs = Parameters.names().map((name) => [name, parameters.get(name)]);
    parameters.free();
    return /** @type {Record<string, number>} */ (Object.fromEntries(pairs));
  }

  /** What it keeps of the target: for each affine subspace, oldest first, its mean, then the columns of its basis, each as
   * gray values row by row. */
  get bag() {
    return this.wasm.bag.map((entry) => {
      const { columns, values } = entry;
      entry.free();
      return { columns, vectors: vectorsOf(values, columns, this.parameters.patch_height) };
    });
  }

  /** Gives up its memory. */
  free() {
    this.own?.free();
    this.own = undefined;
  }
}
