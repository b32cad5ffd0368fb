// The client does what docs/PROTOCOL.md says: the exchanges of tests/protocol/exchanges.json.

import assert from "node:assert/strict";
import { test } from "node:test";
import { Client, Problem } from "../bagtrack.js";
import { ScriptedService, TABLE } from "./scripted_service.js";

const bytes = (/** @type {string} */ text) => new TextEncoder().encode(text);

/** @param {number[]} box */
const boxOf = ([x, y, width, height]) => ({ x, y, width, height });

/** The options of the table, as this client calls them.
 * @param {{snapshot_every?: number, retry_for?: number}} [options] */
function clientOf(url, { snapshot_every: snapshotEvery, retry_for: retryFor } = {}) {
  return new Client(url, { snapshotEvery, patience: retryFor === undefined ? undefined : 1000 * retryFor });
}

/** Makes the calls of the table with this client, and gives their results in the words of the table. */
class Caller {
  constructor(client) {
    this.client = client;
  }

  async open({ open }) {
    this.session = await this.client.open(bytes(open), boxOf(TABLE.box));
  }

  async track({ track }) {
    const { frame, box } = await this.session.track(bytes(track));
    assert.deepEqual([this.session.frame, box.x], [frame, frame]);
    return { frame };
  }

  async correct({ correct, box }) {
    const { frame } = await this.session.correct(bytes(correct), boxOf(box));
    return { frame };
  }

  async snapshot() {
    return { snapshot: new TextDecoder().decode(await this.session.snapshot()) };
  }

  end() {
    return this.session.end();
  }
}

function failure(error) {
  if (!(error instanceof Problem)) throw error;
  return error.isTemporary ? { unavailable: true } : { refused: error.status, kind: error.slug };
}

const OPENED = { request: "PUT /sessions/{1}", frame: "a", reply: { status: 201, created: 0 } };
const posted = (/** @type {number} */ number, /** @type {string} */ frame, /** @type {object} */ reply) => ({
  request: `POST /sessions/{1}/frames?frame=${number}`,
  frame,
  reply,
});

/** A service with this script, for the length of a test.
 * @param {(service: ScriptedService) => Promise<void>} run */
async function withService(run) {
  const service = new ScriptedService();
  await service.start();
  try {
    await run(service);
    service.check();
  } finally {
    service.stop();
  }
}

test("a frame that is sent again is what it was, also where its buffer has another one since", () =>
  withService(async (service) => {
    const gone = { status: 404, problem: { type: "/docs/problems#session-not-found" } };
    service.exchanges = [
      OPENED,
      posted(1, "b", { status: 200, answer: 1 }),
      posted(2, "c", { status: 200, answer: 2 }),
      posted(3, "d", gone),
      { ...OPENED, request: "PUT /sessions/{2}" },
      ...[[1, "b"], [2, "c"], [3, "d"]].map(([number, frame]) => ({
        ...posted(Number(number), String(frame), { status: 200, answer: number }),
        request: `POST /sessions/{2}/frames?frame=${number}`,
      })),
    ];
    // One of the buffers is shared memory, which `fetch` cannot send: the client has to send a copy.
    const buffers = [bytes("a"), new Uint8Array(new SharedArrayBuffer(1)), bytes("a").buffer];
    const filled = (/** @type {number} */ at, /** @type {string} */ text) => {
      new Uint8Array(/** @type {any} */ (buffers[at]).buffer ?? buffers[at]).set(bytes(text));
      return buffers[at];
    };
    const session = await clientOf(service.url).open(filled(0, "a"), boxOf(TABLE.box));
    await session.track(filled(1, "b"));
    await session.track(filled(2, "c"));
    filled(0, "x");
    filled(2, "y");
    assert.equal((await session.track(filled(1, "d"))).frame, 3);
  }));

test("several frames may come from a generator", () =>
  withService(async (service) => {
    const answers = [1, 2].map((frame) => ({ frame, box: boxOf(TABLE.box), score: 1, status: "tracking" }));
    service.exchanges = [OPENED];
    const session = await clientOf(service.url).open(bytes("a"), boxOf(TABLE.box));
    service.answer = (request, body, response) => {
      assert.match(body, /\r\n\r\nb\r\n.*\r\n\r\nc\r\n/s);
      response.writeHead(200).end(JSON.stringify({ ...answers[1], answers }));
    };
    const given = await session.trackAll((function* () {
      yield bytes("b");
      yield bytes("c");
    })());
    assert.deepEqual([given.map(({ frame }) => frame), session.kept.last], [[1, 2], 2]);
  }));

const PAGE = { status: 200, text: "<html>Please log in</html>" };
const NO_ANSWERS = { page: PAGE, "other JSON": { status: 200, json: { ok: true } }, null: { status: 200, json: null } };

for (const [name, reply] of Object.entries(NO_ANSWERS)) {
  const told = /\/sessions\/.* answered 200 with what is no answer of bagtrack \(/;
  const isTold = (/** @type {any} */ error) =>
    error instanceof Problem && error.status === 200 && !error.isTemporary && told.test(error.message);

  test(`what is no answer of the service is told with its address, and the session goes on: ${name}`, () =>
    withService(async (service) => {
      const snapshot = { request: "GET /sessions/{1}/snapshot", reply };
      const lost = { status: 409, problem: { type: "/docs/problems#frame-out-of-order", expected_frame: 1 } };
      service.exchanges = [
        { ...OPENED, request: "PUT /sessions/{0}", reply },
        OPENED,
        posted(1, "b", reply),
        posted(1, "c", { status: 200, answer: 1 }),
        // The bad snapshot is dropped: the first frame still opens the session again.
        snapshot,
        posted(2, "d", lost),
        // The bad answer to a frame that is sent again does not count: the frame is sent once more.
        posted(1, "c", reply),
        posted(1, "c", { status: 200, answer: 1 }),
        posted(2, "e", { status: 200, answer: 2 }),
        snapshot,
        snapshot,
        { request: "GET /sessions/{1}", reply },
      ];
      const client = clientOf(service.url, { snapshot_every: 1 });
      await assert.rejects(client.open(bytes("a"), boxOf(TABLE.box)), (error) => {
        assert.ok(reply !== PAGE || error.message.endsWith('(text/html): "<html>Please log in</html>"'), error.message);
        assert.doesNotMatch(error.message, /seed/, "the query is long");
        return isTold(error);
      });
      const session = await client.open(bytes("a"), boxOf(TABLE.box));
      await assert.rejects(session.track(bytes("b")), isTold);
      assert.equal((await session.track(bytes("c"))).frame, 1);
      await assert.rejects(session.track(bytes("d")), isTold);
      assert.equal((await session.track(bytes("e"))).frame, 2);
      assert.equal(session.kept.origin?.frame, 0);
      await assert.rejects(session.snapshot(), isTold);
      await assert.rejects(session.read(), isTold);
    }));
}

for (const { name, client, steps } of TABLE.scenarios) {
  test(`exchanges: ${name}`, async () => {
    const service = new ScriptedService();
    await service.start();
    try {
      const caller = new Caller(clientOf(service.url, client));
      for (const { call, exchanges, gives } of steps) {
        service.exchanges = [...exchanges];
        const [verb] = Object.keys(call);
        const given = await caller[verb](call).catch(failure);
        service.check();
        assert.deepEqual(given, gives, JSON.stringify(call));
      }
    } finally {
      service.stop();
    }
  });
}
