// A service that gives the replies of a script, and says where a request is not the script's. docs/PROTOCOL.md describes
// the scripts, which are in tests/protocol/exchanges.json.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { createServer } from "node:http";

export const TABLE = JSON.parse(readFileSync(new URL("../../../tests/protocol/exchanges.json", import.meta.url), "utf8"));
const SNAPSHOT = "application/vnd.bagtrack.snapshot";
const DRAWN_SEED = "7";

/** @typedef {Record<string, any>} Exchange */

/** @param {string} box */
const numbers = (box) => box.split(",").map(Number);

export class ScriptedService {
  /** @type {Exchange[]} */
  exchanges = [];
  /** @type {Map<string, string>} The sessions' ids, by their names in the script. */
  ids = new Map();
  /** @type {string | undefined} */
  seed = undefined;
  /** @type {string[]} */
  complaints = [];

  async start() {
    this.server = createServer(async (request, response) => {
      const parts = [];
      for await (const part of request) parts.push(part);
      this.answer(request, Buffer.concat(parts).toString(), response);
    });
    await new Promise((resolve) => this.server.listen(0, "127.0.0.1", () => resolve(undefined)));
    this.url = `http://127.0.0.1:${this.server.address().port}`;
  }

  /** Asserts that all requests of the script came, and no others. */
  check() {
    assert.deepEqual(this.complaints, []);
    assert.deepEqual(this.exchanges, [], "not asked");
  }

  stop() {
    this.server.closeAllConnections();
    this.server.close();
  }

  answer(request, body, response) {
    const asked = `${request.method} ${request.url} ${body}`;
    const exchange = this.exchanges.shift();
    if (!exchange) {
      this.complaints.push(`asked after the script's end: ${asked}`);
      return response.writeHead(400).end();
    }
    try {
      this.reply(exchange.reply, this.compare(exchange, request, body), response);
    } catch (error) {
      this.complaints.push(`${asked} in place of ${JSON.stringify(exchange)}: ${error.message}`);
      response.writeHead(400).end();
    }
  }

  /** Compares a request with that of the exchange. Returns the session's id if they agree. */
  compare(exchange, request, body) {
    const [method, target] = exchange.request.split(" ");
    const [wanted, came] = [target, request.url].map((path) => new URL(path, this.url));
    const [, , name, ...below] = decodeURIComponent(wanted.pathname).split("/");
    const [, root, id, ...rest] = came.pathname.split("/");
    assert.deepEqual([request.method, root, ...rest], [method, "sessions", ...below]);
    if (!this.ids.has(name)) {
      assert.ok(method === "PUT" && /^[0-9a-f]{8}(-[0-9a-f]{4}){3}-[0-9a-f]{12}$/.test(id), "the new id");
      assert.ok(![...this.ids.values()].includes(id), "the id is new");
      this.ids.set(name, id);
    }
    assert.equal(id, this.ids.get(name), "the session's id");
    this.seed ??= came.searchParams.get("seed") ?? DRAWN_SEED;
    for (const [key, value] of wanted.searchParams) {
      const found = came.searchParams.get(key);
      if (key === "box") assert.deepEqual(numbers(found ?? ""), numbers(value));
      else assert.equal(found, value.replace("{seed}", this.seed), key);
    }
    assert.equal(body, exchange.frame ?? exchange.snapshot ?? "", "the body");
    assert.equal(request.headers["content-type"] === SNAPSHOT, "snapshot" in exchange, "the media type");
    return id;
  }

  reply(reply, id, response) {
    if (reply === "none") return response.socket.destroy();
    if (reply === "half") {
      const half = 'HTTP/1.1 200 OK\r\nContent-Type: application/json\r\nContent-Length: 100\r\n\r\n{"frame"';
      return response.socket.end(half);
    }
    const { status, headers, answer, created, problem, snapshot, text, json } = reply;
    let type = snapshot === undefined ? "text/html" : SNAPSHOT;
    let content = snapshot ?? text ?? "";
    if (problem) content = JSON.stringify({ status, ...problem });
    const frame = answer ?? created;
    if (frame !== undefined) {
      const told = { frame, box: { x: frame, y: 2, width: 30.5, height: 40 }, score: 0.5, status: "tracking" };
      const more = created === undefined ? {} : { id, parameters: { seed: Number(this.seed) } };
      content = JSON.stringify({ ...told, ...more });
    }
    if (json !== undefined) content = JSON.stringify(json);
    if (snapshot === undefined && text === undefined) type = "application/json";
    response.writeHead(status, { Connection: "close", "Content-Type": type, ...headers }).end(content);
  }
}
