// Calls over HTTP: a call that fails for a moment is made again.

import { Backoff } from "./backoff.js";
import { SNAPSHOT } from "./kept.js";
import { Problem } from "./problem.js";

const ATTEMPT = 30_000;

/** A connection is taken for dead when there is no answer for so many milliseconds, with so many bytes on their way.
 * @param {number} bytes */
export const longest = (bytes) => ATTEMPT + bytes / 50;

/** @param {any} body */
const sizeOf = (body) => body?.byteLength ?? body?.size ?? body?.length ?? 0;

/**
 * @typedef {object} Request
 * @property {Record<string, string | number | undefined>} [query]
 * @property {BodyInit} [body]
 * @property {string} [type] The media type of the body.
 * @property {AbortSignal} [signal]
 * @property {number} [patience] Milliseconds in which the call is made again; as the client's when left out.
 */

/**
 * Waits, or fails as soon as the signal says so.
 * @param {number} milliseconds
 * @param {AbortSignal} [signal]
 * @returns {Promise<void>}
 */
export function pause(milliseconds, signal) {
  return new Promise((resolve, reject) => {
    const abort = () => {
      clearTimeout(timer);
      reject(signal?.reason);
    };
    const timer = setTimeout(() => {
      signal?.removeEventListener("abort", abort);
      resolve();
    }, milliseconds);
    signal?.addEventListener("abort", abort, { once: true });
  });
}

/**
 * What an answer says. A problem where it is none of the service's, such as a page of a proxy.
 * @param {Response} response
 * @param {...string} members What its document has.
 * @returns {Promise<any>}
 */
export async function documentOf(response, ...members) {
  const text = await response.text();
  try {
    const document = JSON.parse(text);
    if (members.every((member) => document[member] !== undefined)) return document;
  } catch {
    // A text that is no JSON is reported below.
  }
  throw notUnderstood(response, text);
}

/** The snapshot in an answer.
 * @param {Response} response */
export async function snapshotOf(response) {
  if (response.headers.get("content-type") !== SNAPSHOT) throw notUnderstood(response, await response.text());
  return new Uint8Array(await response.arrayBuffer());
}

/** The problem that tells what came in place of an answer, and from where.
 * @param {Response} response
 * @param {string} text */
function notUnderstood({ url, status, headers }, text) {
  const came = headers.get("content-type") ?? "no content type";
  const from = url.replace(/\?.*/s, "");
  const begin = JSON.stringify(text.slice(0, 60));
  const detail = `${from} answered ${status} with what is no answer of bagtrack (${came}): ${begin}`;
  return new Problem({ type: "", status, detail });
}

/** The key without the line break at the end of its file. Throws for a bad key, without showing it: messages go into
 * logs.
 * @param {string} key */
function keyOf(key) {
  const own = key.trim();
  if (/^[ -~]+$/.test(own)) return own;
  throw new TypeError("The key has characters that no header takes: it is one line of printable ASCII.");
}

/** The seconds of the header `Retry-After`, if it is there: it is a number, or from some proxies a date.
 * @param {Headers} headers */
function retryAfter(headers) {
  const said = headers.get("retry-after") ?? "";
  const seconds = said ? Number(said) : NaN;
  if (Number.isFinite(seconds)) return seconds;
  // Counted from the answer's own date, since the clock here may be wrong.
  const now = dateOf(headers.get("date")) ?? Date.now();
  const until = dateOf(said);
  return until && Math.max(0, (until - now) / 1000);
}

/**
 * The three forms of a date in HTTP (RFC 9110, 5.6.7). Without this check, `Date.parse` takes many other texts for
 * dates.
 */
const DATE = /^(\w{3}, \d\d \w{3} \d{4}|\w{6,9}, \d\d-\w{3}-\d\d) [\d:]{8} GMT$|^\w{3} \w{3} [ \d]\d [\d:]{8} \d{4}$/;

/** The time in milliseconds; `undefined` if the text is no date.
 * @param {string | null} said */
function dateOf(said) {
  if (!said || !DATE.test(said)) return undefined;
  // The third form names no time zone; it is in GMT, too.
  return Date.parse(said.endsWith("GMT") ? said : `${said} GMT`) || undefined;
}

/** The problem of a call without an answer. Node.js tells why there is none; browsers do not.
 * @param {any} error */
function unreachable(error) {
  const { message } = error?.cause ?? {};
  const problem = new Problem(message ? { detail: `The service cannot be reached: ${message.trim()}.` } : {});
  problem.cause = error;
  return problem;
}

/** Whether the service's certificate was refused, which another try would not mend.
 * @param {Problem} problem */
function isCertificateRefused({ cause }) {
  const { code } = /** @type {any} */ (cause)?.cause ?? {};
  return /CERT|^UNABLE_TO_(GET|VERIFY)/.test(code ?? "");
}

export class Transport {
  /**
   * @param {string | URL} url Where the service is.
   * @param {string} key An API key or a session token; empty where the service has no keys.
   * @param {number} patience Milliseconds in which a call is made again.
   */
  constructor(url, key, patience) {
    // `localhost:8080` parses as a URL, with the scheme `localhost`; `/service` and the empty text do not parse.
    if (!/^\s*https?:/i.test(String(url)))
      throw new TypeError(`The address ${url} does not begin with http:// or https://.`);
    this.url = new URL(url);
    if (!this.url.pathname.endsWith("/")) this.url.pathname += "/";
    this.key = key;
    this.patience = patience;
  }

  /**
   * @param {string} path Below the service's address.
   * @param {Request["query"]} [query]
   */
  at(path, query = {}) {
    const url = new URL(path, this.url);
    for (const [name, value] of Object.entries(query)) {
      if (value !== undefined) url.searchParams.append(name, String(value));
    }
    return url;
  }

  /**
   * Makes a call, again and again while it fails for a moment: every call of this client can be made twice.
   * @param {string} method
   * @param {string} path
   * @param {Request} [request]
   * @returns {Promise<Response>} A good answer.
   */
  async call(method, path, request = {}) {
    const patience = request.patience ?? this.patience;
    const backoff = new Backoff(patience);
    // A connection that was idle for long may break at its next use: the first failure is tried again at once.
    let hasBroken = patience === 0;
    for (;;) {
      try {
        return await this.attempt(method, this.at(path, request.query), request);
      } catch (error) {
        if (!(error instanceof Problem) || !error.isTemporary || isCertificateRefused(error)) throw error;
        if (error.status === 0 && !hasBroken) {
          hasBroken = true;
          continue;
        }
        const pausing = backoff.next(1000 * (error.retryAfter ?? 0));
        if (pausing === undefined) throw error;
        await pause(pausing, request.signal);
      }
    }
  }

  /**
   * @param {string} method
   * @param {URL} url
   * @param {Request} request
   */
  async attempt(method, url, { body, type, signal }) {
    if (url.username || url.password)
      throw new TypeError("The address has a name or a password, with which no request is sent: give a key.");
    const headers = new Headers();
    if (this.key) headers.set("authorization", `Bearer ${keyOf(this.key)}`);
    if (type) headers.set("content-type", type);
    signal?.throwIfAborted();
    const attempt = new AbortController();
    const abort = () => attempt.abort(signal?.reason);
    signal?.addEventListener("abort", abort, { once: true });
    const parts = body instanceof FormData ? [...body.values()] : [body];
    const bytes = parts.reduce((sum, part) => sum + sizeOf(part), 0);
    const timer = setTimeout(() => attempt.abort(), longest(bytes));
    try {
      const response = await fetch(url, { method, body, headers, signal: attempt.signal });
      // The body is read here, so that a line that breaks meanwhile is a failure that is tried again.
      if (response.ok) {
        const whole = new Response(response.status === 204 ? null : await response.arrayBuffer(), response);
        // A new `Response` has no address; this is the answer's, after redirections.
        return Object.defineProperty(whole, "url", { value: response.url });
      }
      const problem = await response.json().catch(() => ({ title: response.statusText }));
      throw new Problem({ ...problem, status: response.status }, retryAfter(response.headers));
    } catch (error) {
      signal?.throwIfAborted();
      throw error instanceof Problem ? error : unreachable(error);
    } finally {
      clearTimeout(timer);
      signal?.removeEventListener("abort", abort);
    }
  }
}
