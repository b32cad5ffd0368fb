// Turns the frame that a video element shows into a picture for the tracker.

const QUALITY = 0.85;
/** Longest side of an uploaded frame in pixels: the tracker needs no more. */
export const LONGEST_SIDE = 960;

/** Adds a video element to the page: browsers may not decode one that is not in it.
 * @param {HTMLElement} place */
export function addVideo(place) {
  const video = document.createElement("video");
  video.muted = true;
  video.playsInline = true;
  video.preload = "auto";
  video.tabIndex = -1;
  video.setAttribute("aria-hidden", "true");
  place.prepend(video);
  return video;
}

/** Waits until a video can be played.
 * @param {HTMLVideoElement} video */
export function loaded(video) {
  return new Promise((resolve, reject) => {
    video.onloadeddata = resolve;
    video.onerror = () => reject(new DOMException("", "NotSupportedError"));
  });
}

/** Draws the present frame of a video, scaled down to `LONGEST_SIDE`.
 * @param {HTMLVideoElement} video
 * @param {HTMLCanvasElement} [canvas] Where to draw; a new one by default. */
export function drawFrame(video, canvas = document.createElement("canvas")) {
  return drawScaled(video, { width: video.videoWidth, height: video.videoHeight }, canvas);
}

/** Draws an image, scaled down to `LONGEST_SIDE`.
 * @param {CanvasImageSource} image
 * @param {Size} size As it is shown.
 * @param {HTMLCanvasElement} [canvas]
 * @param {number} [rotation] How far it is to be turned clockwise, in degrees: quarters of a turn. */
export function drawScaled(image, size, canvas = document.createElement("canvas"), rotation = 0) {
  const scale = Math.min(1, LONGEST_SIDE / Math.max(size.width, size.height));
  const [width, height] = [size.width, size.height].map((side) => Math.max(1, Math.round(side * scale)));
  if (canvas.width !== width) canvas.width = width;
  if (canvas.height !== height) canvas.height = height;
  const context = canvas.getContext("2d", { willReadFrequently: true });
  context?.translate(width / 2, height / 2);
  context?.rotate((rotation * Math.PI) / 180);
  const [across, down] = rotation % 180 === 0 ? [width, height] : [height, width];
  context?.drawImage(image, -across / 2, -down / 2, across, down);
  context?.resetTransform();
  return canvas;
}

/** Encodes a canvas as JPEG, for the upload.
 * @param {HTMLCanvasElement} canvas
 * @param {number} [quality]
 * @returns {Promise<Blob>} */
export async function encoded(canvas, quality = QUALITY) {
  /** @type {Blob | null} */
  const blob = await new Promise((resolve) => canvas.toBlob(resolve, "image/jpeg", quality));
  if (!blob) throw new Error("The browser cannot encode the frame.");
  return blob;
}
