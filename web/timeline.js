// The timeline: all frames, the score of the chosen object, and the frame that is shown.

/** @typedef {import("./objects.js").Row} Row */

const STATUSES = /** @type {const} */ (["tracking", "uncertain", "lost"]);
/** @type {Record<string, number>} */
const STEPS = { ArrowLeft: -1, ArrowRight: 1, PageUp: -10, PageDown: 10, Home: -Infinity, End: Infinity };

export class Timeline {
  /**
   * @param {HTMLCanvasElement} canvas
   * @param {(frame: number) => void} seek Is told which frame shall be shown.
   */
  constructor(canvas, seek) {
    this.canvas = canvas;
    this.seek = seek;
    this.isDue = false;
    /** @type {Row[]} */
    this.rows = [];
    this.last = 0;
    this.shown = 0;
    const point = (/** @type {PointerEvent} */ event) => {
      const area = canvas.getBoundingClientRect();
      this.go(Math.round(((event.clientX - area.left) / area.width) * this.last));
    };
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      point(event);
    });
    canvas.addEventListener("pointermove", (event) => canvas.hasPointerCapture(event.pointerId) && point(event));
    canvas.addEventListener("keydown", (event) => {
      const steps = STEPS[event.key];
      if (steps === undefined) return;
      event.preventDefault();
      this.go(this.shown + steps);
    });
  }

  /** @param {number} frame */
  go(frame) {
    this.seek(Math.min(Math.max(frame, 0), this.last));
  }

  /** Paints at most once for each frame of the screen.
   * @param {Row[]} rows Of the chosen object.
   * @param {number} last The last frame of all.
   * @param {number} shown */
  show(rows, last, shown) {
    Object.assign(this, { rows, last, shown });
    if (this.isDue) return;
    this.isDue = true;
    requestAnimationFrame(() => {
      this.isDue = false;
      this.paint();
    });
  }

  paint() {
    const { canvas, rows, last, shown } = this;
    const ratio = devicePixelRatio;
    const width = (canvas.width = Math.round(canvas.clientWidth * ratio));
    const height = (canvas.height = Math.round(canvas.clientHeight * ratio));
    const context = canvas.getContext("2d");
    if (!context || rows.length === 0) return;
    const style = getComputedStyle(canvas);
    const color = (/** @type {string} */ name) => style.getPropertyValue(`--${name}`);
    const pad = 3 * ratio;
    const step = width / Math.max(last, 1);
    const level = (/** @type {number} */ score) => height - pad - score * (height - 2 * pad);
    context.fillStyle = color("line");
    for (const score of [0, 0.5, 1]) context.fillRect(0, level(score), width, ratio);
    for (const { frame, score, status, corrected } of rows) {
      context.fillStyle = color(status);
      // Whoever is lost is seen from afar.
      const top = status === "lost" ? 0 : level(score);
      context.globalAlpha = status === "lost" ? 0.6 : 1;
      context.fillRect((frame - 0.5) * step, top, Math.max(step, ratio), height - top);
      context.globalAlpha = 1;
      if (!corrected) continue;
      context.fillStyle = color("ink");
      context.beginPath();
      context.arc(Math.max(frame * step, 4 * ratio), 5 * ratio, 3.5 * ratio, 0, 2 * Math.PI);
      context.fill();
    }
    context.fillStyle = color("ink");
    context.fillRect(Math.min(shown * step, width - 2 * ratio), 0, 2 * ratio, height);
    const row = rows.find(({ frame }) => frame === shown);
    canvas.setAttribute("aria-valuemax", String(last));
    canvas.setAttribute("aria-valuenow", String(shown));
    const text = row ? `${row.status}, score ${row.score.toFixed(2)}` : "not tracked";
    canvas.setAttribute("aria-valuetext", `Frame ${shown} of ${last}: ${text}`);
    const counts = STATUSES.map((status) => `${rows.filter((row) => row.status === status).length} ${status}`);
    canvas.setAttribute("aria-label", `Frames of the chosen object: ${counts.join(", ")}`);
  }
}
