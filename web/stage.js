// The picture with its box and particles.

/** @typedef {import("./js/bagtrack.js").Box} Box */

/**
 * @typedef {object} Shown An object in the picture.
 * @property {Box} box In pixels of the picture.
 * @property {string} color
 * @property {string} name Empty where there is one object alone.
 * @property {boolean} isLost
 */

/** Of a box that is being drawn. */
const DRAWN = "#ffffff";

export class Stage {
  /** @param {HTMLCanvasElement} canvas */
  constructor(canvas) {
    this.canvas = canvas;
    this.context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
    /** @type {ImageBitmap | HTMLCanvasElement | undefined} The picture that is shown. */
    this.image = undefined;
    /** @type {Shown[]} */
    this.objects = [];
    /** @type {number[][]} */
    this.particles = [];
    /** @type {Box | undefined} The box that is being drawn. */
    this.drawn = undefined;
  }

  /**
   * @param {ImageBitmap | HTMLCanvasElement} image
   * @param {Shown[]} [objects]
   * @param {number[][]} [particles] Likeliest first.
   */
  show(image, objects = [], particles = []) {
    const { canvas } = this;
    this.image = image;
    this.objects = objects;
    this.particles = particles;
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
      paintBox(this.context, { box: this.drawn, color: DRAWN, name: "", isLost: true });
      return;
    }
    this.dots(this.particles);
    for (const object of this.objects) paintBox(this.context, object);
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

/** Paints the box of an object, dashed where it is lost.
 * @param {CanvasRenderingContext2D} context
 * @param {Shown} object */
export function paintBox(context, { box: { x, y, width, height }, color, name, isLost }) {
  const unit = context.canvas.width / 320;
  context.setLineDash(isLost ? [5 * unit, 3 * unit] : []);
  for (const [line, style] of /** @type {const} */ ([[2.75, "#000000aa"], [1.25, color]])) {
    context.lineWidth = line * unit;
    context.strokeStyle = style;
    context.strokeRect(x, y, width, height);
  }
  context.setLineDash([]);
  if (!name) return;
  context.font = `600 ${9 * unit}px system-ui, sans-serif`;
  const [left, base] = [x, Math.max(y - 3 * unit, 9 * unit)];
  context.lineWidth = 2 * unit;
  context.strokeStyle = "#000000aa";
  context.strokeText(name, left, base);
  context.fillStyle = color;
  context.fillText(name, left, base);
}
