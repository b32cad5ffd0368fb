// Two replicas with one store, of which the first is killed.

import assert from "node:assert/strict";
import { execFileSync, spawn } from "node:child_process";
import { createServer } from "node:net";
import { test } from "node:test";
import { Client } from "../bagtrack.js";
import { SEED, openLine, rounded, sampleClip, startService } from "./service.js";

const clip = sampleClip();

function hasRedis() {
  try {
    execFileSync("redis-server", ["--version"]);
    return true;
  } catch {
    return false;
  }
}
const options = { skip: hasRedis() ? false : "there is no redis-server" };

async function freePort() {
  const server = createServer();
  await new Promise((resolve) => server.listen(0, "127.0.0.1", () => resolve(undefined)));
  const { port } = /** @type {any} */ (server.address());
  await new Promise((resolve) => server.close(resolve));
  return port;
}

/** A store, and two replicas behind one line, the second one in reserve.
 * @param {string} every */
async function startReplicas(every) {
  const port = await freePort();
  const flags = ["--port", `${port}`, "--save", "", "--appendonly", "no", "--bind", "127.0.0.1"];
  const redis = spawn("redis-server", flags, { stdio: ["ignore", "pipe", "ignore"] });
  await new Promise((resolve) => redis.stdout.on("data", (data) => /Ready to accept/.test(`${data}`) && resolve(undefined)));
  const store = ["--store", `redis://127.0.0.1:${port}`, "--store-every", every];
  const [first, second] = await Promise.all([startService(store), startService(store)]);
  const line = await openLine(first.port);
  return {
    url: line.url,
    async killFirst() {
      await first.stop();
      line.lead(second.port);
      line.cut();
    },
    async stop() {
      line.close();
      await Promise.all([first.stop(), second.stop()]);
      redis.kill("SIGKILL");
    },
  };
}

/** @param {any[]} answers */
function sameAsTheLibrary(answers) {
  const plain = answers.map(rounded);
  assert.deepEqual(plain, clip.answers.slice(1, 1 + answers.length));
}

for (const every of ["1", "7"]) {
  test(`posts go on at another replica, with a checkpoint every ${every}`, options, async () => {
    const replicas = await startReplicas(every);
    try {
      const session = await new Client(replicas.url).open(clip.frames[0], clip.box, { seed: SEED });
      const answers = [];
      for (const [index, frame] of clip.frames.slice(1, 41).entries()) {
        if (index === 26) await replicas.killFirst();
        answers.push(await session.track(frame));
      }
      sameAsTheLibrary(answers);
      assert.ok(session.kept.frames.length < Number(every), `${session.kept.frames.length} frames are kept`);
    } finally {
      await replicas.stop();
    }
  });

  test(`a stream goes on at another replica, with a checkpoint every ${every}`, options, async () => {
    const replicas = await startReplicas(every);
    try {
      const session = await new Client(replicas.url).open(clip.frames[0], clip.box, { seed: SEED });
      const stream = session.stream();
      const before = await Promise.all(clip.frames.slice(1, 27).map((frame) => stream.track(frame)));
      await replicas.killFirst();
      const after = await Promise.all(clip.frames.slice(27, 41).map((frame) => stream.track(frame)));
      sameAsTheLibrary([...before, ...after]);
      stream.close();
    } finally {
      await replicas.stop();
    }
  });
}
