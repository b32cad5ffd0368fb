// PNG files of the sample clip: 8 bits, RGB.

import { inflateSync } from "node:zlib";

const HEADER = 8;

/** @param {Uint8Array} file */
export function decodePng(file) {
  const view = new DataView(file.buffer, file.byteOffset, file.byteLength);
  const parts = [];
  for (let at = HEADER; at < file.length; at += 12 + view.getUint32(at)) {
    const name = String.fromCharCode(...file.subarray(at + 4, at + 8));
    if (name === "IDAT") parts.push(file.subarray(at + 8, at + 8 + view.getUint32(at)));
  }
  const [width, height] = [view.getUint32(16), view.getUint32(20)];
  if (view.getUint16(24) !== 0x0802 || file[28] !== 0) throw new Error("not 8 bits of RGB, in one pass");
  return { width, height, data: unfiltered(inflateSync(Buffer.concat(parts)), width, height) };
}

/** RGBA of the filtered rows. */
function unfiltered(/** @type {Uint8Array} */ filtered, /** @type {number} */ width, /** @type {number} */ height) {
  const bytes = 3 * width;
  let above = new Uint8Array(bytes);
  const rgba = new Uint8Array(4 * width * height).fill(255);
  for (let y = 0; y < height; y += 1) {
    const filter = filtered[y * (bytes + 1)];
    const row = filtered.slice(y * (bytes + 1) + 1, (y + 1) * (bytes + 1));
    for (let x = 0; x < bytes; x += 1) {
      const [left, corner] = x < 3 ? [0, 0] : [row[x - 3], above[x - 3]];
      row[x] += [0, left, above[x], (left + above[x]) >> 1, paeth(left, above[x], corner)][filter];
    }
    for (let x = 0; x < width; x += 1) rgba.set(row.subarray(3 * x, 3 * x + 3), 4 * (y * width + x));
    above = row;
  }
  return rgba;
}

function paeth(/** @type {number} */ left, /** @type {number} */ above, /** @type {number} */ corner) {
  const [a, b, c] = [above - corner, left - corner, left + above - 2 * corner].map(Math.abs);
  return a <= b && a <= c ? left : b <= c ? above : corner;
}
