// The tracker in this process: the boxes must be those of the service, and sessions go from one to the other.

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdtempSync, readFileSync, readdirSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { Client, LocalClient, Problem } from "../bagtrack.js";
import { Tracker } from "../tracker.js";
import { decodePng } from "./png.js";
import { PROGRAM, SEED, startService } from "./service.js";

const FRAMES = 100;
/** The most pixels by which a side of a local box may differ from the service's. */
const NEAR = 0.05;

/** A losslessly encoded clip: its files, their pixels, and the first box.
 * @param {string} scene */
function exactClip(scene) {
  const folder = mkdtempSync(join(tmpdir(), "bagtrack-clip-"));
  try {
    const flags = ["--out", folder, "--frames", String(FRAMES), "--scene", scene, "--format", "png"];
    execFileSync(PROGRAM, ["sample", ...flags]);
    const names = readdirSync(join(folder, "img")).sort();
    const files = names.map((name) => new Uint8Array(readFileSync(join(folder, "img", name))));
    const [first] = readFileSync(join(folder, "groundtruth_rect.txt"), "utf8").split("\n");
    const [x, y, width, height] = first.split(",").map(Number);
    return { files, images: files.map(decodePng), box: { x: x - 1, y: y - 1, width, height } };
  } finally {
    rmSync(folder, { recursive: true });
  }
}

const clips = { default: exactClip("default"), leaves: exactClip("leaves") };
const clip = clips.default;
/** @type {Awaited<ReturnType<typeof startService>>} */
let service;
const local = new LocalClient();
before(async () => (service = await startService(["--unsigned-snapshots"])));
after(async () => {
  await service.stop();
  await local.close();
});

/** The greatest difference between two boxes, in pixels. */
function apart(/** @type {any} */ one, /** @type {any} */ other) {
  assert.equal(one.frame, other.frame);
  return Math.max(...Object.keys(one.box).map((side) => Math.abs(one.box[side] - other.box[side])));
}

/** @param {any[]} answers
 * @param {any[]} others */
function same(answers, others) {
  assert.equal(answers.length, others.length);
  const most = Math.max(...answers.map((answer, at) => apart(answer, others[at])));
  assert.ok(most <= NEAR, `${most} pixels`);
  assert.deepEqual(answers.map(({ status }) => status), others.map(({ status }) => status));
  return most;
}

const slug = (/** @type {string} */ wanted) => (/** @type {unknown} */ error) =>
  error instanceof Problem && error.slug === wanted;

for (const [scene, preset] of /** @type {const} */ ([["default", "robust"], ["leaves", "robust"], ["default", "paper"]])) {
  test(`the boxes are those of the service: ${scene}, ${preset}`, async (context) => {
    const { files, images, box } = clips[scene];
    const served = await new Client(service.url).open(files[0], box, { seed: SEED, preset });
    const own = await local.open(images[0], box, { seed: SEED, preset });
    const theirs = [];
    for (let at = 1; at < FRAMES; at += 50) theirs.push(...(await served.trackAll(files.slice(at, at + 50))));
    const ours = await own.trackAll(images.slice(1));
    context.diagnostic(`at most ${same(ours, theirs)} pixels apart in ${ours.length} frames`);
    assert.deepEqual((await own.read()).parameters, (await served.read()).parameters);
    await Promise.all([own.end(), served.end()]);
  });
}

test("a session goes from here to the service, and back", async () => {
  const { files, images, box } = clip;
  const client = new Client(service.url);
  const own = await local.open(images[0], box, { seed: SEED });
  const all = await own.trackAll(images.slice(1, 40));
  const served = await client.restore(await own.snapshot());
  assert.deepEqual([served.frame, served.box], [39, own.box]);
  all.push(...(await served.trackAll(files.slice(40, 70))));
  const back = await local.restore(await served.snapshot());
  assert.deepEqual([back.frame, back.box], [served.frame, served.box]);
  all.push(...(await back.trackAll(images.slice(70))));
  const plain = await (await local.open(images[0], box, { seed: SEED })).trackAll(images.slice(1));
  same(all, plain);
});

test("a service that signs its snapshots takes none from here", async () => {
  const strict = await startService();
  try {
    const own = await local.open(clip.images[0], clip.box);
    await assert.rejects(new Client(strict.url).restore(await own.snapshot()), slug("invalid-snapshot"));
  } finally {
    await strict.stop();
  }
});

test("a snapshot goes on bit for bit; a damaged one is refused", async () => {
  const { images, box } = clip;
  const tracker = await Tracker.create(images[0], box, { seed: SEED });
  for (const image of images.slice(1, 20)) await tracker.step(image);
  const saved = tracker.save();
  const other = await Tracker.load(saved);
  for (const image of images.slice(20, 60)) assert.deepEqual(await other.step(image), await tracker.step(image));
  for (const at of [3, 9, saved.length - 1]) {
    const damaged = saved.slice();
    damaged[at] ^= 1;
    await assert.rejects(Tracker.load(damaged), slug("invalid-snapshot"));
  }
  const served = await new Client(service.url).open(clip.files[0], box);
  const snapshot = await served.snapshot();
  for (let length = 0; length < snapshot.length; length += 997) {
    await assert.rejects(Tracker.load(snapshot.slice(0, length)), slug("invalid-snapshot"));
  }
});

test("what cannot be used is refused, and changes nothing", async () => {
  const { images, box } = clip;
  const session = await local.open(images[0], box, { seed: SEED });
  const small = { width: 4, height: 4, data: new Uint8Array(64) };
  await assert.rejects(session.track(small), slug("frame-size-mismatch"));
  await assert.rejects(session.track({ ...images[1], data: images[1].data.subarray(4) }), slug("frame-damaged"));
  await assert.rejects(session.correct(images[1], { ...box, width: 1 }), slug("invalid-box"));
  await assert.rejects(local.open(images[0], { ...box, x: NaN }), slug("invalid-box"));
  // Boxes given by mistake as two corners, and as shares of the frame's sides.
  await assert.rejects(local.open(images[0], { x: 300, y: 200, width: 318, height: 238 }), /box=300,200,18,38/);
  await assert.rejects(session.correct(images[1], { x: 0.5, y: 0.5, width: 0.2, height: 0.2 }), /box=160,120,64,48/);
  await assert.rejects(local.open(images[0], box, { parameters: { particles: 1e6 } }), slug("invalid-parameter"));
  await assert.rejects(local.open(images[0], box, { parameters: { nothing: 1 } }), slug("invalid-parameter"));
  const plain = await local.open(images[0], box, { seed: SEED });
  assert.deepEqual(await session.track(images[1]), await plain.track(images[1]));
  await session.end();
  await assert.rejects(session.track(images[2]), slug("session-not-found"));
});

test("many sessions share the frames of one client; a correction moves one of them", async (context) => {
  const { images, box } = clip;
  const alone = await (await local.open(images[0], box, { seed: 3 })).trackAll(images.slice(1, 30));
  const sessions = await Promise.all([1, 2, 3, 4].map((seed) => local.open(images[0], box, { seed })));
  const together = [];
  const started = performance.now();
  for (const image of images.slice(1, 30)) together.push(await local.track(sessions, image, { see: true }));
  context.diagnostic(`four targets: ${((performance.now() - started) / together.length).toFixed(1)} ms a frame`);
  const plain = together.map((answers) => answers[2]).map(({ particles, votes, ...answer }) => {
    assert.ok(particles && particles.length > 0 && votes && votes.length > 0);
    return answer;
  });
  assert.deepEqual(plain, alone);
  const moved = { x: 20, y: 30, width: 40, height: 50 };
  assert.deepEqual((await sessions[0].correct(images[30], moved)).box, moved);
  assert.equal(sessions[1].frame, 29);
});

test("planes are what JPEG has: gray without chroma", async () => {
  const [width, height] = [160, 120];
  const luma = Uint8Array.from({ length: width * height }, (_, at) => (at * 37 + (at >> 5) * 11) % 256);
  const tracker = await Tracker.create({ width, height, luma }, { x: 40, y: 30, width: 30, height: 30 });
  const { box } = await tracker.step({ width, height, luma });
  assert.ok(Math.abs(box.x - 40) < 2 && Math.abs(box.y - 30) < 2, JSON.stringify(box));
  assert.deepEqual(tracker.size, { width, height });
});
