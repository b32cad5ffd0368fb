// Drawing a box: by mouse, pen or keyboard, and by a finger once drawing is on: without it a finger scrolls the page.

/** Least side of a box in pixels of the frame. */
const LEAST = 6;
const STEP = 4;

/** @type {Record<string, [number, number]>} */
const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

/**
 * @param {number} value
 * @param {number} least
 * @param {number} most
 */
const limited = (value, least, most) => Math.min(Math.max(value, least), most);

export class BoxDrawing {
  /**
   * @param {HTMLCanvasElement} canvas
   * @param {{start: () => boolean, change: (box: Box | undefined) => void, finish: (box: Box) => void,
   *   tap: () => void, arm: (isArmed: boolean) => void}} told `start` says whether a box may be drawn now; `tap`, that a
   *   finger touched the picture while drawing was off.
   */
  constructor(canvas, told) {
    this.canvas = canvas;
    this.told = told;
    /** @type {{x: number, y: number} | undefined} Where the pointer went down. */
    this.from = undefined;
    /** @type {Box | undefined} */
    this.box = undefined;
    /** The pointer that draws: others touch the picture, too. */
    this.pointer = -1;
    /** Whether a finger draws. */
    this.isArmed = false;
    canvas.addEventListener("click", (event) => {
      const isTouch = event instanceof PointerEvent && event.pointerType === "touch";
      if (isTouch && !this.isArmed) this.told.tap();
    });
    canvas.addEventListener("pointerdown", (event) => this.down(event));
    canvas.addEventListener("pointermove", (event) => this.move(event));
    canvas.addEventListener("pointerup", (event) => this.up(event));
    // Where its end is not told: the browser takes the pointer, or another window has it.
    const lost = () => this.from && this.cancel();
    canvas.addEventListener("lostpointercapture", ({ pointerId }) => pointerId === this.pointer && lost());
    addEventListener("blur", lost);
    // Keys are the box's own no more, and the picture would stay dark. Another window gives the focus back.
    canvas.addEventListener("blur", () => this.box && !this.from && document.hasFocus() && this.cancel());
    canvas.addEventListener("keydown", (event) => this.key(event));
  }

  /** Lets a finger draw one box.
   * @param {boolean} isArmed */
  arm(isArmed) {
    this.isArmed = isArmed;
    this.told.arm(isArmed);
    if (!isArmed) return;
    // There arrows move the box.
    this.canvas.focus({ preventScroll: true });
    const { top, bottom } = this.canvas.getBoundingClientRect();
    if (bottom < 0 || top > innerHeight) this.canvas.scrollIntoView();
  }

  /** @param {PointerEvent} event */
  at(event) {
    const area = this.canvas.getBoundingClientRect();
    return {
      x: limited(((event.clientX - area.left) / area.width) * this.canvas.width, 0, this.canvas.width),
      y: limited(((event.clientY - area.top) / area.height) * this.canvas.height, 0, this.canvas.height),
    };
  }

  /** @param {PointerEvent} event */
  down(event) {
    if (event.pointerType === "touch" && !this.isArmed) return;
    const isOther = this.from && event.pointerId !== this.pointer;
    if (event.button !== 0 || isOther || !this.told.start()) return;
    this.canvas.setPointerCapture(event.pointerId);
    this.pointer = event.pointerId;
    this.from = this.at(event);
    this.box = undefined;
  }

  /** @param {PointerEvent} event */
  move(event) {
    if (!this.from || event.pointerId !== this.pointer) return;
    const to = this.at(event);
    this.box = {
      x: Math.min(this.from.x, to.x),
      y: Math.min(this.from.y, to.y),
      width: Math.abs(to.x - this.from.x),
      height: Math.abs(to.y - this.from.y),
    };
    this.told.change(this.box);
  }

  /** @param {PointerEvent} event */
  up(event) {
    if (!this.from || event.pointerId !== this.pointer) return;
    this.move(event);
    this.from = undefined;
    const box = this.box;
    if (box && box.width >= LEAST && box.height >= LEAST) this.finish(box);
    else this.cancel();
  }

  /** @param {Box} box */
  finish(box) {
    this.box = undefined;
    this.arm(false);
    this.told.finish(box);
  }

  cancel() {
    this.from = undefined;
    this.box = undefined;
    this.told.change(undefined);
  }

  /** @param {KeyboardEvent} event */
  key(event) {
    const arrow = ARROWS[event.key];
    const isEscape = event.key === "Escape";
    if (!arrow && event.key !== "Enter" && !(isEscape && this.box)) return;
    // Without a box arrows step through the frames, but where one is about to draw.
    if (arrow && !this.box && !this.isArmed) return;
    event.preventDefault();
    if (isEscape) return this.cancel();
    if (event.key === "Enter" && this.box) return this.finish(this.box);
    const { width, height } = this.canvas;
    if (!this.box) {
      if (!this.told.start()) return;
      const side = Math.round(Math.min(width, height) / 4);
      this.box = { x: (width - side) / 2, y: (height - side) / 2, width: side, height: side };
    } else if (arrow) {
      const [right, down] = [arrow[0] * STEP, arrow[1] * STEP];
      const box = { ...this.box };
      if (event.shiftKey) {
        box.width = limited(box.width + right, LEAST, width - box.x);
        box.height = limited(box.height + down, LEAST, height - box.y);
      } else {
        box.x = limited(box.x + right, 0, width - box.width);
        box.y = limited(box.y + down, 0, height - box.height);
      }
      this.box = box;
    }
    this.told.change(this.box);
  }
}
