// The picture with its box and particles.

/** @typedef {import("./js/bagtrack.js").Box} Box */

/** @type {Record<string, string>} Visible on any picture, together with the dark line around them. */
const COLORS = { tracking: "#3ddc97", uncertain: "#ffc24b", lost: "#ff6b5e", drawn: "#ffffff" };

export class Stage {
  /** @param {HTMLCanvasElement} canvas */
  constructor(canvas) {
    this.canvas = canvas;
    this.context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
    /** @type {ImageBitmap | HTMLCanvasElement | undefined} The picture that is shown. */
    this.image = undefined;
    /** @type {import("./js/bagtrack.js").StreamAnswer | undefined} */
    this.answer = undefined;
    /** @type {Box | undefined} The box that is being drawn. */
    this.drawn = undefined;
  }

  /**
   * @param {ImageBitmap | HTMLCanvasElement} image
   * @param {import("./js/bagtrack.js").StreamAnswer} [answer]
   */
  show(image, answer) {
    const { canvas } = this;
    if (this.image && this.image !== image && "close" in this.image) this.image.close();
    this.image = image;
    this.answer = answer;
    if (canvas.width !== image.width || canvas.height !== image.height) {
      [canvas.width, canvas.height] = [image.width, image.height];
      canvas.style.setProperty("--aspect", String(image.width / image.height));
    }
    this.paint();
  }

  /** @param {Box | undefined} drawn */
  draw(drawn) {
    this.drawn = drawn;
    this.paint();
  }

  paint() {
    if (!this.image) return;
    this.context.drawImage(this.image, 0, 0);
    if (this.drawn) {
      paintBox(this.context, this.drawn, "drawn", true);
    } else if (this.answer) {
      this.dots(this.answer.particles ?? []);
      paintBox(this.context, this.answer.box, this.answer.status, this.answer.status === "lost");
    }
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
    if (!this.image || !(box.width > 0 && box.height > 0)) return;
    target.width = target.height = 112;
    const scale = target.width / Math.max(box.width, box.height);
    const [width, height] = [box.width * scale, box.height * scale];
    const left = (target.width - width) / 2;
    const top = (target.height - height) / 2;
    target.getContext("2d")?.drawImage(this.image, box.x, box.y, box.width, box.height, left, top, width, height);
  }
}

/**
 * @param {CanvasRenderingContext2D} context
 * @param {Box} box
 * @param {string} color
 * @param {boolean} isDashed
 */
export function paintBox(context, { x, y, width, height }, color, isDashed) {
  const unit = context.canvas.width / 320;
  context.setLineDash(isDashed ? [5 * unit, 3 * unit] : []);
  for (const [line, style] of /** @type {const} */ ([[2.75, "#000000aa"], [1.25, COLORS[color]]])) {
    context.lineWidth = line * unit;
    context.strokeStyle = style;
    context.strokeRect(x, y, width, height);
  }
  context.setLineDash([]);
}
