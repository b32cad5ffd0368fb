// Drawing a box by mouse, pen or keyboard; by a finger only after `arm`, because a finger scrolls the page otherwise.

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
   *   tap: () => void, arm: (isArmed: boolean) => void}} told `start` says whether a box may be drawn; `tap`, that a
   *   finger touched the picture while drawing was off.
   */
  constructor(canvas, told) {
    this.canvas = canvas;
    this.told = told;
    /** @type {{x: number, y: number} | undefined} Where the pointer went down. */
    this.from = undefined;
    /** @type {Box | undefined} */
    this.box = undefined;
    /** The id of the pointer that draws; other fingers on the picture are ignored. */
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
    // No `pointerup` comes where the browser takes the pointer for itself, or another window gets it.
    const lost = () => this.from && this.cancel();
    canvas.addEventListener("lostpointercapture", ({ pointerId }) => pointerId === this.pointer && lost());
    addEventListener("blur", lost);
    // Without the focus, keys cannot finish a box, and the picture around it would stay dark. After a visit to another
    // window, `hasFocus` is false here, and the canvas gets the focus back: then the box stays.
    canvas.addEventListener("blur", () => this.box && !this.from && document.hasFocus() && this.cancel());
    canvas.addEventListener("keydown", (event) => this.key(event));
  }

  /** Lets a finger draw one box.
   * @param {boolean} isArmed */
  arm(isArmed) {
    this.isArmed = isArmed;
    this.told.arm(isArmed);
    if (!isArmed) return;
    // The arrow keys move the box only while the canvas has the focus.
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
    // Without a box, the arrow keys step through the frames, unless `arm` was called.
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
