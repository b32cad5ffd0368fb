// The first screen: a recorded clip plays with the box that the tracker gave, and the particles that it compared.

import { canvas } from "./dom.js";
import { FRAMES, HEIGHT, WIDTH, drawScene } from "./scene.js";
import { PARTICLES, PARTICLES_EVERY, ROWS } from "./welcome-rows.js";

const FRAMES_A_SECOND = 30;
/** The still for those who do not want motion. */
const STILL = 150;
const COLOR = "#3ddc97";
const LOST = "#ffb4a8";

/** What the tracker gave, in pixels of the scene: numbers of two places to the base 36, in tenths of their box's unit.
 * @param {number} frame */
export function rowOf(frame) {
  const [x, y, width, height, score] = Array.from({ length: 5 }, (_, at) => {
    return parseInt(ROWS.slice(10 * frame + 2 * at, 10 * frame + 2 * at + 2), 36);
  });
  return { box: { x: x / 2, y: y / 2, width: width / 2, height: height / 2 }, score: score / 1000 };
}

/** Places from the middle of the box, likeliest first.
 * @param {number} frame */
function particlesOf(frame) {
  const text = PARTICLES[Math.floor(frame / PARTICLES_EVERY)] ?? "";
  const value = (/** @type {number} */ at) => (text.charCodeAt(at) - 80) * 2;
  return Array.from({ length: text.length / 2 }, (_, at) => [value(2 * at), value(2 * at + 1)]);
}

/** @param {CanvasRenderingContext2D} context
 * @param {number} frame */
function paint(context, frame) {
  drawScene(context, frame);
  const { box, score } = rowOf(frame);
  const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
  particlesOf(frame).forEach(([right, down], at, all) => {
    const share = 1 - at / all.length;
    context.fillStyle = `hsl(${190 - 140 * share} 95% 62% / ${0.25 + 0.5 * share})`;
    context.beginPath();
    context.arc(x + right, y + down, 1.5 + 2.5 * share, 0, 7);
    context.fill();
  });
  const isLost = score < 0.25;
  context.setLineDash(isLost ? [8, 6] : []);
  for (const [line, style] of /** @type {const} */ ([[3.5, "#00000088"], [1.75, isLost ? LOST : COLOR]])) {
    context.lineWidth = line;
    context.strokeStyle = style;
    context.strokeRect(box.x, box.y, box.width, box.height);
  }
  context.setLineDash([]);
  context.fillStyle = isLost ? LOST : COLOR;
  context.fillRect(box.x, box.y - 6, box.width * Math.min(1, score), 2.5);
}

/** Plays the clip as long as the first screen is shown. */
export function playWelcome() {
  const own = canvas("hero");
  // As sharp as where it is shown, up to twice.
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
