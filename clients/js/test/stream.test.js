// Streams against the program.

import assert from "node:assert/strict";
import { createServer, request as forward } from "node:http";
import { after, before, test } from "node:test";
import { Client, Problem } from "../bagtrack.js";
import { SEED, openLine, rounded, sampleClip, startService } from "./service.js";

const clip = sampleClip();
/** @type {Awaited<ReturnType<typeof startService>>} */
let service;
before(async () => (service = await startService()));
after(() => service.stop());

/** @param {string} [url] */
const open = (url = service.url) => new Client(url).open(clip.frames[0], clip.box, { seed: SEED });

/** @param {any[]} answers
 * @param {number} [first] */
function sameAsTheLibrary(answers, first = 1) {
  const plain = answers.map(rounded);
  assert.deepEqual(plain, clip.answers.slice(first, first + answers.length));
}

test("a stream answers a hundred frames as the library does", async (context) => {
  const session = await open();
  const stream = session.stream();
  const started = performance.now();
  const answers = await Promise.all(clip.frames.slice(1).map((frame) => stream.track(frame)));
  context.diagnostic(`stream: ${answers.length} frames, ${((performance.now() - started) / 100).toFixed(1)} ms each`);
  sameAsTheLibrary(answers);
  await assert.rejects(session.track(clip.frames[1]), /has a stream/);
  assert.throws(() => session.stream(), /has a stream/);
  stream.close();
  assert.equal(await stream.ended, undefined);
  await assert.rejects(stream.track(clip.frames[1]), /has ended/);
  assert.equal((await session.track(clip.frames[100])).frame, 101);
});

test("a stream takes up after broken lines", async () => {
  const line = await openLine(service.port);
  const session = await open(line.url);
  const lines = /** @type {boolean[]} */ ([]);
  const stream = session.stream({ onLine: (isUp) => lines.push(isUp) });
  let count = 0;
  const answers = clip.frames.slice(1).map(async (frame) => {
    const answer = await stream.track(frame);
    count += 1;
    if (count % 25 === 10) line.cut();
    return answer;
  });
  sameAsTheLibrary(await Promise.all(answers));
  assert.ok(lines.filter((isUp) => !isUp).length >= 3, String(lines));
  stream.close();
  line.close();
});

test("a refused frame takes none of those behind it along", async () => {
  const session = await open();
  const stream = session.stream();
  const damaged = clip.frames[3].slice(0, 900);
  const order = [1, 2, 0, 3, 4, 0, 0, 5, 6, 7, 8, 9, 10, 11, 12];
  const sent = order.map((index) => stream.track(index === 0 ? damaged : clip.frames[index]));
  const settled = await Promise.allSettled(sent);
  const refused = settled.filter(({ status }) => status === "rejected");
  assert.equal(refused.length, 3);
  for (const { reason } of /** @type {PromiseRejectedResult[]} */ (refused)) assert.equal(reason.slug, "frame-damaged");
  sameAsTheLibrary(settled.flatMap((each) => (each.status === "fulfilled" ? [each.value] : [])));
  stream.close();
});

test("what is no frame or no box is refused, and holds up none behind it", async () => {
  const session = await open();
  assert.throws(() => session.stream({ window: 0 }), RangeError);
  for (const window of [33, 1.5, -1, NaN, /** @type {any} */ ("8")])
    assert.throws(() => session.stream({ window }), /from 1 to 32/);
  const stream = session.stream({ window: 1 });
  const refused = (/** @type {any} */ error) => error instanceof Problem && error.slug;
  const wrong = /** @type {any[]} */ (["abc", '{"see":true}', 5, { a: 1 }, [1, 2], null, undefined]);
  const first = stream.track(clip.frames[1]);
  for (const frame of wrong) {
    await assert.rejects(stream.track(frame), (error) => refused(error) === "unsupported-image", String(frame));
  }
  for (const box of /** @type {any[]} */ ([5, [1, 2, 30, 40], { ...clip.box, x: NaN }])) {
    await assert.rejects(stream.track(clip.frames[2], { box }), (error) => refused(error) === "invalid-box");
  }
  const { buffer } = clip.frames[2].slice();
  const given = [buffer, new Blob([clip.frames[3]]), Buffer.from(clip.frames[4])].map((frame) => stream.track(frame));
  sameAsTheLibrary(await Promise.all([first, ...given]));
  stream.close();
  // A post refuses such frames, too, and does not keep them for a stream to send.
  for (const frame of wrong) await assert.rejects(session.track(frame), (error) => refused(error) === "unsupported-image");
});

test("a correction and what the tracker saw", async () => {
  const session = await open();
  const stream = session.stream();
  const box = { x: 30, y: 40, width: 50, height: 60 };
  const answers = await Promise.all([
    stream.track(clip.frames[1], { see: true }),
    stream.track(clip.frames[1], { box }),
    stream.track(clip.frames[2]),
  ]);
  assert.ok(answers[0]?.particles?.length && answers[0].votes?.length);
  assert.deepEqual([answers[1]?.frame, answers[1]?.box], [2, box]);
  assert.equal(answers[2]?.frame, 3);
  stream.close();
});

test("live frames are answered or skipped, each once and in order", async () => {
  const line = await openLine(service.port);
  const session = await open(line.url);
  const stream = session.stream({ live: true });
  const done = /** @type {number[]} */ ([]);
  const sent = clip.frames.slice(1).map(async (frame, index) => {
    const answer = await stream.track(frame);
    done.push(index);
    return answer;
  });
  await sent[0];
  line.cut();
  const answers = await Promise.all(sent);
  const tracked = answers.filter((answer) => answer !== undefined);
  assert.ok(tracked.length > 0 && tracked.length < 100, `${tracked.length}`);
  assert.ok(answers.at(-1), "the newest is not skipped");
  assert.deepEqual(tracked.map(({ frame }) => frame), tracked.map((_, index) => tracked[0].frame + index));
  assert.equal(new Set(done).size, 100);
  stream.close();
  line.close();
});

test("of live frames one that takes long to be read is not skipped for ever", async () => {
  /** @type {(() => void)[]} */
  const reads = [];
  class SlowFile extends Blob {
    async arrayBuffer() {
      await new Promise((resolve) => reads.push(() => resolve(undefined)));
      return super.arrayBuffer();
    }
  }
  const session = await open();
  const stream = session.stream({ live: true });
  await stream.track(clip.frames[1]);
  const slow = clip.frames.slice(2, 5).map((frame) => stream.track(new SlowFile([frame])));
  assert.equal(await slow[1], undefined);
  for (const which of [0, 2]) {
    reads.shift()?.();
    assert.equal((await slow[which])?.frame, which === 0 ? 2 : 3);
  }
  stream.close();
});

test("of live frames one with a box is skipped only for another one with a box", async () => {
  const session = await open();
  const [wrong, right] = [{ x: 10, y: 20, width: 40, height: 40 }, { x: 60, y: 20, width: 40, height: 40 }];
  // All frames wait until the line is up.
  const stream = session.stream({ live: true });
  const headers = [{}, { box: wrong }, { box: right }, {}, {}];
  const answers = await Promise.all(headers.map((header, at) => stream.track(clip.frames[at + 1], header)));
  assert.deepEqual(answers.map((answer) => answer?.frame), [undefined, undefined, 1, undefined, 2]);
  assert.ok(Math.abs((answers[2]?.box.x ?? 0) - right.x) < 2, JSON.stringify(answers[2]));
  stream.close();
});

test("what is no answer of the service ends the stream, and is told", async () => {
  for (const message of ["<html>", '{"ok": true}', "null", '{"frame": 1}']) {
    class Other extends WebSocket {
      set onmessage(/** @type {(event: MessageEvent) => void} */ hear) {
        this.addEventListener("message", () => hear(new MessageEvent("message", { data: message })));
      }
    }
    const session = await new Client(service.url, { WebSocket: Other }).open(clip.frames[0], clip.box);
    const stream = session.stream();
    const told = { name: "Problem", status: 101, message: /^The stream sent what is no answer of bagtrack: "/ };
    await assert.rejects(stream.track(clip.frames[1]), told);
    assert.match(String(await stream.ended), /no answer of bagtrack/);
    assert.equal(session.frame, 0);
  }
});

test("the end of the session ends the stream", async () => {
  const client = new Client(service.url, { snapshotEvery: 0 });
  const session = await client.open(clip.frames[0], clip.box, { seed: SEED });
  const stream = session.stream();
  await stream.track(clip.frames[1]);
  // Another client ends the session; the stream hears of it with its next frame.
  await (await client.attach(session.id)).end();
  const late = stream.track(clip.frames[2]);
  await assert.rejects(late, (error) => error instanceof Problem && error.slug === "session-not-found");
  const problem = await stream.ended;
  assert.ok(problem instanceof Problem && problem.slug === "session-not-found", String(problem));
});

test("a session that is ended ends its stream, without another frame", async () => {
  const session = await open();
  const stream = session.stream();
  await stream.track(clip.frames[1]);
  await session.end();
  assert.equal(await stream.ended, undefined);
  await assert.rejects(stream.track(clip.frames[2]), /has ended/);
});

test("a newer stream takes the place of an older one", async () => {
  const session = await open();
  const older = session.stream();
  await older.track(clip.frames[1]);
  const newer = (await new Client(service.url).attach(session.id)).stream();
  sameAsTheLibrary([await newer.track(clip.frames[2])], 2);
  const problem = await older.ended;
  assert.ok(problem instanceof Problem && problem.slug === "replaced", String(problem));
  // A frame that comes after the end of the stream is refused with the same problem.
  await assert.rejects(older.track(clip.frames[2]), (error) => error === problem);
  newer.close();
});

test("a service that has gone ends the stream when patience ends", async () => {
  const gone = await startService();
  const session = await open(gone.url);
  const stream = session.stream({ patience: 600 });
  await stream.track(clip.frames[1]);
  await gone.stop();
  await assert.rejects(stream.track(clip.frames[2]), (error) => error instanceof Problem && error.slug === "unreachable");
});

/** Makes timers a hundred times as fast. Not with a mocked clock: its `clearTimeout` clears no real timers, and
 * Node.js's own connections have some.
 * @param {import("node:test").TestContext} context */
function hurry(context) {
  const set = globalThis.setTimeout;
  const quick = (/** @type {any} */ run, /** @type {number} */ pause, /** @type {any[]} */ ...values) => set(run, pause / 100, ...values);
  context.mock.method(globalThis, "setTimeout", quick);
}

// The line breaks, and neither an event nor an answer tells of it.
test("a line that is silent is opened again", async (context) => {
  /** @type {WebSocket[]} */
  const sockets = [];
  class Deaf extends WebSocket {
    constructor(/** @type {URL} */ url, /** @type {string[]} */ protocols) {
      super(url, protocols);
      sockets.push(this);
    }
    close() {
      // This socket does not report its end either.
      this.onclose = null;
      super.close();
    }
  }
  const session = await new Client(service.url, { WebSocket: Deaf }).open(clip.frames[0], clip.box, { seed: SEED });
  const stream = session.stream();
  const answers = [await stream.track(clip.frames[1])];
  hurry(context);
  sockets[0].onmessage = null;
  // The line is found silent after a while, then opened again after a pause.
  answers.push(await stream.track(clip.frames[2]));
  sameAsTheLibrary(answers);
  assert.equal(sockets.length, 2);
  stream.close();
});

// A proxy that refuses WebSockets: the client must not try for ever.
test("a stream that a proxy does not let through ends when patience ends, and the session goes on", async () => {
  class Stopped extends WebSocket {
    constructor(/** @type {URL} */ url) {
      super(new URL("/livez", url));
    }
  }
  const session = await new Client(service.url, { WebSocket: Stopped }).open(clip.frames[0], clip.box, { seed: SEED });
  const lines = /** @type {boolean[]} */ ([]);
  const stream = session.stream({ patience: 300, onLine: (isUp) => lines.push(isUp) });
  const told = { slug: "no-stream", message: /^The service answers, but its stream cannot be opened/ };
  await assert.rejects(stream.track(clip.frames[1]), told);
  assert.deepEqual(lines, [false]);
  sameAsTheLibrary([await session.track(clip.frames[1])]);
});

/** A balancer that sends requests that open sessions to one instance, and all others to another one, which does not
 * know the session.
 * @param {{port: number}} other */
async function openBalancer(other) {
  const balancer = createServer((request, response) => {
    const opens = request.method === "PUT";
    own.opened += Number(opens);
    const { method, url: path, headers } = request;
    const passed = forward({ host: "127.0.0.1", port: opens ? service.port : other.port, method, path, headers }, (answer) => {
      response.writeHead(answer.statusCode ?? 502, answer.headers);
      answer.pipe(response);
    });
    request.pipe(passed);
  });
  await new Promise((resolve) => balancer.listen(0, "127.0.0.1", () => resolve(undefined)));
  const own = {
    url: `http://127.0.0.1:${/** @type {any} */ (balancer.address()).port}`,
    opened: 0,
    close() {
      balancer.close();
      balancer.closeAllConnections();
    },
  };
  return own;
}

test("a stream ends where each instance loses its session again, and opens not many", async () => {
  const other = await startService();
  const balancer = await openBalancer(other);
  try {
    const stream = (await open(balancer.url)).stream({ patience: 500 });
    const lost = (/** @type {unknown} */ error) => error instanceof Problem && error.slug === "session-not-found";
    await assert.rejects(stream.track(clip.frames[1]), lost);
    assert.ok(balancer.opened > 1 && balancer.opened < 5, `${balancer.opened} sessions`);
  } finally {
    balancer.close();
    await other.stop();
  }
});

// With endless patience, as in the page, a stream must still end if none can be opened.
test("streams of endless patience end where none can be had, and say why", async (context) => {
  class Stopped extends WebSocket {
    constructor(/** @type {URL} */ url) {
      super(new URL("/livez", url));
    }
  }
  const other = await startService();
  const balancer = await openBalancer(other);
  const patience = Infinity;
  try {
    const sessions = [await open(balancer.url), await new Client(service.url, { WebSocket: Stopped }).open(clip.frames[0], clip.box)];
    hurry(context);
    const ends = await Promise.all(sessions.map(async (session) => {
      const stream = session.stream({ patience });
      stream.track(clip.frames[1]).catch(() => undefined);
      return stream.ended;
    }));
    assert.match(String(ends[0]), /answers, but it loses each session at once: a balancer/);
    assert.match(String(ends[1]), /answers, but its stream cannot be opened: a proxy/);
    assert.ok(balancer.opened > 5 && balancer.opened < 12, `${balancer.opened} sessions`);
  } finally {
    balancer.close();
    await other.stop();
  }
});

test("frames without an answer are sent again by the stream or the post that comes next", async () => {
  const session = await open(service.url);
  const stream = session.stream();
  const on = clip.frames.slice(1, 6).map((frame) => stream.track(frame));
  await on[0];
  stream.close();
  const settled = await Promise.allSettled(on);
  assert.ok(settled.some(({ status }) => status === "rejected"));
  const posted = await session.track(clip.frames[6]);
  assert.deepEqual(rounded(posted), clip.answers[6]);

  const line = await openLine(service.port);
  const impatient = await new Client(line.url, { patience: 0 }).open(clip.frames[0], clip.box, { seed: SEED });
  line.shut(true);
  line.cut();
  await assert.rejects(impatient.track(clip.frames[1]));
  line.shut(false);
  const next = impatient.stream();
  assert.deepEqual(rounded(await next.track(clip.frames[2])), clip.answers[2]);
  next.close();
  line.close();
});

test("a stream that is closed with frames on their way is followed by another one, or by posts", async () => {
  let heard = 0;
  // Passes only `heard` messages on.
  class Deaf extends WebSocket {
    set onmessage(/** @type {(event: MessageEvent) => void} */ hear) {
      this.addEventListener("message", (event) => (heard -= 1) >= 0 && hear(event));
    }
  }
  for (const live of [false, true]) {
    for (const next of ["stream", "post"]) {
      heard = 2;
      const session = await new Client(service.url, { WebSocket: Deaf }).open(clip.frames[0], clip.box, { seed: SEED });
      const first = session.stream({ live });
      await first.track(clip.frames[1]);
      const settled = [];
      for (const count of [2, 3, 4, 5]) {
        settled.push(first.track(clip.frames[count]).catch(() => undefined));
        while ((await session.read()).frames <= count);
      }
      first.close();
      await Promise.all(settled);
      heard = Infinity;
      const second = next === "stream" ? session.stream({ live }) : session;
      assert.deepEqual(rounded(await second.track(clip.frames[6])), clip.answers[6], `${live ? "live, " : ""}${next}`);
      if (second !== session) second.close();
      await session.end();
    }
  }
});
