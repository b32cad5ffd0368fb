// The timeline: all frames, the score of the chosen object as a curve, and the frame that is shown.

const STATUSES = /** @type {const} */ (["tracking", "uncertain", "lost"]);
/** @type {Record<string, number>} */
const STEPS = { ArrowLeft: -1, ArrowRight: 1, PageUp: -10, PageDown: 10, Home: -Infinity, End: Infinity };
/** Pixels above the curve for the number of a frame, and below it for the numbers of the ruler. */
const [TOP, BOTTOM] = [22, 18];
/** Least pixels between two numbers of the ruler, and the possible steps between them. */
const APART = 56;
const RULER = [1, 2, 5, 10, 25, 50, 100, 250, 500, 1000, 2500, 5000, 10000];

export class Timeline {
  /**
   * @param {HTMLCanvasElement} canvas
   * @param {(frame: number) => void} seek Shows a frame.
   * @param {(by: number) => void} step Shows a frame so many before or after the present one.
   */
  constructor(canvas, seek, step) {
    this.canvas = canvas;
    this.seek = seek;
    this.isDue = false;
    /** @type {Row[]} */
    this.rows = [];
    this.last = 0;
    this.shown = 0;
    /** The frame at the right end. */
    this.end = 0;
    /** @type {number | undefined} The frame under the mouse. */
    this.hovered = undefined;
    const at = (/** @type {PointerEvent} */ event) => {
      const area = canvas.getBoundingClientRect();
      return this.limited(Math.round(((event.clientX - area.left) / area.width) * this.end));
    };
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      this.go(at(event));
    });
    canvas.addEventListener("pointermove", (event) => {
      if (canvas.hasPointerCapture(event.pointerId)) this.go(at(event));
      this.hover(event.pointerType === "mouse" ? at(event) : undefined);
    });
    canvas.addEventListener("pointerleave", () => this.hover(undefined));
    canvas.addEventListener("keydown", (event) => {
      const steps = STEPS[event.key];
      if (steps === undefined) return;
      event.preventDefault();
      step(steps);
    });
    new ResizeObserver(() => this.repaint()).observe(canvas);
  }

  /** @param {number} frame */
  limited(frame) {
    return Math.min(Math.max(frame, 0), this.last);
  }

  /** @param {number} frame */
  go(frame) {
    this.seek(this.limited(frame));
  }

  /** @param {number | undefined} frame */
  hover(frame) {
    if (frame === this.hovered) return;
    this.hovered = frame;
    this.repaint();
  }

  /**
   * @param {Row[]} rows Of the chosen object.
   * @param {number} last The last frame that was tracked.
   * @param {number} shown
   * @param {number} end The frame at the right end; at least `last`. */
  show(rows, last, shown, end) {
    Object.assign(this, { rows, last, shown, end: Math.max(last, end, 1) });
    this.repaint();
  }

  /** Paints at most once for each refresh of the screen. */
  repaint() {
    if (this.isDue) return;
    this.isDue = true;
    requestAnimationFrame(() => {
      this.isDue = false;
      this.paint();
    });
  }

  paint() {
    const { canvas, rows, last, shown, end } = this;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    [canvas.width, canvas.height] = [width, height].map((side) => Math.round(side * devicePixelRatio));
    const told = (/** @type {number} */ frame) => rows.find((row) => row.frame === frame);
    this.describe(told(shown));
    const context = canvas.getContext("2d");
    if (!context || width === 0 || rows.length === 0) return;
    context.scale(devicePixelRatio, devicePixelRatio);
    context.font = "11px system-ui, sans-serif";
    const style = getComputedStyle(canvas);
    const sheet = new Sheet(context, width, height, end, (name) => style.getPropertyValue(`--${name}`).trim());
    sheet.ruler(last);
    sheet.curve(rows);
    for (const { frame, corrected } of rows) if (corrected) sheet.mark(frame);
    if (this.hovered !== undefined && this.hovered !== shown) sheet.line(this.hovered, told(this.hovered), false);
    sheet.line(shown, told(shown), true);
  }

  /** @param {Row | undefined} row Of the frame that is shown. */
  describe(row) {
    const { canvas, rows, last, shown } = this;
    canvas.setAttribute("aria-valuemax", String(last));
    canvas.setAttribute("aria-valuenow", String(shown));
    const text = row ? `${row.status}, score ${row.score.toFixed(2)}` : "not tracked";
    canvas.setAttribute("aria-valuetext", `Frame ${shown} of ${last}: ${text}`);
    const counts = STATUSES.map((status) => `${rows.filter((row) => row.status === status).length} ${status}`);
    canvas.setAttribute("aria-label", `Frames of the chosen object: ${counts.join(", ")}`);
  }
}

/** The drawing of a timeline, in CSS pixels. */
class Sheet {
  /**
   * @param {CanvasRenderingContext2D} context
   * @param {number} width
   * @param {number} height
   * @param {number} end The frame at the right end.
   * @param {(name: string) => string} color A colour of the style sheet by its name, with six hexadecimal digits.
   */
  constructor(context, width, height, end, color) {
    this.context = context;
    this.width = width;
    this.color = color;
    this.step = width / end;
    this.bottom = height - BOTTOM;
    this.level = (/** @type {number} */ score) => TOP + (1 - score) * (this.bottom - TOP);
  }

  /** Numbers of frames, and a line over those that were tracked.
   * @param {number} last */
  ruler(last) {
    const { context, step, bottom, width } = this;
    context.fillStyle = this.color("line");
    context.fillRect(0, this.level(0.5), width, 1);
    context.fillRect(0, bottom, width, 1);
    context.fillStyle = this.color("soft");
    context.fillRect(0, bottom, last * step, 1);
    context.textBaseline = "bottom";
    const every = RULER.find((count) => count * step >= APART) ?? RULER[RULER.length - 1];
    for (let frame = 0; frame * step < width - 12; frame += every) {
      context.fillRect(frame * step, bottom, 1, 4);
      context.fillText(String(frame), frame * step + 4, bottom + BOTTOM);
    }
  }

  /** The score as an area under a line, a piece for each run of one status.
   * @param {Row[]} rows */
  curve(rows) {
    for (let from = 0; from < rows.length; ) {
      const { status } = rows[from];
      let to = from + 1;
      while (to < rows.length && rows[to].status === status && rows[to].frame === rows[to - 1].frame + 1) to += 1;
      // The piece includes the first row of the next one, so that there is no gap between them.
      const isNext = rows[to]?.frame === rows[to - 1].frame + 1;
      this.piece(rows.slice(from, isNext ? to + 1 : to), this.color(status), status === "lost");
      from = to;
    }
  }

  /**
   * @param {Row[]} rows
   * @param {string} color
   * @param {boolean} isLost
   */
  piece(rows, color, isLost) {
    const { context, step, bottom } = this;
    const [left, right] = [rows[0].frame * step, Math.max(rows[rows.length - 1].frame * step, rows[0].frame * step + 1)];
    // A lost object gets a coloured background, so that it is easy to spot.
    if (isLost) {
      context.globalAlpha = 0.22;
      context.fillStyle = color;
      context.fillRect(left, TOP, right - left, bottom - TOP);
    }
    const path = new Path2D();
    for (const { frame, score } of rows) path.lineTo(frame * step, this.level(score));
    path.lineTo(right, this.level(rows[rows.length - 1].score));
    const area = new Path2D(path);
    area.lineTo(right, bottom);
    area.lineTo(left, bottom);
    const fill = context.createLinearGradient(0, TOP, 0, bottom);
    fill.addColorStop(0, color);
    fill.addColorStop(1, `${color}00`);
    context.globalAlpha = 0.4;
    context.fillStyle = fill;
    context.fill(area);
    context.globalAlpha = 1;
    context.lineWidth = 1.75;
    context.lineJoin = "round";
    context.strokeStyle = color;
    context.stroke(path);
  }

  /** A key frame: where a box was drawn.
   * @param {number} frame */
  mark(frame) {
    const { context, bottom } = this;
    const x = Math.min(Math.max(frame * this.step, 5), this.width - 5);
    context.fillStyle = this.color("ink");
    context.beginPath();
    for (const [right, down] of [[0, -5], [5, 0], [0, 5], [-5, 0]]) context.lineTo(x + right, bottom + down);
    context.fill();
  }

  /** A vertical line at a frame, with the frame's number and score.
   * @param {number} frame
   * @param {Row | undefined} row
   * @param {boolean} isShown False for the frame under the mouse. */
  line(frame, row, isShown) {
    const { context, width, bottom } = this;
    const x = Math.min(Math.max(frame * this.step, 1), width - 1);
    context.fillStyle = this.color(isShown ? "ink" : "soft");
    context.fillRect(x - (isShown ? 1 : 0.5), 4, isShown ? 2 : 1, bottom - 4);
    if (row) {
      context.beginPath();
      context.arc(x, this.level(row.score), isShown ? 4 : 3, 0, 2 * Math.PI);
      context.fill();
    }
    const text = isShown || !row ? String(frame) : `${frame} · ${row.status} ${row.score.toFixed(2)}`;
    const wide = context.measureText(text).width + 12;
    const left = Math.min(Math.max(x - wide / 2, 0), width - wide);
    context.beginPath();
    context.roundRect(left, 0, wide, 17, 5);
    context.fill();
    context.fillStyle = this.color("ground");
    context.textBaseline = "middle";
    context.fillText(text, left + 6, 9);
  }
}
