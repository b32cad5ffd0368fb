// Takes the tracker's own snapshot out of a snapshot of the service.
//
// A snapshot of the service is, after its magic, a byte with the version, the length of the content (32 bits), the
// content in DEFLATE, and a code that the service alone can check. The content begins with the tracker's own snapshot
// and its length. The tracker checks its own snapshot, so the code need not be checked here.

import { Problem } from "./problem.js";

const MAGIC = [0x89, ...new TextEncoder().encode("bagtrack\r\n")];
const CODE_BYTES = 32;
/** The version of snapshots of sessions with one target. */
const VERSION = 4;
/** The most bytes of the content of a snapshot. */
const MOST_BYTES = 16 << 20;

/** @param {string} detail */
const refused = (detail) => new Problem({ type: "invalid-snapshot", status: 422, detail });

/** The tracker's own snapshot in one of the service; another one as it is.
 * @param {Uint8Array} snapshot
 * @returns {Promise<Uint8Array>} */
export async function trackerOf(snapshot) {
  if (!MAGIC.every((byte, at) => snapshot[at] === byte)) return snapshot;
  const version = snapshot[MAGIC.length];
  if (version !== VERSION) throw refused("The snapshot is of a session with several targets, or of another version.");
  const from = MAGIC.length + 1;
  const length = new DataView(snapshot.buffer, snapshot.byteOffset + from).getUint32(0, true);
  if (length > MOST_BYTES) throw refused("The snapshot is damaged.");
  const compressed = snapshot.slice(from + 4, snapshot.length - CODE_BYTES);
  const content = await inflated(compressed, length).catch(() => undefined);
  const end = content && varint(content);
  if (!end || end.next + end.value > content.length) throw refused("The snapshot is damaged.");
  return content.subarray(end.next, end.next + end.value);
}

/**
 * @param {Uint8Array<ArrayBuffer>} compressed
 * @param {number} length
 */
async function inflated(compressed, length) {
  const stream = new Blob([compressed]).stream().pipeThrough(new DecompressionStream("deflate-raw"));
  const content = new Uint8Array(length);
  let at = 0;
  for (const reader = stream.getReader(); ; ) {
    const { value, done } = await reader.read();
    if (done) break;
    // Throws if there is more content than the length says.
    content.set(value, at);
    at += value.length;
  }
  if (at !== length) throw new RangeError("less than was said");
  return content;
}

/** A number in bytes of seven bits, the lowest first.
 * @param {Uint8Array} bytes */
function varint(bytes) {
  let value = 0;
  for (let next = 0; next < 5; next += 1) {
    value += (bytes[next] & 0x7f) * 2 ** (7 * next);
    if (bytes[next] < 0x80) return { value, next: next + 1 };
  }
  return undefined;
}
