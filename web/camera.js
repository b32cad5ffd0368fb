// The frames of the camera: always the newest one.

import { addVideo, drawFrame, encoded, loaded } from "./source.js";

/** @implements {Source} */
export class Camera {
  /**
   * @param {HTMLVideoElement} video Plays the stream already.
   * @param {MediaStream} stream
   */
  constructor(video, stream) {
    this.video = video;
    this.stream = stream;
    this.name = "camera";
    this.isLive = true;
    this.size = { width: video.videoWidth, height: video.videoHeight };
    this.skipped = 0;
    this.isHeld = false;
    this.isStopped = false;
    this.isShown = false;
    this.canvas = document.createElement("canvas");
    /** The `currentTime` of the video at the first frame, in seconds. */
    this.firstTime = 0;
    this.last = { frame: 0, time: 0 };
  }

  get rate() {
    const { frame, time } = this.last;
    return frame > 0 ? frame / time : undefined;
  }

  /** Shows what the camera sees, until `first` is called.
   * @param {(image: HTMLCanvasElement) => void} show */
  preview(show) {
    this.isShown = true;
    const next = () => {
      if (this.isStopped || !this.isShown) return;
      show(drawFrame(this.video, this.canvas));
      this.video.requestVideoFrameCallback(next);
    };
    next();
  }

  /** Takes the present picture of the camera as the first frame. */
  async first() {
    this.isShown = false;
    this.firstTime = this.video.currentTime;
    const image = drawFrame(this.video);
    return { image, blob: await encoded(image), time: 0, frame: 0 };
  }

  /** @type {Source["start"]} */
  start(deliver) {
    const { video } = this;
    let isBusy = false;
    /** @type {number | undefined} */
    let shown;
    return new Promise((_, reject) => {
      const take = async () => {
        const { frame, time } = this.last;
        const image = drawFrame(video);
        isBusy = true;
        const blob = await encoded(image).catch(reject);
        isBusy = false;
        if (blob && !this.isStopped) deliver({ image, blob, time, frame });
      };
      /** @type {VideoFrameRequestCallback} */
      const next = (_, { presentedFrames }) => {
        if (this.isStopped) return;
        video.requestVideoFrameCallback(next);
        const steps = presentedFrames - (shown ?? presentedFrames - 1);
        shown = presentedFrames;
        this.last = { frame: this.last.frame + steps, time: video.currentTime - this.firstTime };
        const isSkipped = isBusy || this.isHeld;
        this.skipped += isSkipped ? steps : steps - 1;
        if (!isSkipped) take();
      };
      video.requestVideoFrameCallback(next);
      const [track] = this.stream.getVideoTracks();
      track.onended = () => reject(new DOMException("", "CameraNotReadableError"));
    });
  }

  /** @param {boolean} isHeld */
  hold(isHeld) {
    this.isHeld = isHeld;
  }

  stop() {
    this.isStopped = true;
    this.stream.getTracks().forEach((track) => track.stop());
    this.video.remove();
  }
}

/** @param {HTMLElement} place */
export async function openCamera(place) {
  // Browsers give the camera to pages over https and from localhost only.
  if (!isSecureContext) throw new DOMException("", "SecurityError");
  if (!navigator.mediaDevices) throw new DOMException("", "CameraNotFoundError");
  const wanted = { width: { ideal: 640 }, height: { ideal: 480 }, facingMode: "environment" };
  const stream = await navigator.mediaDevices.getUserMedia({ video: wanted }).catch(({ name, message }) => {
    throw new DOMException(message, /^Not/.test(name) ? `Camera${name}` : name);
  });
  const video = addVideo(place);
  const ready = loaded(video);
  video.srcObject = stream;
  await ready;
  await video.play();
  return new Camera(video, stream);
}
