// The service loses a session: it is killed and started again, or the session expires. The boxes are the library's.

import assert from "node:assert/strict";
import { test } from "node:test";
import { Client, Problem } from "../bagtrack.js";
import { SEED, openLine, rounded, sampleClip, startService } from "./service.js";

const clip = sampleClip();
const SECRET = { BAGTRACK_SNAPSHOT_KEYS: "a secret of this test" };

/** @param {any[]} answers
 * @param {number} [first] */
function sameAsTheLibrary(answers, first = 1) {
  const plain = answers.map(rounded);
  assert.deepEqual(plain, clip.answers.slice(first, first + answers.length));
}

/** A service that can be killed and started again, at one address.
 * @param {Record<string, string>} environment
 * @param {string[]} [flags] */
async function startMortal(environment, flags = []) {
  let service = await startService(flags, environment);
  const line = await openLine(service.port);
  return {
    url: line.url,
    async restart() {
      await service.stop();
      service = await startService(flags, environment);
      line.lead(service.port);
      line.cut();
    },
    /** How many sessions it has. */
    async sessions() {
      const text = await (await fetch(`${service.url}/metrics`)).text();
      return Number(/^bagtrack_sessions (\d+)/m.exec(text)?.[1]);
    },
    async stop() {
      line.close();
      await service.stop();
    },
  };
}

/** @param {string} url
 * @param {number} [snapshotEvery] */
const open = (url, snapshotEvery = 10) =>
  new Client(url, { snapshotEvery }).open(clip.frames[0], clip.box, { seed: SEED });

test("posts go on from the last snapshot after the service was killed, and killed again", async () => {
  const service = await startMortal(SECRET);
  try {
    const session = await open(service.url);
    const { id } = session;
    const answers = [];
    for (const [index, frame] of clip.frames.slice(1, 41).entries()) {
      // The service loses the session before the first snapshot, some time after one, and right after one.
      if ([5, 27, 30].includes(index)) await service.restart();
      answers.push(await session.track(frame));
      assert.ok(session.kept.frames.length <= 10, `${session.kept.frames.length} frames are kept`);
    }
    sameAsTheLibrary(answers);
    assert.notEqual(session.id, id);
    await service.restart();
    const restored = await new Client(service.url).restore(await session.snapshot());
    sameAsTheLibrary([await restored.track(clip.frames[41])], 41);
  } finally {
    await service.stop();
  }
});

test("batches and corrections are sent again as they were", async () => {
  const service = await startMortal(SECRET);
  try {
    const box = { x: 60, y: 70, width: 46, height: 57 };
    const run = async (/** @type {boolean} */ isKilled) => {
      const session = await open(service.url, 20);
      const answers = [...(await session.trackAll(clip.frames.slice(1, 6))), await session.correct(clip.frames[6], box)];
      if (isKilled) await service.restart();
      answers.push(...(await session.trackAll(clip.frames.slice(7, 12))), await session.track(clip.frames[12]));
      return answers.map(rounded);
    };
    assert.deepEqual(await run(true), await run(false));
  } finally {
    await service.stop();
  }
});

test("a stream goes on from the last snapshot with frames on their way", async () => {
  const service = await startMortal(SECRET);
  try {
    const session = await open(service.url);
    const lines = /** @type {boolean[]} */ ([]);
    const stream = session.stream({ onLine: (isUp) => lines.push(isUp) });
    let count = 0;
    const restarts = /** @type {Promise<void>[]} */ ([]);
    const answers = await Promise.all(
      clip.frames.slice(1).map(async (frame) => {
        const answer = await stream.track(frame);
        count += 1;
        if (count === 4 || count === 57) restarts.push(service.restart());
        return answer;
      }),
    );
    sameAsTheLibrary(answers);
    assert.equal(restarts.length, 2);
    assert.ok(lines.filter((isUp) => !isUp).length >= 2, String(lines));
    assert.ok(session.kept.frames.length < 40, `${session.kept.frames.length} frames are kept`);
    stream.close();
    sameAsTheLibrary([await (await open(service.url)).track(clip.frames[1])]);
    await session.track(clip.frames[100]);
    await session.end();
  } finally {
    await service.stop();
  }
});

test("a stream that is begun after the service was killed goes on, also with a key", async () => {
  const key = "0123456789abcdef";
  const service = await startMortal({ ...SECRET, BAGTRACK_API_KEYS: `page:${key}` });
  try {
    const session = await new Client(service.url, { key }).open(clip.frames[0], clip.box, { seed: SEED });
    const answers = [await session.track(clip.frames[1])];
    await service.restart();
    const stream = session.stream();
    answers.push(...(await Promise.all(clip.frames.slice(2, 12).map((frame) => stream.track(frame)))));
    sameAsTheLibrary(answers);
    stream.close();
  } finally {
    await service.stop();
  }
});

test("a live stream goes on with the newest frame", async () => {
  const service = await startMortal(SECRET);
  try {
    const session = await open(service.url, 3);
    const stream = session.stream({ live: true });
    for (const frame of clip.frames.slice(1, 9)) assert.ok(await stream.track(frame));
    await service.restart();
    const answer = await stream.track(clip.frames[9]);
    assert.ok(answer && answer.frame >= 7 && answer.frame <= 9 && answer.status === "tracking", JSON.stringify(answer));
    stream.close();
  } finally {
    await service.stop();
  }
});

test("a paused stream whose session expires holds none, and goes on with the next frame", async () => {
  const service = await startMortal({}, ["--session-idle", "1"]);
  try {
    const session = await open(service.url);
    const lines = /** @type {boolean[]} */ ([]);
    const stream = session.stream({ onLine: (isUp) => lines.push(isUp) });
    const answers = await Promise.all(clip.frames.slice(1, 16).map((frame) => stream.track(frame)));
    // Waits until the line is up for the second time, after the session has expired.
    while (lines.filter((isUp) => isUp).length < 2) await new Promise((resolve) => setTimeout(resolve, 20));
    assert.equal(await service.sessions(), 0);
    answers.push(...(await Promise.all(clip.frames.slice(16, 26).map((frame) => stream.track(frame)))));
    sameAsTheLibrary(answers);
    stream.close();
  } finally {
    await service.stop();
  }
});

test("what cannot be opened again is a problem: without snapshots, with another secret, after the end", async () => {
  const service = await startMortal({});
  const isGone = (/** @type {unknown} */ error) => error instanceof Problem && error.slug === "session-not-found";
  try {
    const [without, other, ended] = [await open(service.url, 0), await open(service.url), await open(service.url)];
    const stream = (await open(service.url, 0)).stream();
    for (const frame of clip.frames.slice(1, 13)) await Promise.all([without.track(frame), other.track(frame)]);
    await stream.track(clip.frames[1]);
    await ended.end();
    await assert.rejects(ended.track(clip.frames[1]), isGone);
    await service.restart();
    await assert.rejects(without.track(clip.frames[13]), isGone);
    await assert.rejects(other.track(clip.frames[13]), isGone);
    await assert.rejects(stream.track(clip.frames[2]), isGone);
    assert.ok(isGone(await stream.ended));
  } finally {
    await service.stop();
  }
});

test("a session ends after the snapshot that is under way, not before it", async () => {
  const service = await startService([], SECRET);
  const { fetch } = globalThis;
  const asked = /** @type {string[]} */ ([]);
  const statuses = /** @type {number[]} */ ([]);
  let release = () => undefined;
  let isHeld = (/** @type {unknown} */ _) => undefined;
  const held = new Promise((resolve) => (isHeld = resolve));
  const released = new Promise((resolve) => (release = () => resolve(undefined)));
  globalThis.fetch = async (url, options) => {
    asked.push(`${options?.method} ${String(url).split("/").at(-1)}`);
    if (String(url).endsWith("/snapshot")) {
      isHeld(undefined);
      await released;
    }
    const response = await fetch(url, options);
    statuses.push(response.status);
    return response;
  };
  try {
    const session = await open(service.url, 3);
    const stream = session.stream();
    for (const frame of clip.frames.slice(1, 4)) await stream.track(frame);
    await held;
    stream.close();
    const ending = session.end();
    await new Promise(setImmediate);
    assert.equal(asked.at(-1), "GET snapshot");
    release();
    await ending;
    assert.equal(asked.at(-1), `DELETE ${session.id}`);
    assert.deepEqual(statuses.filter((status) => status >= 400), []);
  } finally {
    globalThis.fetch = fetch;
    await service.stop();
  }
});
