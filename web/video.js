// Frames of a video file or of the camera.

/**
 * @typedef {import("./clip.js").Picture} Picture
 * @typedef {import("./clip.js").Source} Source
 */

const QUALITY = 0.85;
/** Longest side of an uploaded frame in pixels: the tracker needs no more. */
const LONGEST_SIDE = 960;

/**
 * The frames of a playing video element.
 * @implements {Source}
 */
export class PlayedVideo {
  /**
   * @param {HTMLVideoElement} video Ready to play.
   * @param {MediaStream} [camera]
   */
  constructor(video, camera) {
    this.video = video;
    this.camera = camera;
    this.isLive = camera !== undefined;
    this.isHeld = false;
    this.isStopped = false;
    this.canvas = document.createElement("canvas");
    const scale = Math.min(1, LONGEST_SIDE / Math.max(video.videoWidth, video.videoHeight));
    this.canvas.width = Math.round(video.videoWidth * scale);
    this.canvas.height = Math.round(video.videoHeight * scale);
  }

  /** @returns {Promise<Picture>} */
  async first() {
    return this.grab();
  }

  /** @returns {Promise<Picture>} */
  async grab() {
    const { canvas, video } = this;
    const time = video.currentTime;
    canvas.getContext("2d")?.drawImage(video, 0, 0, canvas.width, canvas.height);
    /** @type {Promise<Blob | null>} */
    const encoded = new Promise((resolve) => canvas.toBlob(resolve, "image/jpeg", QUALITY));
    const bitmap = await createImageBitmap(canvas);
    const blob = await encoded;
    if (!blob) throw new Error("The browser cannot encode the frame.");
    return { blob, bitmap, time };
  }

  /**
   * @param {(picture: Picture) => void} deliver
   * @param {() => void} end
   */
  async start(deliver, end) {
    const { video } = this;
    let isBusy = false;
    const next = async () => {
      if (this.isStopped) return;
      video.requestVideoFrameCallback(next);
      if (isBusy || this.isHeld) return;
      isBusy = true;
      const picture = await this.grab();
      isBusy = false;
      if (!this.isStopped) deliver(picture);
    };
    video.requestVideoFrameCallback(next);
    video.onended = () => {
      if (!this.isStopped) end();
    };
    await video.play();
  }

  /** @param {boolean} isHeld */
  hold(isHeld) {
    this.isHeld = isHeld;
    if (this.isLive) return;
    if (isHeld) this.video.pause();
    else this.video.play();
  }

  stop() {
    this.isStopped = true;
    this.video.pause();
    this.camera?.getTracks().forEach((track) => track.stop());
    if (!this.camera) URL.revokeObjectURL(this.video.src);
  }
}

/** @param {HTMLVideoElement} video */
function loaded(video) {
  video.muted = true;
  video.playsInline = true;
  return new Promise((resolve, reject) => {
    video.onloadeddata = resolve;
    video.onerror = () => reject(new DOMException("", "NotSupportedError"));
  });
}

/** @param {File} file */
export async function openFile(file) {
  const video = document.createElement("video");
  const ready = loaded(video);
  video.src = URL.createObjectURL(file);
  await ready;
  return new PlayedVideo(video);
}

export async function openCamera() {
  if (!navigator.mediaDevices) throw new DOMException("", "NotFoundError");
  const wanted = { width: { ideal: 640 }, height: { ideal: 480 }, facingMode: "environment" };
  const camera = await navigator.mediaDevices.getUserMedia({ video: wanted });
  const video = document.createElement("video");
  const ready = loaded(video);
  video.srcObject = camera;
  await ready;
  await video.play();
  return new PlayedVideo(video, camera);
}
