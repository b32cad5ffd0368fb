// The sample clips, which the service draws.

import { Stills } from "./stills.js";

const FRAMES_A_SECOND = 25;
/** Requests for a frame, until loading fails. */
const ATTEMPTS = 6;

/** @param {string} address */
async function fetched(address) {
  for (let attempt = 1; ; attempt += 1) {
    const response = await fetch(address).catch(() => undefined);
    if (response?.ok) return response;
    if (attempt === ATTEMPTS) throw new Error("The sample clip cannot be loaded. Is the service still running?");
    // The connection may be back in a moment.
    await new Promise((resolve) => setTimeout(resolve, 200 * attempt));
  }
}

/** @param {string} name */
export async function openClip(name) {
  const source = new Stills(name, FRAMES_A_SECOND, async (index) => (await fetched(`./sample/${name}/${index}.jpg`)).blob());
  source.isPaced = source.isFetched = true;
  const first = source.ahead(0);
  const clip = await (await fetched(`./sample/${name}/clip.json`)).json();
  source.count = clip.truth.length;
  source.size = { width: clip.width, height: clip.height };
  await first;
  return source;
}
