// The picture with its box and particles.

/** @typedef {import("./js/bagtrack.js").Box} Box */

/** @type {Record<string, string>} Visible on any picture, together with the dark line around them. */
const COLORS = { tracking: "#3ddc97", uncertain: "#ffc24b", lost: "#ff6b5e", drawn: "#ffffff" };

export class Stage {
  /** @param {HTMLCanvasElement} canvas */
  constructor(canvas) {
    this.canvas = canvas;
    this.context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
    /** @type {ImageBitmap | undefined} The picture that is shown. */
    this.bitmap = undefined;
    /** @type {import("./js/bagtrack.js").StreamAnswer | undefined} */
    this.answer = undefined;
    /** @type {Box | undefined} The box that is being drawn. */
    this.drawn = undefined;
  }

  /**
   * @param {ImageBitmap} bitmap
   * @param {import("./js/bagtrack.js").StreamAnswer} [answer]
   */
  show(bitmap, answer) {
    if (this.bitmap !== bitmap) this.bitmap?.close();
    this.bitmap = bitmap;
    this.answer = answer;
    if (this.canvas.width !== bitmap.width || this.canvas.height !== bitmap.height) {
      this.canvas.width = bitmap.width;
      this.canvas.height = bitmap.height;
    }
    this.paint();
  }

  /** @param {Box | undefined} drawn */
  draw(drawn) {
    this.drawn = drawn;
    this.paint();
  }

  paint() {
    if (!this.bitmap) return;
    this.context.drawImage(this.bitmap, 0, 0);
    if (this.drawn) {
      this.frame(this.drawn, "drawn", true);
    } else if (this.answer) {
      this.dots(this.answer.particles ?? []);
      this.frame(this.answer.box, this.answer.status, this.answer.status === "lost");
    }
  }

  /**
   * @param {Box} box
   * @param {string} color
   * @param {boolean} isDashed
   */
  frame({ x, y, width, height }, color, isDashed) {
    const { context } = this;
    const unit = this.canvas.width / 320;
    context.setLineDash(isDashed ? [5 * unit, 3 * unit] : []);
    for (const [line, style] of /** @type {const} */ ([[2.75, "#000000aa"], [1.25, COLORS[color]]])) {
      context.lineWidth = line * unit;
      context.strokeStyle = style;
      context.strokeRect(x, y, width, height);
    }
    context.setLineDash([]);
  }

  /** @param {number[][]} particles Likeliest first. */
  dots(particles) {
    const { context } = this;
    const unit = this.canvas.width / 320;
    const most = particles[0]?.[3] || 1;
    for (const [x, y, , weight] of [...particles].reverse()) {
      const share = Math.sqrt(weight / most);
      context.beginPath();
      context.arc(x, y, (0.7 + 2.3 * share) * unit, 0, 2 * Math.PI);
      context.fillStyle = `hsl(${190 - 140 * share} 95% 60% / ${0.35 + 0.55 * share})`;
      context.fill();
    }
  }

  /** Copies what is in a box, into a square canvas.
   * @param {HTMLCanvasElement} target
   * @param {Box} box */
  copyPatch(target, box) {
    if (!this.bitmap || !(box.width > 0 && box.height > 0)) return;
    target.width = target.height = 112;
    const scale = target.width / Math.max(box.width, box.height);
    const [width, height] = [box.width * scale, box.height * scale];
    const left = (target.width - width) / 2;
    const top = (target.height - height) / 2;
    target.getContext("2d")?.drawImage(this.bitmap, box.x, box.y, box.width, box.height, left, top, width, height);
  }
}
