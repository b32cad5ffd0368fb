// The plain calls of the service.

/** @typedef {{x: number, y: number, width: number, height: number}} Box In pixels of the uploaded frame. */

/** A problem document of the service (RFC 9457), or a failure to reach it. */
export class Problem extends Error {
  /** @param {{type?: string, status?: number, detail?: string}} document */
  constructor(document) {
    super(document.detail ?? "The service cannot be reached.");
    this.slug = (document.type ?? "unreachable").split(":").pop() ?? "";
    this.status = document.status ?? 0;
  }
}

/** Sent with every call, where the service has keys. */
let key = "";

/** @param {string} text */
export function useKey(text) {
  key = text;
}

/**
 * @param {string} method
 * @param {string} path
 * @param {Blob} [body]
 * @returns {Promise<any>}
 */
async function call(method, path, body) {
  const headers = key ? { authorization: `Bearer ${key}` } : undefined;
  let response;
  try {
    response = await fetch(path, { method, body, headers });
  } catch {
    throw new Problem({});
  }
  if (response.status === 204) return undefined;
  if (response.headers.get("content-type") === "image/png") return response.blob();
  const answer = await response.json().catch(() => ({ status: response.status }));
  if (!response.ok) throw new Problem(answer);
  return answer;
}

/**
 * Opens a session on the first frame.
 * @param {Blob} frame
 * @param {Box} box
 * @returns {Promise<{id: string, box: Box}>}
 */
export function openSession(frame, box) {
  const text = [box.x, box.y, box.width, box.height].map((value) => value.toFixed(2)).join(",");
  return call("POST", `/sessions?box=${text}`, frame);
}

/**
 * What a stream needs to be opened: a token where the service has keys.
 * @param {string} id
 * @returns {Promise<string>}
 */
export async function streamToken(id) {
  return key ? (await call("POST", `/sessions/${id}/token`)).token : "";
}

/** @param {string} id */
export function readSession(id) {
  return call("GET", `/sessions/${id}`);
}

/**
 * The bag as a picture.
 * @param {string} id
 * @returns {Promise<Blob>}
 */
export function readBag(id) {
  return call("GET", `/sessions/${id}/bag.png`);
}

/** @param {string} id */
export function endSession(id) {
  return call("DELETE", `/sessions/${id}`).catch(() => undefined);
}
