// A video that the browser cannot play: the service decodes it, and its frames are images.

import { openImages } from "./images.js";
import { Problem } from "./js/problem.js";

/** The length in bytes of the JPEG file at the beginning of `bytes`; 0 where its end has not arrived yet.
 * @param {Uint8Array} bytes */
function endOfFirst(bytes) {
  let at = 2;
  for (let marker = 0; marker !== 0xda; ) {
    if (at + 4 > bytes.length) return 0;
    marker = bytes[at + 1];
    at += 2 + bytes[at + 2] * 256 + bytes[at + 3];
  }
  // Within the coded pixels, 0xff is followed by 0 or a restart marker only, so ff d9 is the end.
  for (; at + 1 < bytes.length; at += 1) if (bytes[at] === 0xff && bytes[at + 1] === 0xd9) return at + 2;
  return 0;
}

/** Splits a body of concatenated JPEG files.
 * @param {ReadableStream<Uint8Array>} body */
async function* filesOf(body) {
  let rest = new Uint8Array();
  const reader = body.getReader();
  for (;;) {
    const { value, done } = await reader.read();
    if (done) return;
    const bytes = new Uint8Array(rest.length + value.length);
    bytes.set(rest);
    bytes.set(value, rest.length);
    rest = bytes;
    for (let end = endOfFirst(rest); end > 0; end = endOfFirst(rest)) {
      yield rest.slice(0, end);
      rest = rest.subarray(end);
    }
  }
}

/**
 * @param {File} file
 * @param {string} key An API key; empty where the service has none.
 * @param {(count: number) => void} tell Called with the number of frames received so far.
 * @param {AbortSignal} signal
 */
export async function openDecoded(file, key, tell, signal) {
  /** @type {Record<string, string>} */
  const headers = key ? { authorization: `Bearer ${key}` } : {};
  const asked = fetch("./frames", { method: "POST", body: file, headers, signal });
  const response = await asked.catch(() => Promise.reject(new Problem({})));
  if (!response.ok || !response.body) throw new Problem({ ...(await response.json()), status: response.status });
  /** @type {File[]} */
  const images = [];
  try {
    for await (const bytes of filesOf(response.body)) {
      const name = `${file.name}.${String(images.length).padStart(6, "0")}.jpg`;
      images.push(new File([bytes], name, { type: "image/jpeg" }));
      tell(images.length);
    }
  } catch {
    throw new Error(`The service could decode ${images.length} frames of the file, and no more: it is damaged there.`);
  }
  const source = await openImages(images);
  source.name = file.name;
  source.imageNames = undefined;
  return source;
}
