// A closer look at the place around the target, with what the tracker compared there.

import { colorOf, paintParticles, shareOf } from "./particles.js";

/** So many of the likeliest ones are shown as boxes. */
const BOXES = 24;
/** The closer look is so many times as wide as the box, at least and at most. */
const [LEAST, MOST] = [1.7, 5];
/** The share of the particles that it has in it. */
const INSIDE = 0.7;
/** How quickly it moves, grows and shrinks. */
const EASE = 0.15;

/** The value that this share of the values is not over.
 * @param {number[]} values
 * @param {number} share */
const inner = (values, share) => [...values].sort((one, other) => one - other)[Math.floor(share * values.length)] ?? 0;

/** The place around the target, with the particles in it as boxes and dots. */
export class Search {
  /** @param {HTMLCanvasElement} canvas */
  constructor(canvas) {
    this.canvas = canvas;
    /** How many times as wide as the box it is. */
    this.wide = LEAST;
    /** From the middle of the box to its own. */
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
    // A lost target is looked for elsewhere.
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

  /** The likeliest particles as boxes, as high for their width as the target's.
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
