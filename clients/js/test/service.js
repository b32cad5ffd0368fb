// The program on a free port, the sample clip, and what the library answers to it.

import { execFileSync, spawn } from "node:child_process";
import { mkdtempSync, readFileSync, readdirSync, rmSync } from "node:fs";
import { createServer, connect } from "node:net";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { fileURLToPath } from "node:url";

export const PROGRAM = process.env.BAGTRACK ?? fileURLToPath(new URL("../../../target/debug/bagtrack", import.meta.url));
export const SEED = 7;
const FRAMES = 101;

/** @param {string[]} flags
 * @param {Record<string, string>} [environment] */
export async function startService(flags = [], environment = {}) {
  const command = ["serve", "--listen", "127.0.0.1:0", ...flags];
  const child = spawn(PROGRAM, command, { stdio: ["ignore", "ignore", "pipe"], env: { ...process.env, ...environment } });
  const url = await new Promise((resolve, reject) => {
    let text = "";
    child.stderr.on("data", (data) => {
      text += data;
      const found = /https?:\/\/127\.0\.0\.1:\d+/.exec(text);
      if (found) resolve(found[0]);
    });
    child.on("exit", () => reject(new Error(text)));
  });
  const ended = new Promise((resolve) => child.on("exit", resolve));
  return {
    url,
    port: Number(new URL(url).port),
    ask: () => child.kill("SIGTERM"),
    async stop() {
      child.kill("SIGKILL");
      await ended;
    },
  };
}

/** An answer to a hundredth of a pixel and a thousandth of the score.
 * @param {any} answer */
export function rounded({ frame, box, score, status }) {
  const sides = Object.entries(box).map(([side, value]) => [side, Math.round(100 * value) / 100]);
  return { frame, box: Object.fromEntries(sides), score: Math.round(1000 * score) / 1000, status };
}

/** The sample clip: its frames, the first box, and the answers of the library to the frames after the first. */
export function sampleClip() {
  const folder = mkdtempSync(join(tmpdir(), "bagtrack-clip-"));
  try {
    execFileSync(PROGRAM, ["sample", "--out", folder, "--frames", String(FRAMES)]);
    const names = readdirSync(join(folder, "img")).sort();
    const frames = names.map((name) => new Uint8Array(readFileSync(join(folder, "img", name))));
    const truth = readFileSync(join(folder, "groundtruth_rect.txt"), "utf8").split("\n")[0].split(",").map(Number);
    // The ground-truth file counts pixels from 1.
    const [x, y, width, height] = [truth[0] - 1, truth[1] - 1, truth[2], truth[3]].map((value) => Number(value.toFixed(1)));
    const box = { x, y, width, height };
    const flags = ["--box", [x, y, width, height].join(","), "--seed", String(SEED), "--format", "json"];
    const lines = execFileSync(PROGRAM, ["track", folder, ...flags], { encoding: "utf8" }).trim().split("\n");
    const answers = lines.map((line) => rounded(JSON.parse(line)));
    return { frames, box, answers };
  } finally {
    rmSync(folder, { recursive: true });
  }
}

/** A port that forwards to another one. Its connections can be cut, and while it is shut it takes none.
 * @param {number} port */
export async function openLine(port) {
  const sockets = new Set();
  let isShut = false;
  let target = port;
  const server = createServer((client) => {
    if (isShut) return client.destroy();
    const service = connect(target, "127.0.0.1");
    client.pipe(service).pipe(client);
    for (const socket of [client, service]) {
      socket.setNoDelay(true);
      socket.on("error", () => undefined);
      sockets.add(socket);
      socket.on("close", () => {
        sockets.delete(socket);
        client.destroy();
        service.destroy();
      });
    }
  });
  await new Promise((resolve) => server.listen(0, "127.0.0.1", () => resolve(undefined)));
  server.unref();
  return {
    url: `http://127.0.0.1:${/** @type {any} */ (server.address()).port}`,
    lead(/** @type {number} */ other) {
      target = other;
    },
    cut() {
      const count = sockets.size;
      sockets.forEach((socket) => socket.destroy());
      return count;
    },
    shut(/** @type {boolean} */ shut) {
      isShut = shut;
    },
    close() {
    server.close();
      sockets.forEach((socket) => socket.destroy());
    },
  };
}
