// The first screen plays a drawn clip, with recorded boxes and particles of the tracker.

import { canvas } from "./dom.js";
import { FRAMES, HEIGHT, WIDTH, drawScene } from "./scene.js";
import { paintBox } from "./stage.js";
import { PARTICLES, ROWS } from "./welcome-rows.js";

const FRAMES_A_SECOND = 30;
/** The frame for users who prefer reduced motion. */
const STILL = 150;
/** Height of a box for a width of 1. */
const HEIGHT_OF_BOX = 73 / 128;
/** The number of frames that share their particles, and the number of particles. */
const [EVERY, SHOWN] = [4, 16];

/** The tracker's box in a frame, in pixels of the scene.
 * @param {number} frame */
export function boxOf(frame) {
  const [x, y, width] = [0, 2, 4].map((at) => 6 * frame + at).map((at) => parseInt(ROWS.slice(at, at + 2), 36) / 2);
  return { x, y, width, height: width * HEIGHT_OF_BOX };
}

/** The particles in a frame, relative to the middle of the box, likeliest first. The first `EVERY` frames have none.
 * @param {number} frame */
function particlesOf(frame) {
  const from = (Math.floor(frame / EVERY) - 1) * SHOWN;
  const value = (/** @type {number} */ at) => (PARTICLES.charCodeAt(at) - 80) * 2;
  return Array.from({ length: from < 0 ? 0 : SHOWN }, (_, at) => [value(2 * (from + at)), value(2 * (from + at) + 1)]);
}

/** @param {CanvasRenderingContext2D} context
 * @param {number} frame */
function paint(context, frame) {
  drawScene(context, frame);
  const box = boxOf(frame);
  const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
  particlesOf(frame).forEach(([right, down], at) => {
    const share = 1 - at / SHOWN;
    context.fillStyle = `hsl(${190 - 140 * share} 95% 62% / ${0.25 + 0.5 * share})`;
    context.beginPath();
    context.arc(x + right, y + down, 1.5 + 2.5 * share, 0, 7);
    context.fill();
  });
  paintBox(context, { box, color: "#3ddc97", name: "", isLost: false, isChosen: true }, 0.75);
}

/** Plays the clip as long as the first screen is shown. */
export function playWelcome() {
  const own = canvas("hero");
  // The resolution of the screen, up to twice that of the scene.
  const scale = Math.min(2, Math.max(1, (own.clientWidth * devicePixelRatio) / WIDTH));
  [own.width, own.height] = [WIDTH * scale, HEIGHT * scale];
  const context = /** @type {CanvasRenderingContext2D} */ (own.getContext("2d"));
  context.scale(own.width / WIDTH, own.height / HEIGHT);
  const still = matchMedia("(prefers-reduced-motion: reduce)");
  let painted = -1;
  /** @param {number} now */
  const next = (now) => {
    requestAnimationFrame(next);
    const frame = still.matches ? STILL : Math.floor((now * FRAMES_A_SECOND) / 1000) % FRAMES;
    if (frame === painted || own.hidden) return;
    painted = frame;
    paint(context, frame);
  };
  requestAnimationFrame(next);
}
