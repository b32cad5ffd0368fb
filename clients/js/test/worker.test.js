// Sessions and their worker: what has ended or fails takes nothing else along.

import assert from "node:assert/strict";
import { cpSync, mkdtempSync, readFileSync, readdirSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { test } from "node:test";
import { fileURLToPath, pathToFileURL } from "node:url";
import { Client, LocalClient, Problem } from "../bagtrack.js";
import { Tracker } from "../tracker.js";

const [width, height] = [160, 120];
const luma = Uint8Array.from({ length: width * height }, (_, at) => (at * 37 + (at >> 5) * 11) % 256);
const image = { width, height, luma };
const box = { x: 40, y: 30, width: 30, height: 30 };
const options = { seed: 7 };

const slug = (/** @type {string} */ wanted) => (/** @type {unknown} */ error) =>
  error instanceof Problem && error.slug === wanted;

test("a session of another client, or of before `close`, moves none of those that are open", async () => {
  const [client, stranger] = [new LocalClient(), new LocalClient()];
  const old = await client.open(image, box, options);
  const foreign = await stranger.open(image, box, options);
  await client.close();
  const session = await client.open(image, { ...box, x: 80 }, options);
  await assert.rejects(old.track(image), slug("session-not-found"));
  await assert.rejects(old.correct(image, box), slug("session-not-found"));
  await assert.rejects(client.track([foreign], image), slug("session-not-found"));
  await old.end();
  const { answer } = await session.read();
  assert.deepEqual([answer.frame, old.frame, foreign.frame], [0, 0, 0]);
  const restored = await client.restore(await session.snapshot());
  assert.deepEqual([(await session.track(image)).frame, (await restored.track(image)).frame], [1, 1]);
  await Promise.all([client.close(), stranger.close()]);
});

test("what is no image here is refused, and ends no session", async () => {
  const client = new LocalClient();
  const [session, other] = await Promise.all([client.open(image, box, options), client.open(image, box, options)]);
  const wrong = /** @type {any[]} */ (["clip/0001.jpg", 5, true, null, undefined, () => image, new Blob(["of browsers"])]);
  for (const frame of wrong) {
    await assert.rejects(session.track(frame), slug("unsupported-image"), String(frame));
    await assert.rejects(session.correct(frame, box), slug("unsupported-image"), String(frame));
    await assert.rejects(client.open(frame, box), slug("unsupported-image"), String(frame));
    await assert.rejects(Tracker.create(frame, box), slug("unsupported-image"), String(frame));
  }
  assert.equal((await session.track(/** @type {any} */ ({ ...image, close: 5 }))).frame, 1);
  assert.deepEqual([(await session.track(image)).frame, (await other.track(image)).frame], [2, 1]);
  await client.close();
});

test("a call that cannot be sent fails alone", async () => {
  const client = new LocalClient();
  const session = await client.open(image, box, options);
  // For a canvas the client makes a bitmap, which fails in Node.js as it does in a browser for a canvas without pixels.
  const canvas = { width, height, [Symbol.toStringTag]: "HTMLCanvasElement" };
  const gone = luma.slice();
  structuredClone(gone, { transfer: [gone.buffer] });
  const wrong = /** @type {any[]} */ ([canvas, { ...image, luma: gone }]);
  const order = [image, wrong[0], image, wrong[1], wrong[0], image];
  const settled = await Promise.allSettled(order.map((each) => session.track(each)));
  assert.deepEqual(settled.map((each) => (each.status === "fulfilled" ? each.value.frame : each.reason.name)), [
    1,
    "ReferenceError",
    2,
    "DataCloneError",
    "ReferenceError",
    3,
  ]);
  assert.equal(client.waiting.size, 0, "or the process does not end");
  await client.close();
});

test("what is no image yet is told what to do with it", async () => {
  const client = new LocalClient();
  const session = await client.open(image, box, options);
  const bytes = Buffer.from("a file");
  const video = { videoWidth: 0, videoHeight: 0, readyState: 0, [Symbol.toStringTag]: "HTMLVideoElement" };
  const cases = /** @type {[any, RegExp][]} */ ([
    [bytes, /decode them/],
    [new Uint8Array(bytes).buffer, /decode them/],
    [Promise.resolve(image), /await it/],
    [{}, /An image is/],
    [{ width, height, data: [1, 2, 3] }, /^Pixels are bytes/],
    [{ width, height, data: new Float32Array(4 * luma.length) }, /^Pixels are bytes/],
    [{ width, height, data: luma.buffer }, /^Pixels are bytes/],
    [{ width, height, luma: null }, /^Pixels are bytes/],
    [{ ...image, cb: [1], cr: [1] }, /^Pixels are bytes/],
    [video, /no pixels/],
    // The video's size is known, but no picture is loaded yet, so nothing would be drawn.
    [{ ...video, videoWidth: width, videoHeight: height, readyState: 1 }, /no pixels/],
    [{ width: 0, height: 0, [Symbol.toStringTag]: "ImageBitmap" }, /no pixels/],
    [{ naturalWidth: 0, naturalHeight: 0, width, height, [Symbol.toStringTag]: "HTMLImageElement" }, /no pixels/],
  ]);
  for (const [given, words] of cases) {
    const told = (/** @type {any} */ error) => slug("unsupported-image")(error) && words.test(error.message);
    await assert.rejects(session.track(given), told, String(words));
    await assert.rejects(Tracker.create(given, box), told, String(words));
  }
  assert.equal((await session.track({ ...image, cb: undefined, cr: undefined })).frame, 1);
  await client.close();
});

test("an image may tell its sides and pixels by accessors, as `ImageData` does", async () => {
  const large = new Uint8ClampedArray(4 * luma.length + 100).fill(255);
  luma.forEach((gray, at) => large.fill(gray, 4 * at + 64, 4 * at + 67));
  class Data {
    constructor(/** @type {Uint8ClampedArray} */ pixels) {
      this.draw = () => pixels;
    }
    get width() {
      return width;
    }
    get height() {
      return height;
    }
    get data() {
      return this.draw();
    }
  }
  const part = large.subarray(64, 64 + 4 * luma.length);
  const client = new LocalClient();
  const session = await client.open(new Data(part), box, options);
  const gray = await client.open(image, box, options);
  const box1 = (await session.track(new Data(part.slice()))).box;
  assert.deepEqual(box1, (await gray.track(image)).box);
  await client.close();
});

test("of an array that is a part of a larger buffer only that part is sent", async () => {
  const large = new ArrayBuffer(8_000_000);
  const part = new Uint8Array(large, 1_000_000, luma.length);
  part.set(luma);
  const chroma = new Uint8Array(large, 2_000_000, luma.length / 4).fill(128);
  const data = new Uint8ClampedArray(large, 3_000_000, 4 * luma.length).fill(255);
  luma.forEach((gray, at) => data.fill(gray, 4 * at, 4 * at + 3));
  const client = new LocalClient();
  await client.warm();
  const worker = await client.worker;
  const { postMessage } = worker;
  /** @type {number[]} */
  const sizes = [];
  worker.postMessage = (/** @type {any} */ message, /** @type {Transferable[]} */ handed) => {
    const arrays = Object.values(message.call.image).filter(ArrayBuffer.isView);
    sizes.push(arrays.reduce((sum, { buffer }) => sum + buffer.byteLength, 0));
    postMessage.call(worker, message, handed);
  };
  const given = [image, { width, height, luma: part }, { width, height, data }, { ...image, cb: chroma, cr: chroma }];
  const boxes = [];
  for (const each of given) {
    const session = await client.open(each, box, options);
    boxes.push((await session.track(each)).box);
  }
  const bytes = [luma.length, luma.length, data.length, 1.5 * luma.length];
  assert.deepEqual(sizes, bytes.flatMap((size) => [size, size]));
  assert.deepEqual(boxes[1], boxes[0]);
  assert.deepEqual(part, luma, "the caller's array is its own");
  await client.close();
});

test("calls fail whose worker is ended by somebody else, and the next session has another worker", async () => {
  const client = new LocalClient();
  const session = await client.open(image, box, options);
  const worker = await client.worker;
  // The last call is not sent yet when the worker ends.
  const calls = [session.track(image), session.read(), client.open(image, box), session.snapshot()];
  const settled = Promise.allSettled(calls);
  await worker.terminate();
  for (const call of await settled) {
    assert.equal(call.status, "rejected");
    assert.ok(slug("internal")(call.reason) && /worker .* has ended/.test(call.reason.message), `${call.reason}`);
  }
  assert.equal(client.waiting.size, 0);
  await assert.rejects(session.track(image), slug("session-not-found"));
  const next = await client.open(image, box, options);
  assert.equal((await next.track(image)).frame, 1);
  await client.close();
});

test("the end of a worker takes no session of the next one along", async () => {
  const client = new LocalClient();
  await client.open(image, box, options);
  const old = await client.worker;
  const closing = client.close();
  const opening = client.open(image, box, options);
  await new Promise((resolve) => old.on("exit", resolve));
  await closing;
  assert.equal((await (await opening).track(image)).frame, 1);
  await client.close();
});

test("a call before `close` starts no worker after it", async () => {
  const client = new LocalClient();
  const call = client.open(image, box, options);
  await client.close();
  await assert.rejects(call, slug("session-not-found"));
  assert.equal(client.worker, undefined);
});

test("a session of before `close` is ended without another worker", async () => {
  const client = new LocalClient();
  const [session, other] = [await client.open(image, box, options), await client.open(image, box, options)];
  const closing = client.close();
  const ending = other.end();
  await Promise.all([closing, ending, session.end()]);
  await session.end();
  for (const call of [() => session.track(image), () => session.snapshot(), () => session.read()])
    await assert.rejects(call(), slug("session-not-found"));
  assert.equal(client.worker, undefined, "a worker that nobody ends");
  assert.deepEqual(await client.track([], image), []);
  await client.close();
});

test("a call that is aborted before it is sent has no effect", async () => {
  const client = new LocalClient();
  const session = await client.open(image, box, options);
  const abort = new AbortController();
  const before = session.track(image);
  const aborted = [session.track(image, abort.signal), client.open(image, box, { signal: abort.signal })];
  const after = session.track(image);
  abort.abort(new Error("no more"));
  for (const call of aborted) await assert.rejects(call, /no more/);
  assert.deepEqual([(await before).frame, (await after).frame], [1, 2]);
  assert.equal(client.waiting.size, 0);
  await client.close();
});

test("a snapshot may be a file or a buffer, as it comes from a store; what is none is told as that", async () => {
  const client = new LocalClient();
  const session = await client.open(image, box, options);
  await session.track(image);
  const bytes = await session.snapshot();
  for (const snapshot of [bytes, bytes.buffer, new Blob([bytes]), Buffer.from(bytes)]) {
    assert.deepEqual((await client.restore(snapshot)).box, session.box);
    const tracker = await Tracker.load(snapshot);
    assert.deepEqual(tracker.box, session.box);
    tracker.free();
  }
  const told = (/** @type {any} */ error) => slug("invalid-snapshot")(error) && /^A snapshot is/.test(error.message);
  for (const none of /** @type {any[]} */ ([undefined, null, "bytes", { bytes }, Promise.resolve(bytes)])) {
    await assert.rejects(client.restore(none), told);
    await assert.rejects(Tracker.load(none), told);
    await assert.rejects(new Client("http://localhost:1").restore(none), told);
  }
  await client.close();
});

test("a module or a worker that cannot be loaded is told by name", async (context) => {
  const folder = mkdtempSync(join(tmpdir(), "bagtrack-parts-"));
  context.after(() => rmSync(folder, { recursive: true }));
  const [source, module] = [new URL("../", import.meta.url), "bagtrack_wasm_bg.wasm"];
  const filter = (/** @type {string} */ path) => !path.endsWith(module);
  cpSync(fileURLToPath(source), folder, { recursive: true, filter });
  const parts = await import(pathToFileURL(join(folder, "tracker.js")).href);
  const { LocalClient: Lacking } = await import(pathToFileURL(join(folder, "bagtrack.js")).href);
  const client = new Lacking();
  const told = (/** @type {any} */ { slug: kind, message }) => {
    assert.equal(kind, "internal");
    return message.includes("cannot be loaded from file:") && message.includes(module);
  };
  await assert.rejects(parts.Tracker.create(image, box), told);
  await assert.rejects(client.open(image, box), told);
  await client.close();
  // Stands in for a browser, whose error event has no message.
  const browser = /** @type {any} */ (globalThis);
  browser.Worker = class extends EventTarget {
    constructor() {
      super();
      setTimeout(() => this.dispatchEvent(new Event("error")));
    }
  };
  context.after(() => delete browser.Worker);
  await assert.rejects(new LocalClient().open(image, box), /worker .* cannot be loaded.* missing .* content security policy/);
});

test("bundlers find the worker, and can put its modules into one script", () => {
  const folder = new URL("../", import.meta.url);
  const text = (/** @type {string} */ name) => readFileSync(new URL(name, folder), "utf8");
  assert.ok(text("local.js").includes('new Worker(new URL("./worker.js", import.meta.url), { type: "module" })'));
  for (const name of readdirSync(folder).filter((file) => file.endsWith(".js"))) {
    // The modules without their imports and exports must be a script, which has no top-level `await`.
    const script = text(name).replace(/^import .*$/gm, "").replace(/^export (?!\{)/gm, "").replace(/^export .*$/gm, "");
    assert.doesNotThrow(() => new Function(script.replaceAll("import.meta.url", '""')), name);
    assert.doesNotMatch(script, /["']node:/, `${name}: a bundler would look for it`);
  }
});

test("a box that is none, a side that is none, and a tracker that was freed are told as that", async () => {
  const client = new LocalClient();
  const session = await client.open(image, box, options);
  for (const none of /** @type {any[]} */ ([undefined, null, 5, [1, 2, 30, 40], { x: 1, y: 1 }, { ...box, x: "1" }])) {
    await assert.rejects(client.open(image, none), slug("invalid-box"), JSON.stringify(none));
    await assert.rejects(session.correct(image, none), slug("invalid-box"), JSON.stringify(none));
  }
  for (const side of /** @type {any[]} */ ([-1, 0, 160.5, NaN, undefined, "160", 2 ** 32 + 160])) {
    const sized = { ...image, width: side };
    await assert.rejects(session.track(sized), (error) => slug("frame-damaged")(error) && /whole numbers/.test(`${error}`));
  }
  assert.equal((await session.track(image)).frame, 1);
  await client.close();
  const tracker = await Tracker.create(image, box, options);
  tracker.free();
  tracker.free();
  await assert.rejects(tracker.step(image), slug("session-not-found"));
  assert.throws(() => tracker.save(), slug("session-not-found"));
  assert.throws(() => tracker.size, slug("session-not-found"));
  assert.deepEqual(tracker.box, box);
});

test("a tracker takes frames in the order of the calls, also where the first is read last", async (context) => {
  const bitmap = /** @type {any} */ (globalThis);
  // Stands in for a browser that decodes the first file last.
  let first = true;
  bitmap.OffscreenCanvas = class {
    getContext() {
      return {
        drawImage: (/** @type {any} */ { gray }) => (this.gray = gray),
        getImageData: () => ({ width, height, data: new Uint8ClampedArray(4 * luma.length).fill(this.gray) }),
      };
    }
  };
  bitmap.createImageBitmap = async (/** @type {Blob} */ blob) => {
    if (first) await new Promise((resolve) => setTimeout(resolve, 50));
    first = false;
    return { width, height, gray: Number(await blob.text()), close: () => undefined };
  };
  context.after(() => {
    delete bitmap.OffscreenCanvas;
    delete bitmap.createImageBitmap;
  });
  const [tracker, other] = [await Tracker.create(image, box, options), await Tracker.create(image, box, options)];
  const late = tracker.step(new Blob(["200"]));
  const refused = assert.rejects(tracker.step(/** @type {any} */ ("no image")), slug("unsupported-image"));
  const next = tracker.step(image);
  assert.deepEqual([(await late).frame, (await next).frame], [1, 2]);
  await refused;
  const data = new Uint8ClampedArray(4 * luma.length).fill(200);
  await other.step({ width, height, data });
  assert.deepEqual((await other.step(image)).box, (await next).box);
  tracker.free();
  other.free();
});

test("a stream here takes no frame after `close`", async () => {
  const client = new LocalClient();
  const session = await client.open(image, box, options);
  const stream = session.stream();
  const first = stream.track(image);
  stream.close();
  await assert.rejects(stream.track(image), /has ended/);
  await assert.rejects(stream.track(image, { box }), /has ended/);
  assert.deepEqual([(await first)?.frame, await stream.ended, (await session.track(image)).frame], [1, undefined, 2]);
  await client.close();
});
