// A close-up of the place around the target, with the particles that the tracker compared there.

import { colorOf, paintParticles, shareOf } from "./particles.js";

/** How many of the likeliest particles are shown as boxes. */
const BOXES = 24;
/** The least and largest width of the close-up, in multiples of the longer side of the box. */
const [LEAST, MOST] = [1.7, 5];
/** The share of the particles that are inside the close-up. */
const INSIDE = 0.7;
/** The share of the way to its new place and size that the close-up goes in each frame. */
const EASE = 0.15;

/** The quantile of the values at this share.
 * @param {number[]} values
 * @param {number} share */
const inner = (values, share) => [...values].sort((one, other) => one - other)[Math.floor(share * values.length)] ?? 0;

/** The place around the target, with the particles in it as boxes and dots. */
export class Search {
  /** @param {HTMLCanvasElement} canvas */
  constructor(canvas) {
    this.canvas = canvas;
    /** The width of the close-up, in multiples of the longer side of the box. */
    this.wide = LEAST;
    /** From the middle of the box to that of the close-up, in pixels. */
    this.off = [0, 0];
  }

  /**
   * @param {ImageBitmap | HTMLCanvasElement} image
   * @param {Box} box
   * @param {number[][]} particles Likeliest first.
   * @param {string} color Of the object.
   */
  show(image, box, particles, color) {
    const { canvas } = this;
    const context = canvas.getContext("2d");
    const width = (canvas.width = Math.round(canvas.clientWidth * devicePixelRatio));
    const height = (canvas.height = Math.round(canvas.clientHeight * devicePixelRatio));
    if (!context || width === 0) return;
    const middle = [box.x + box.width / 2, box.y + box.height / 2];
    const longest = Math.max(box.width, box.height);
    // Follows the particles rather than the box: the tracker searches for a lost target elsewhere.
    this.off = this.off.map((off, side) => off + EASE * (inner(particles.map((it) => it[side] - middle[side]), 0.5) - off));
    const [x, y] = middle.map((value, side) => value + this.off[side]);
    const far = particles.map(([left, top]) => Math.max(Math.abs(left - x), Math.abs(top - y)));
    const reach = 2 * inner(far, INSIDE) + longest;
    this.wide += EASE * (Math.min(Math.max(reach / longest, LEAST), MOST) - this.wide);
    const scale = Math.min(width, height) / (this.wide * longest);
    const unit = devicePixelRatio / scale;
    context.setTransform(scale, 0, 0, scale, width / 2 - scale * x, height / 2 - scale * y);
    context.drawImage(image, 0, 0);
    context.fillStyle = "#0b0c0f80";
    context.fillRect(0, 0, image.width, image.height);
    this.boxes(context, box, particles, unit);
    paintParticles(context, particles, unit);
    context.lineWidth = 2 * unit;
    context.strokeStyle = color;
    context.strokeRect(box.x, box.y, box.width, box.height);
  }

  /** Paints the likeliest particles as boxes with the aspect ratio of the target's.
   * @param {CanvasRenderingContext2D} context
   * @param {Box} box
   * @param {number[][]} particles
   * @param {number} unit */
  boxes(context, box, particles, unit) {
    const most = particles[0]?.[3] || 1;
    const aspect = box.height / box.width;
    context.lineWidth = unit;
    for (const particle of particles.slice(0, BOXES)) {
      const [x, y, width] = particle;
      const share = shareOf(particle, most);
      context.strokeStyle = colorOf(share, 0.1 + 0.35 * share);
      context.strokeRect(x - width / 2, y - (width * aspect) / 2, width, width * aspect);
    }
  }
}
