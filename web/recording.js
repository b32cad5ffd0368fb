// Makes a video of the tracked frames with the boxes painted in: each frame once, at its time.

import { shownIn } from "./boxes.js";
import { close } from "./frames.js";
import { matroska } from "./matroska.js";
import { encoded } from "./source.js";
import { paintBox } from "./stage.js";

/** The codecs, one of which a trial chooses: in some browsers one is ten times as fast, in others the other one. */
const CODECS = /** @type {const} */ ([
  ["vp8", "V_VP8"],
  ["vp09.00.40.08", "V_VP9"],
]);
/** Frames that the trial encodes with each codec. */
const TRIED = 4;
const BITS_A_PIXEL = 0.1;
/** Frames from one key frame to the next; players can seek to key frames only. */
const KEY_EVERY = 30;
/** Most frames in the encoder's queue. */
const MOST_WAITING = 8;
const QUALITY = 0.9;

/** Whether pages have `VideoEncoder`. Over plain HTTP none has; then the frames stay JPEGs, in a Matroska file. */
export const encodes = typeof VideoEncoder !== "undefined";
export const extension = encodes ? "webm" : "mkv";

/**
 * Draws the frames with the objects' boxes, one after the other.
 * @param {Run} run
 * @param {HTMLCanvasElement} canvas
 * @param {(done: number, of: number) => void} tell
 */
async function* drawn(run, canvas, tell) {
  const context = canvas.getContext("2d");
  const frames = run.frames.shown;
  let begun = 0;
  for (const [index, frame] of frames.entries()) {
    const picture = await run.frames.at(frame);
    if (!picture) continue;
    const { image, time } = picture;
    if (index === 0) begun = time;
    if (index === 0) [canvas.width, canvas.height] = [image.width, image.height].map((side) => side - (side % 2));
    context?.drawImage(image, 0, 0);
    for (const object of shownIn(run, frame, image)) if (context) paintBox(context, object);
    close(picture);
    yield { time: Math.round((time - begun) * 1000), index };
    tell(index + 1, frames.length);
  }
}

/** @type {typeof encodeVideo} */
async function makeJpegs(run, canvas, tell) {
  /** @type {Chunk[]} */
  const chunks = [];
  for await (const { time } of drawn(run, canvas, tell)) {
    const blob = await encoded(canvas, QUALITY);
    chunks.push({ time, isKey: true, bytes: new Uint8Array(await blob.arrayBuffer()) });
  }
  return { codec: "V_MJPEG", chunks };
}

/** An encoder, with the chunks that it has encoded. */
class Encoder {
  /** @param {VideoEncoderConfig} config */
  constructor(config) {
    /** @type {Chunk[]} */
    this.chunks = [];
    /** @type {(error: unknown) => void} */
    let fail = () => undefined;
    this.failed = new Promise((_, reject) => (fail = reject));
    this.failed.catch(() => undefined);
    const output = (/** @type {EncodedVideoChunk} */ chunk) => {
      const bytes = new Uint8Array(chunk.byteLength);
      chunk.copyTo(bytes);
      this.chunks.push({ time: Math.round(chunk.timestamp / 1000), isKey: chunk.type === "key", bytes });
    };
    this.encoder = new VideoEncoder({ output, error: (error) => fail(error) });
    this.encoder.configure(config);
  }

  /**
   * @param {HTMLCanvasElement} canvas
   * @param {number} time In milliseconds.
   * @param {number} index
   */
  async write(canvas, time, index) {
    const frame = new VideoFrame(canvas, { timestamp: time * 1000 });
    this.encoder.encode(frame, { keyFrame: index % KEY_EVERY === 0 });
    frame.close();
    while (this.encoder.encodeQueueSize > MOST_WAITING) {
      const next = new Promise((resolve) => this.encoder.addEventListener("dequeue", resolve, { once: true }));
      await Promise.race([next, this.failed]);
    }
  }

  async finish() {
    await Promise.race([this.encoder.flush(), this.failed]);
    this.encoder.close();
    return this.chunks;
  }
}

/** The codec that finishes a trial first.
 * @param {HTMLCanvasElement} canvas
 * @param {VideoEncoderConfig} config */
async function quickest(canvas, config) {
  /** @type {Encoder[]} */
  const tried = [];
  const tries = CODECS.map(async ([codec, name]) => {
    const { supported } = await VideoEncoder.isConfigSupported({ ...config, codec });
    if (!supported) throw new DOMException("", "NotSupportedError");
    const encoder = new Encoder({ ...config, codec });
    tried.push(encoder);
    for (let index = 0; index < TRIED; index += 1) encoder.write(canvas, index, index);
    await encoder.finish();
    return { codec, name };
  });
  const first = await Promise.any(tries);
  for (const { encoder } of tried) if (encoder.state !== "closed") encoder.close();
  return first;
}

/**
 * @param {Run} run
 * @param {HTMLCanvasElement} canvas
 * @param {(done: number, of: number) => void} tell
 * @returns {Promise<{codec: import("./matroska.js").Track["codec"], chunks: Chunk[]}>}
 */
async function encodeVideo(run, canvas, tell) {
  /** @type {Encoder | undefined} */
  let encoder;
  /** @type {"V_VP8" | "V_VP9"} */
  let codec = "V_VP8";
  for await (const { time, index } of drawn(run, canvas, tell)) {
    if (!encoder) {
      const { width, height } = canvas;
      const framerate = run.source.rate ?? 25;
      const bitrate = Math.round(width * height * framerate * BITS_A_PIXEL);
      const config = { codec: CODECS[0][0], width, height, bitrate, framerate };
      const chosen = await quickest(canvas, config);
      codec = chosen.name;
      encoder = new Encoder({ ...config, codec: chosen.codec });
    }
    await encoder.write(canvas, time, index);
  }
  return { codec, chunks: (await encoder?.finish()) ?? [] };
}

/**
 * @param {Run} run
 * @param {(done: number, of: number) => void} tell
 * @returns {Promise<Blob>}
 */
export async function makeVideo(run, tell) {
  const canvas = document.createElement("canvas");
  const { codec, chunks } = await (encodes ? encodeVideo : makeJpegs)(run, canvas, tell);
  const { width, height } = canvas;
  const lastFrame = 1000 / (run.source.rate ?? 25);
  return matroska({ codec, width, height }, chunks, chunks[chunks.length - 1].time + lastFrame);
}
