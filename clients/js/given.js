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
