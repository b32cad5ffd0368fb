// The picture, and an overlay at the resolution of the screen with boxes and particles.

import { paintParticles } from "./particles.js";

/**
 * @typedef {object} Shown An object in the picture.
 * @property {Box} box In pixels of the picture.
 * @property {string} color
 * @property {string} name Empty where there is one object alone.
 * @property {boolean} isLost
 * @property {boolean} isChosen
 */

/** The colour of a box that is being drawn. */
const DRAWN = "#ffffff";
const DARK = "#0b0c0f";
/** The colour over the picture outside of that box. */
const OUTSIDE = "#0b0c0f73";
/** The assumed width on a screen of a picture that is not shown, in pixels. */
const USUAL_WIDTH = 640;
/** Most letters of a name in the picture. The list shows the whole name. */
const MOST_LETTERS = 24;

export class Stage {
  /**
   * @param {HTMLCanvasElement} canvas
   * @param {HTMLCanvasElement} overlay
   */
  constructor(canvas, overlay) {
    this.canvas = canvas;
    this.overlay = overlay;
    this.context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
    this.over = /** @type {CanvasRenderingContext2D} */ (overlay.getContext("2d"));
    /** @type {ImageBitmap | HTMLCanvasElement | undefined} The picture that is shown. */
    this.image = undefined;
    /** @type {Shown[]} */
    this.objects = [];
    /** @type {number[][]} */
    this.particles = [];
    /** @type {Box | undefined} The box that is being drawn. */
    this.drawn = undefined;
    /** Pixels of the video for one pixel of the picture. */
    this.scale = 1;
    new ResizeObserver(() => this.paint()).observe(overlay);
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
      canvas.parentElement?.style.setProperty("--aspect", String(image.width / image.height));
    }
    this.context.drawImage(image, 0, 0);
    this.paint();
  }

  /** @param {Box | undefined} drawn
   * @param {number} [width] The width of the video in pixels. */
  draw(drawn, width = this.canvas.width) {
    this.drawn = drawn;
    this.scale = width / this.canvas.width;
    this.paint();
  }

  /** Paints the overlay, in the coordinates of the picture. */
  paint() {
    const { canvas, over, overlay } = this;
    if (!this.image || overlay.clientWidth === 0) return;
    const width = Math.round(overlay.clientWidth * devicePixelRatio);
    const height = Math.round(overlay.clientHeight * devicePixelRatio);
    if (overlay.width !== width || overlay.height !== height) [overlay.width, overlay.height] = [width, height];
    over.setTransform(width / canvas.width, 0, 0, height / canvas.height, 0, 0);
    over.clearRect(0, 0, canvas.width, canvas.height);
    const unit = canvas.width / overlay.clientWidth;
    if (this.drawn) return this.paintDrawn(this.drawn, unit);
    paintParticles(over, this.particles, unit);
    for (const object of this.objects) paintBox(over, object, unit);
  }

  /** Paints the box that is being drawn, and darkens the rest.
   * @param {Box} box
   * @param {number} unit */
  paintDrawn(box, unit) {
    const { canvas, over } = this;
    over.fillStyle = OUTSIDE;
    over.beginPath();
    over.rect(0, 0, canvas.width, canvas.height);
    over.rect(box.x, box.y, box.width, box.height);
    over.fill("evenodd");
    const name = `${Math.round(box.width * this.scale)} × ${Math.round(box.height * this.scale)}`;
    paintBox(over, { box, color: DRAWN, name, isLost: false, isChosen: true }, unit);
  }
}

/** Copies the part of an image inside a box to a square canvas.
 * @param {HTMLCanvasElement} target
 * @param {ImageBitmap | HTMLCanvasElement} image
 * @param {Box} box */
export function copyPatch(target, image, box) {
  if (!(box.width > 0 && box.height > 0)) return;
  target.width = target.height = Math.round(target.clientWidth * devicePixelRatio) || 224;
  const scale = target.width / Math.max(box.width, box.height);
  const [width, height] = [box.width * scale, box.height * scale];
  const left = (target.width - width) / 2;
  const top = (target.height - height) / 2;
  target.getContext("2d")?.drawImage(image, box.x, box.y, box.width, box.height, left, top, width, height);
}

/** Paints the box of an object, dashed where it is lost, and its name.
 * @param {CanvasRenderingContext2D} context
 * @param {Shown} object
 * @param {number} [unit] A pixel of the screen. */
export function paintBox(context, { box, color, name, isLost, isChosen }, unit = context.canvas.width / USUAL_WIDTH) {
  const { x, y, width, height } = box;
  context.setLineDash(isLost ? [7 * unit, 5 * unit] : []);
  for (const [line, style] of /** @type {const} */ ([[isChosen ? 4.5 : 3.5, `${DARK}99`], [isChosen ? 2.5 : 1.5, color]])) {
    context.lineWidth = line * unit;
    context.strokeStyle = style;
    context.beginPath();
    context.roundRect(x, y, width, height, 3 * unit);
    context.stroke();
  }
  context.setLineDash([]);
  if (name) paintName(context, name, x, y, isChosen ? [color, DARK] : [`${DARK}cc`, color], unit);
}

/** Paints a name over the upper left corner of a box; inside where there is no room over it. It stays in the picture.
 * @param {CanvasRenderingContext2D} context
 * @param {string} name
 * @param {number} x
 * @param {number} y
 * @param {string[]} colors The colours of the background and of the text.
 * @param {number} unit */
function paintName(context, name, x, y, [ground, text], unit) {
  const letters = [...name];
  const short = letters.length > MOST_LETTERS ? `${letters.slice(0, MOST_LETTERS - 1).join("").trimEnd()}…` : name;
  context.font = `600 ${12 * unit}px system-ui, sans-serif`;
  const [width, height] = [context.measureText(short).width + 12 * unit, 20 * unit];
  const most = context.canvas.width / context.getTransform().a - width;
  const [left, top] = [Math.max(0, Math.min(x - unit, most)), y < height + 4 * unit ? Math.max(0, y) + 4 * unit : y - height - 4 * unit];
  context.fillStyle = ground;
  context.beginPath();
  context.roundRect(left, top, width, height, 5 * unit);
  context.fill();
  context.fillStyle = text;
  context.textBaseline = "middle";
  context.fillText(short, left + 6 * unit, top + height / 2);
}
