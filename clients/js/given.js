// What callers give: checked before anything of it is sent or kept.

import { Problem } from "./problem.js";

/** @param {string} detail */
const unsupported = (detail) => new Problem({ type: "unsupported-image", status: 415, detail });

/** Refuses what is no image for a tracker here.
 * @param {unknown} image */
export function checkImage(image) {
  if (typeof image === "object" && image !== null) return;
  throw unsupported("An image is { width, height, data }, planes, a picture, a video or a Blob.");
}

/** The box itself, which its owner may change afterwards; or a refusal.
 * @param {import("./session.js").Box} box
 * @returns {import("./session.js").Box} */
export function boxOf(box) {
  const { x, y, width, height } = box ?? {};
  if ([x, y, width, height].every(Number.isFinite)) return { x, y, width, height };
  const detail = "A box is { x, y, width, height }, four finite numbers.";
  throw new Problem({ type: "invalid-box", status: 422, detail });
}

/** @param {import("./session.js").Box} box */
export function boxText(box) {
  return Object.values(boxOf(box)).map((side) => Number(side.toFixed(4))).join(",");
}
