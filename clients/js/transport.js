// Calls over HTTP: a call that fails for a moment is made again.

import { Problem } from "./problem.js";

const FIRST_PAUSE = 100;
const LONGEST_PAUSE = 5000;
/** The connection is taken for dead when there is no answer for so long. */
const ATTEMPT = 30_000;

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

export class Transport {
  /**
   * @param {string | URL} url Where the service is.
   * @param {string} key An API key or a session token; empty where the service has no keys.
   * @param {number} patience Milliseconds in which a call is made again.
   */
  constructor(url, key, patience) {
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
    const late = Date.now() + (request.patience ?? this.patience);
    for (let wait = FIRST_PAUSE; ; wait = Math.min(2 * wait, LONGEST_PAUSE)) {
      try {
        return await this.attempt(method, this.at(path, request.query), request);
      } catch (error) {
        if (!(error instanceof Problem) || !error.isTemporary) throw error;
        // Clients that were cut off together do not come back together.
        const own = wait * (0.5 + Math.random() / 2);
        const pausing = Math.max(own, 1000 * (error.retryAfter ?? 0));
        if (Date.now() + pausing > late) throw error;
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
    const headers = new Headers();
    if (this.key) headers.set("authorization", `Bearer ${this.key}`);
    if (type) headers.set("content-type", type);
    signal?.throwIfAborted();
    const attempt = new AbortController();
    const abort = () => attempt.abort(signal?.reason);
    signal?.addEventListener("abort", abort, { once: true });
    const timer = setTimeout(() => attempt.abort(), ATTEMPT);
    try {
      const response = await fetch(url, { method, body, headers, signal: attempt.signal });
      if (response.ok) return response;
      const problem = await response.json().catch(() => ({ title: response.statusText }));
      const seconds = Number(response.headers.get("retry-after") ?? undefined);
      throw new Problem({ ...problem, status: response.status }, Number.isFinite(seconds) ? seconds : undefined);
    } catch (error) {
      signal?.throwIfAborted();
      throw error instanceof Problem ? error : new Problem({});
    } finally {
      clearTimeout(timer);
      signal?.removeEventListener("abort", abort);
    }
  }
}
