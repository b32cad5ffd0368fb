// The client against the program: the boxes must be those of the library.

import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { mkdtempSync, openAsBlob, rmSync, writeFileSync } from "node:fs";
import { createServer, request as forward } from "node:http";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { Client, Problem } from "../bagtrack.js";
import { SEED, openLine, rounded, sampleClip, startService } from "./service.js";

const clip = sampleClip();
const options = { seed: SEED };
/** @type {Awaited<ReturnType<typeof startService>>} */
let service;
before(async () => (service = await startService()));
after(() => service.stop());

test("why a service cannot be reached is told, and a certificate that nobody signed at once", async (context) => {
  const [frame] = clip.frames;
  const ended = await startService();
  await ended.stop();
  const away = new Client(ended.url, { patience: 200 }).open(frame, clip.box);
  await assert.rejects(away, (error) => error instanceof Problem && /reached: .*ECONNREFUSED/.test(error.message));
  const folder = mkdtempSync(join(tmpdir(), "bagtrack-tls-"));
  const [certificate, key] = ["cert.pem", "key.pem"].map((name) => join(folder, name));
  const flags = "req -x509 -newkey rsa:2048 -nodes -days 2 -subj /CN=bagtrack -addext subjectAltName=IP:127.0.0.1";
  if (spawnSync("openssl", [...flags.split(" "), "-keyout", key, "-out", certificate]).status !== 0)
    return context.skip("there is no openssl");
  const secure = await startService(["--tls-cert", certificate, "--tls-key", key]);
  const refused = new Client(secure.url, { patience: 600_000 }).open(frame, clip.box);
  await assert.rejects(refused, (error) => error instanceof Problem && /self-signed certificate/.test(error.message));
  await secure.stop();
  rmSync(folder, { recursive: true });
});

test("an address or a key that no request takes is told at once, and a key is not shown", async () => {
  for (const address of ["localhost:8080", "ftp://localhost/", "ws://localhost:8080", "/service", "", undefined])
    assert.throws(() => new Client(/** @type {any} */ (address)), new RegExp(`TypeError: The address ${address} does not begin with http:`));
  const [frame] = clip.frames;
  const isTold = (/** @type {any} */ error) => error instanceof TypeError && !/secret/.test(error.message);
  await assert.rejects(new Client("http://me:secret@localhost:8080").open(frame, clip.box), isTold);
  for (const key of ["one-secret\nanother-secret", "secret-\u00fc", "secret-\u2603", " \n"])
    await assert.rejects(new Client(service.url, { key }).open(frame, clip.box), isTold, JSON.stringify(key));
  await (await new Client(service.url, { key: "the-key-of-a-file\n" }).open(frame, clip.box)).end();
});

/** A server that answers with this.
 * @param {import("node:http").RequestListener} answer */
async function answering(answer) {
  const server = createServer(answer);
  await new Promise((resolve) => server.listen(0, "127.0.0.1", () => resolve(undefined)));
  const url = `http://127.0.0.1:${/** @type {any} */ (server.address()).port}`;
  const close = () => {
    server.close();
    server.closeAllConnections();
  };
  return { url, close };
}

// HTTP has three forms of a date (RFC 9110, 5.6.7).
test("a date after which to try again is read in each of its forms", async () => {
  const dates = ["Sun, 06 Nov 1994 08:49:37 GMT", "Sunday, 06-Nov-94 08:49:37 GMT", "Sun Nov  6 08:49:37 1994"];
  const said = [...dates.map((date) => [date, 7]), ["Sunday"], ["11/6/94"]];
  for (const [after, seconds] of said) {
    const headers = { "Retry-After": String(after), Date: "Sun, 06 Nov 1994 08:49:30 GMT" };
    const server = await answering((_, response) => void response.writeHead(503, headers).end());
    const problem = await new Client(server.url, { patience: 0 }).open(clip.frames[0], clip.box).catch((error) => error);
    assert.equal(problem.retryAfter, seconds, String(after));
    server.close();
  }
});

// Otherwise the restored session would stay at the service until it expires.
test("a session that cannot be read once it is restored is ended", async () => {
  const session = await new Client(service.url).open(clip.frames[0], clip.box, options);
  const snapshot = await session.snapshot();
  await session.end();
  const asked = /** @type {string[]} */ ([]);
  let tell = () => undefined;
  const ended = new Promise((resolve) => (tell = () => resolve(undefined)));
  const between = await answering((request, response) => {
    const { method = "", url: path, headers } = request;
    asked.push(method);
    if (method === "GET") return void response.writeHead(500).end();
    const passed = forward({ host: "127.0.0.1", port: service.port, method, path, headers }, (answer) => {
      response.writeHead(answer.statusCode ?? 502, answer.headers);
      answer.pipe(response);
      if (method === "DELETE") tell();
    });
    request.pipe(passed);
  });
  await assert.rejects(new Client(between.url).restore(snapshot), { status: 500 });
  await ended;
  assert.deepEqual(asked, ["PUT", "GET", "DELETE"]);
  between.close();
});

test("a patience and other numbers that are none are refused", async () => {
  const wrong = /** @type {any[]} */ (["20s", "20000", NaN, -1, {}, true]);
  const client = new Client(service.url, { patience: Infinity, snapshotEvery: 0 });
  const session = await client.open(clip.frames[0], clip.box);
  const snapshot = await session.snapshot();
  for (const patience of wrong) {
    const told = { name: "RangeError", message: /^patience is a number from 0 on, not / };
    assert.throws(() => new Client(service.url, { patience }), told);
    assert.throws(() => session.stream({ patience }), told);
    await assert.rejects(client.restore(snapshot, undefined, patience), told);
    const snapshotEvery = patience;
    assert.throws(() => new Client(service.url, { snapshotEvery }), /^RangeError: snapshotEvery is a number/);
  }
  await session.end();
});

/** @param {any[]} answers
 * @param {number} [first] */
function sameAsTheLibrary(answers, first = 1) {
  const plain = answers.map(rounded);
  assert.deepEqual(plain, clip.answers.slice(first, first + answers.length));
}

/** @param {unknown} slug */
const problem = (slug) => (/** @type {unknown} */ error) => error instanceof Problem && error.slug === slug;

test("frames one after the other get the library's boxes", async (context) => {
  const session = await new Client(service.url).open(clip.frames[0], clip.box, options);
  const answers = [];
  const started = performance.now();
  for (const frame of clip.frames.slice(1)) answers.push(await session.track(frame));
  const each = (performance.now() - started) / answers.length;
  context.diagnostic(`track: ${answers.length} frames, ${each.toFixed(1)} ms each`);
  sameAsTheLibrary(answers);
  assert.equal((await session.read()).frames, clip.frames.length);
  await session.end();
  await session.end();
  await assert.rejects(session.read(), problem("session-not-found"));
});

test("calls that are not waited for keep their order", async () => {
  const session = await new Client(service.url).open(clip.frames[0], clip.box, options);
  const answers = await Promise.all(clip.frames.slice(1, 21).map((frame) => session.track(frame)));
  sameAsTheLibrary(answers);
  await session.end();
});

test("several frames a request, Blobs among them", async (context) => {
  const session = await new Client(service.url).open(new Blob([clip.frames[0]]), clip.box, options);
  const answers = [];
  const started = performance.now();
  for (let at = 1; at < 100; at += 20) {
    const frames = clip.frames.slice(at, at + 20);
    answers.push(...(await session.trackAll([new Blob([frames[0]]), ...frames.slice(1)])));
  }
  context.diagnostic(`trackAll: ${((performance.now() - started) / answers.length).toFixed(1)} ms a frame`);
  sameAsTheLibrary(answers);
  await session.end();
});

test("a damaged frame is refused, and those after it are tracked", async () => {
  const session = await new Client(service.url).open(clip.frames[0], clip.box, options);
  const damaged = clip.frames[1].slice(0, 900);
  const [refused, ...rest] = await Promise.allSettled([
    session.track(damaged),
    ...clip.frames.slice(1, 6).map((frame) => session.track(frame)),
  ]);
  assert.ok(refused.status === "rejected" && problem("frame-damaged")(refused.reason));
  sameAsTheLibrary(rest.map((settled) => settled.status === "fulfilled" && settled.value));
  await session.end();
});

test("a snapshot goes on under another id, a correction moves the box", async () => {
  const client = new Client(service.url);
  const session = await client.open(clip.frames[0], clip.box, options);
  assert.deepEqual([session.score, session.status], [1, "tracking"]);
  for (const frame of clip.frames.slice(1, 11)) await session.track(frame);
  const restored = await client.restore(await session.snapshot());
  assert.notEqual(restored.id, session.id);
  // A session has its last answer, however it was opened, as local sessions do.
  for (const same of [session, restored, await client.attach(session.id)]) sameAsTheLibrary([same], 10);
  const answers = [];
  for (const frame of clip.frames.slice(11, 31)) answers.push(await restored.track(frame));
  sameAsTheLibrary(answers, 11);
  const box = { x: 20, y: 30, width: 40, height: 50 };
  await assert.rejects(client.open(clip.frames[31], Object.values(box), options), /A box is \{ x, y, width, height \}/);
  const corrected = await restored.correct(clip.frames[31], box);
  assert.deepEqual(corrected.box, box);
  assert.equal(corrected.frame, 31);
  const attached = await client.attach(restored.id);
  assert.deepEqual([attached.frame, attached.box], [31, box]);
  const picture = new Uint8Array(await (await restored.bag()).arrayBuffer());
  assert.equal(String.fromCharCode(...picture.slice(1, 4)), "PNG");
});

test("a correction with a wrong box is refused, and nothing of it is kept", async () => {
  const session = await new Client(service.url).open(clip.frames[0], clip.box, options);
  const wrong = /** @type {any[]} */ ([undefined, null, 5, [1, 2, 30, 40], { ...clip.box, x: undefined }]);
  wrong.push({ ...clip.box, width: "30" }, { ...clip.box, height: Infinity });
  for (const box of wrong) {
    await assert.rejects(session.correct(clip.frames[1], box), problem("invalid-box"), JSON.stringify(box));
    await assert.rejects(session.client.open(clip.frames[0], box), problem("invalid-box"), JSON.stringify(box));
  }
  // The caller changes its box while the call waits.
  const box = { ...clip.box };
  const first = session.track(clip.frames[1]);
  const corrected = session.correct(clip.frames[2], box);
  box.x = NaN;
  sameAsTheLibrary([await first]);
  assert.deepEqual((await corrected).box, clip.box);
  assert.deepEqual([(await session.track(clip.frames[3])).frame, (await session.read()).frames], [3, 4]);
  await session.end();
});

test("a line that breaks between and within requests loses nothing", async () => {
  const line = await openLine(service.port);
  const session = await new Client(line.url).open(clip.frames[0], clip.box, options);
  const answers = [];
  for (const [index, frame] of clip.frames.slice(1, 61).entries()) {
    const answer = session.track(frame);
    if (index % 7 === 3) setImmediate(() => line.cut());
    if (index === 30) {
      line.shut(true);
      setTimeout(() => line.shut(false), 300);
    }
    answers.push(await answer);
  }
  sameAsTheLibrary(answers);
  line.close();
});

test("a service that cannot be reached is a problem when patience ends", async () => {
  const line = await openLine(service.port);
  const session = await new Client(line.url, { patience: 500 }).open(clip.frames[0], clip.box, options);
  line.shut(true);
  line.cut();
  const started = performance.now();
  await assert.rejects(session.track(clip.frames[1]), problem("unreachable"));
  assert.ok(performance.now() - started > 150);
  line.shut(false);
  // The frame without an answer is sent before the next one.
  assert.deepEqual(rounded(await session.track(clip.frames[2])), clip.answers[2]);
  line.close();
});

test("a full service is asked again, when it says so", async () => {
  const full = await startService(["--max-sessions", "1"]);
  try {
    const first = await new Client(full.url).open(clip.frames[0], clip.box, options);
    const impatient = new Client(full.url, { patience: 1000 });
    await assert.rejects(impatient.open(clip.frames[0], clip.box, options), problem("too-many-sessions"));
    const second = new Client(full.url, { patience: 60_000 }).open(clip.frames[0], clip.box, options);
    await first.end();
    sameAsTheLibrary([await (await second).track(clip.frames[1])]);
  } finally {
    await full.stop();
  }
});

// A file that cannot be read is no failure of the service: it is not tried again, and neither the next frames nor a
// stream fail because of it.
test("a file may be removed once it was sent; one that was removed before is told at once", async () => {
  const folder = mkdtempSync(join(tmpdir(), "bagtrack-files-"));
  const fileOf = async (/** @type {number} */ frame) => {
    const path = join(folder, `${frame}.jpg`);
    writeFileSync(path, clip.frames[frame]);
    return { file: await openAsBlob(path), remove: () => rmSync(path) };
  };
  try {
    const client = new Client(service.url);
    const first = await fileOf(0);
    const session = await client.open(first.file, clip.box, options);
    const lost = await fileOf(1);
    lost.remove();
    const calls = [session.track(lost.file), session.trackAll([clip.frames[1], lost.file]), session.correct(lost.file, clip.box)];
    for (const call of calls) await assert.rejects(call, problem("unsupported-image"));
    const sent = await fileOf(1);
    sameAsTheLibrary([await session.track(sent.file)]);
    for (const { remove } of [first, sent]) remove();
    // The session is opened again, with the frames that were sent.
    await (await client.attach(session.id)).end();
    sameAsTheLibrary([await session.track((await fileOf(2)).file)], 2);
    const stream = session.stream();
    const files = await Promise.all([3, 4, 5].map(fileOf));
    files[1].remove();
    const [third, fourth, fifth] = files.map(({ file }) => stream.track(file));
    await assert.rejects(fourth, problem("unsupported-image"));
    assert.deepEqual([(await third)?.frame, (await fifth)?.frame], [3, 4]);
    stream.close();
  } finally {
    rmSync(folder, { recursive: true });
  }
});

test("a signal ends the waiting", async () => {
  const line = await openLine(service.port);
  line.shut(true);
  const stop = new AbortController();
  const opening = new Client(line.url).open(clip.frames[0], clip.box, { signal: stop.signal });
  setTimeout(() => stop.abort(new Error("enough")), 50);
  await assert.rejects(opening, /enough/);
  line.close();
});

test("keys and session tokens", async () => {
  const key = "0123456789abcdef";
  const closed = await startService([], { BAGTRACK_API_KEYS: `page:${key}` });
  try {
    await assert.rejects(new Client(closed.url).open(clip.frames[0], clip.box), problem("unauthorized"));
    const session = await new Client(closed.url, { key }).open(clip.frames[0], clip.box, options);
    const page = await new Client(closed.url, { key: await session.token(600) }).attach(session.id);
    sameAsTheLibrary([await page.track(clip.frames[1])]);
    const token = page.stream();
    sameAsTheLibrary([await token.track(clip.frames[2])], 2);
    token.close();
    const own = (await new Client(closed.url, { key }).attach(session.id)).stream();
    sameAsTheLibrary([await own.track(clip.frames[3])], 3);
    own.close();
  } finally {
    await closed.stop();
  }
});

test("a stream takes another token when its own ends, and ends with its key", async () => {
  const key = "0123456789abcdef";
  const closed = await startService([], { BAGTRACK_API_KEYS: `page:${key}` });
  try {
    const client = new Client(closed.url, { key });
    const session = await client.open(clip.frames[0], clip.box, options);
    const make = session.token.bind(session);
    let made = 0;
    session.token = () => {
      made += 1;
      return make(1);
    };
    const stream = session.stream();
    const answers = [];
    while (made < 3) {
      answers.push(await stream.track(clip.frames[answers.length + 1]));
      await new Promise((resolve) => setTimeout(resolve, 50));
    }
    sameAsTheLibrary(answers);
    client.transport.key = await make(1);
    const refused = (async () => {
      for (;;) await stream.track(clip.frames[answers.length + 1]);
    })();
    await assert.rejects(refused, problem("unauthorized"));
    assert.equal(/** @type {any} */ (await stream.ended).slug, "unauthorized");
  } finally {
    await closed.stop();
  }
});

test("a session leaves a service that is about to end", async () => {
  const secret = { BAGTRACK_SNAPSHOT_KEYS: "a secret of this test" };
  const [first, second] = await Promise.all([startService([], secret), startService([], secret)]);
  // A load balancer: a request with a new session's id goes to the service at `opensAt`, all others to that of their
  // session.
  /** @type {Map<string, number>} */
  const ports = new Map();
  let opensAt = first.port;
  const balancer = createServer((request, response) => {
    const id = /sessions\/([^/?]+)/.exec(request.url ?? "")?.[1] ?? "";
    if (!ports.has(id)) ports.set(id, opensAt);
    const { method, url, headers } = request;
    const options = { host: "127.0.0.1", port: ports.get(id), method, path: url, headers };
    const passed = forward(options, (answer) => {
      response.writeHead(answer.statusCode ?? 502, answer.headers);
      answer.pipe(response);
    });
    passed.on("error", () => response.destroy());
    request.pipe(passed);
  });
  await new Promise((resolve) => balancer.listen(0, "127.0.0.1", () => resolve(undefined)));
  try {
    const client = new Client(`http://127.0.0.1:${/** @type {any} */ (balancer.address()).port}`);
    const session = await client.open(clip.frames[0], clip.box, { seed: SEED });
    const opened = session.id;
    const answers = [];
    for (const [index, frame] of clip.frames.slice(1, 21).entries()) {
      if (index === 8) {
        first.ask();
        while ((await fetch(`${first.url}/readyz`)).ok);
        // The session has not heard yet that its service is about to end.
        assert.equal(session.isDraining, false);
      }
      if (index === 12) {
        assert.ok(session.isDraining && session.id === opened);
        opensAt = second.port;
        session.triedToMove = 0;
      }
      if (index === 14) {
        assert.ok(!session.isDraining && session.id !== opened);
        await first.stop();
      }
      answers.push(await session.track(frame));
    }
    assert.deepEqual(answers.map(rounded), clip.answers.slice(1, 21));
  } finally {
    balancer.close();
    balancer.closeAllConnections();
    await Promise.all([first.stop(), second.stop()]);
  }
});

test("a signal ends the sending of a frame that is sent again", async () => {
  const line = await openLine(service.port);
  const session = await new Client(line.url, { patience: 1000 }).open(clip.frames[0], clip.box, options);
  line.shut(true);
  line.cut();
  for (const frame of clip.frames.slice(1, 3)) {
    await assert.rejects(session.track(frame, AbortSignal.timeout(100)), { name: "TimeoutError" });
  }
  line.shut(false);
  assert.deepEqual(rounded(await session.track(clip.frames[3])), clip.answers[3]);
  line.close();
});

test("a large frame has longer to go over a slow line", async (context) => {
  context.mock.timers.enable({ apis: ["setTimeout"] });
  const client = new Client("http://127.0.0.1:9", { patience: 0 });
  const own = globalThis.fetch;
  /** @type {AbortSignal[]} */
  const signals = [];
  globalThis.fetch = (_, { signal }) => {
    signals.push(signal);
    return new Promise((_, reject) => signal.addEventListener("abort", () => reject(signal.reason)));
  };
  try {
    const opening = client.open(new Uint8Array(6e6), clip.box).catch(() => undefined);
    const small = client.open(clip.frames[0], clip.box).catch(() => undefined);
    while (signals.length < 2) await Promise.resolve();
    context.mock.timers.tick(100_000);
    assert.deepEqual(signals.map(({ aborted }) => aborted), [false, true]);
    context.mock.timers.tick(100_000);
    assert.ok(signals[0].aborted);
    await Promise.all([opening, small]);
  } finally {
    globalThis.fetch = own;
  }
});
