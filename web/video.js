// Opens a video file: decodes it frame by frame if the page has `VideoDecoder`, else plays it in an element.

import { FrameDecoder, FrameNumbers } from "./decoder.js";
import { openPlayed } from "./file.js";
import { drawScaled, encoded } from "./source.js";
import { Stills, undamaged } from "./stills.js";

/** The index of a file's frames; undefined where it cannot be read, or the browser cannot decode the codec.
 * @param {File} file */
async function indexOf(file) {
  // Over plain http, pages have no `VideoDecoder`.
  if (typeof VideoDecoder === "undefined") return undefined;
  const worker = new Worker(new URL("./indexer.js", import.meta.url), { type: "module" });
  try {
    /** @type {Index | undefined} */
    const index = await new Promise((resolve, reject) => {
      worker.onmessage = ({ data }) => resolve(data);
      worker.onerror = reject;
      worker.postMessage(file);
    });
    if (!index) return undefined;
    const { codec, description } = index;
    const { supported } = await VideoDecoder.isConfigSupported({ codec, description });
    return supported ? index : undefined;
  } catch {
    return undefined;
  } finally {
    worker.terminate();
  }
}

/**
 * @param {File} file
 * @param {HTMLElement} place The parent for a video element.
 * @returns {Promise<Source>}
 */
export async function openVideo(file, place) {
  const opening = openPlayed(file, place);
  const [index, player] = await Promise.all([indexOf(file), opening.catch(() => undefined)]);
  try {
    // The size that an element reports considers the aspect ratio of pixels and the rotation.
    const source = index && (await decodedFile(file, index, player?.size));
    if (source) player?.close();
    return source ?? opening;
  } catch (error) {
    if (!player) throw error;
    return player;
  }
}

/**
 * @param {File} file
 * @param {Index} index
 * @param {Size | undefined} size
 * @returns {Promise<Source>}
 */
async function decodedFile(file, index, size) {
  const frames = new FrameNumbers(index);
  const { times } = frames;
  const mean = (times.length - 1) / (times[times.length - 1] - times[0]);
  const source = new Stills(file.name, mean || 25);
  // A second decoder for frames that the user looks at, so that tracking does not wait for them.
  const [decoder, viewer] = [0, 1].map(() => new FrameDecoder(file, index, frames));
  const pictureOf = async (/** @type {FrameDecoder} */ from, /** @type {number} */ number) => {
    const frame = await from.at(number);
    if (!frame) return undefined;
    size ??= turned({ width: frame.displayWidth, height: frame.displayHeight }, index.rotation);
    const image = drawScaled(frame, size, undefined, index.rotation);
    frame.close();
    return { image, blob: await encoded(image), time: times[number], frame: number };
  };
  source.picture = (number) => pictureOf(decoder, number);
  source.at = async (number) => undamaged(await pictureOf(viewer, number));
  source.close = () => [decoder, viewer].forEach((it) => it.close());
  source.count = times.length;
  source.times = times;
  source.files = [file];
  await source.first();
  source.size = size ?? source.size;
  return source;
}

/** @param {Size} size
 * @param {number} rotation */
function turned({ width, height }, rotation) {
  return rotation % 180 === 0 ? { width, height } : { width: height, height: width };
}
