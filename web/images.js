// Images as the frames of a video, in the order of their names.

import { GONE, UnplayableError, isReadable } from "./problems.js";
import { LONGEST_SIDE, drawScaled, encoded } from "./source.js";
import { Stills } from "./stills.js";

/** The frame rate for images, which have no times of their own. */
const FRAMES_A_SECOND = 25;
/** Bytes at the beginning of a JPEG file within which the comment with its time ends. */
const LONGEST_COMMENT = 64;
const IMAGE = /\.(jpe?g|png|webp|bmp|gif|avif|hei[cf]|tiff?)$/i;

/** Formats that few browsers read. */
const RARE = /\.(hei[cf]|tiff?)$/i;

/** Whether a file is an image that a browser may show.
 * @param {File} file */
export const isImage = (file) => file.type.startsWith("image/") || IMAGE.test(file.name);

/** @param {File} file */
const pathOf = (file) => file.webkitRelativePath || file.name;

/** The times in seconds that the service writes into the first comment of its JPEG files; undefined for other images.
 * @param {File[]} images */
async function timesIn(images) {
  const times = [];
  for (const image of images) {
    // Each byte that is no valid UTF-8 is read as one character, so `.{6}` is the six bytes before the comment.
    const head = await image.slice(0, LONGEST_COMMENT).text();
    const time = /^.{6}time=(-?[\d.]+)/s.exec(head);
    if (!time) return undefined;
    times.push(Number(time[1]));
  }
  return times;
}

/** Formats with animations, by the endings of names. */
const ANIMATED = /(gif|webp|png|avif)$/i;
/** Matches files of several frames; for GIF, two headers of frames. */
const FRAMES = /^RIFF.{4}WEBPVP8X.*ANMF|^.PNG.*acTL|\x00!\xf9\x04.{4}\x00[,!].*\x00!\xf9\x04.{4}\x00[,!]/s;
/** How long a frame is shown, in microseconds. A time of none, or up to 10 ms, counts as 100 ms, as browsers do.
 * @param {VideoFrame | undefined} frame */
const shownFor = (frame) => (Number(frame?.duration) > 1e4 ? Number(frame?.duration) : 1e5);

/** Opens an animation; undefined where the file is a still image.
 * @param {File} file
 * @returns {Promise<Source | undefined>} */
export async function openAnimated(file) {
  const format = ANIMATED.exec(file.type || file.name)?.[0].toLowerCase();
  if (!format) return undefined;
  const data = await file.arrayBuffer();
  // Over plain http, pages have no `ImageDecoder`.
  if (typeof ImageDecoder === "undefined") {
    if (FRAMES.test(new TextDecoder("latin1").decode(data))) throw new UnplayableError(file);
    return undefined;
  }
  const decoder = new ImageDecoder({ data, type: `image/${format}` });
  await Promise.all([decoder.tracks.ready, decoder.completed]).catch(() => undefined);
  const count = decoder.tracks.selectedTrack?.frameCount ?? 0;
  /** @type {Blob[]} By frame; empty at damaged ones. Encoded here, since some browsers decode each frame only once. */
  const blobs = [];
  const source = new Stills(file.name, FRAMES_A_SECOND, async (index) => blobs[index]);
  source.times = [];
  for (let index = 0, time = 0; count > 1 && index < count; index += 1) {
    const decoded = await decoder.decode({ frameIndex: index }).catch(() => undefined);
    const frame = decoded?.image;
    source.times.push(time / 1e6);
    time += shownFor(frame);
    if (!frame) continue;
    if (!source.size.width) source.size = { width: frame.displayWidth, height: frame.displayHeight };
    blobs[index] = await encoded(drawScaled(frame, source.size));
    frame.close();
  }
  decoder.close();
  if (count < 2) return undefined;
  const picture = source.picture.bind(source);
  source.picture = async (index) => (blobs[index] ? picture(index) : undefined);
  source.count = count;
  source.rate = (count - 1) / source.duration;
  source.files = [file];
  return source;
}

/** @param {File[]} files Images, all of one size.
 * @param {string[]} [names] The paths in their folder, in the order of `files`, if these were opened before. */
export async function openImages(files, names) {
  const order = new Intl.Collator("en", { numeric: true });
  let images = files.filter(isImage);
  if (!names) images.sort((one, other) => order.compare(pathOf(one), pathOf(other)));
  if (images.length === 0) throw new DOMException("", "NotSupportedError");
  const [rare, others] = [true, false].map((isRare) => images.filter(({ name }) => RARE.test(name) === isRare));
  const isLeftOut = !names && others[0] && rare[0] && !(await createImageBitmap(rare[0]).catch(() => undefined));
  if (isLeftOut) images = others;
  const folder = pathOf(images[0]).split("/").slice(0, -1).pop();
  /** @type {{width: number, height: number} | undefined} */
  let size;
  const source = new Stills(folder || images[0].name, FRAMES_A_SECOND, async (index) => images[index]);
  const picture = source.picture.bind(source);
  source.picture = async (index) => {
    const shown = await picture(index).catch(() => undefined);
    const { name } = images[index];
    if (!shown) {
      if (!(await isReadable(images[index]))) throw GONE;
      const hint = /\.(jpe?g|png)$/i.test(name) ? "" : " JPEG and PNG open in all.";
      throw new Error(`${name} is not an image that this browser can read.${hint}`);
    }
    const { width, height } = shown.image;
    size ??= { width, height };
    if (width !== size.width || height !== size.height) {
      throw new Error(`${name} has ${width} x ${height} pixels, the first image ${size.width} x ${size.height}.`);
    }
    if (Math.max(width, height) <= LONGEST_SIDE) return shown;
    const image = drawScaled(shown.image, size);
    return { ...shown, image, blob: await encoded(image) };
  };
  source.count = images.length;
  source.times = await timesIn(images);
  if (source.times && source.duration > 0) source.rate = (images.length - 1) / source.duration;
  await source.first();
  source.size = size ?? source.size;
  source.files = images;
  const more = rare.length > 1 ? ` and ${rare.length - 1} more` : "";
  if (isLeftOut) source.note = ` Left out, for this browser cannot read it: ${rare[0].name}${more}.`;
  // The paths within the chosen folder, without its name.
  source.imageNames = names ?? images.map((image) => pathOf(image).replace(/^[^/]*\//, ""));
  return source;
}
