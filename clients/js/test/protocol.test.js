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

/** Calls; what they give is in the words of the table. */
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
