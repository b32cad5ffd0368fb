// The curve of the score.

/** @typedef {import("./run.js").Row} Row */

export class Chart {
  /** @param {HTMLCanvasElement} canvas */
  constructor(canvas) {
    this.canvas = canvas;
    this.isDue = false;
  }

  /** Paints at most once for each frame of the screen.
   * @param {Row[]} rows */
  show(rows) {
    if (this.isDue) return;
    this.isDue = true;
    requestAnimationFrame(() => {
      this.isDue = false;
      this.paint(rows);
    });
  }

  /** @param {Row[]} rows */
  paint(rows) {
    const { canvas } = this;
    const ratio = devicePixelRatio;
    const width = (canvas.width = Math.round(canvas.clientWidth * ratio));
    const height = (canvas.height = Math.round(canvas.clientHeight * ratio));
    const context = canvas.getContext("2d");
    if (!context || rows.length === 0) return;
    const style = getComputedStyle(canvas);
    const color = (/** @type {string} */ name) => style.getPropertyValue(name);
    const pad = 6 * ratio;
    const step = (width - 2 * pad) / Math.max(rows.length - 1, 60);
    const at = (/** @type {number} */ index) => pad + index * step;
    const level = (/** @type {number} */ score) => height - pad - score * (height - 2 * pad);
    context.strokeStyle = color("--line");
    context.lineWidth = ratio;
    for (const score of [0, 0.5, 1]) line(context, [[0, level(score)], [width, level(score)]]);
    rows.forEach((row, index) => {
      if (row.status === "lost") {
        context.fillStyle = color("--lost");
        context.globalAlpha = 0.25;
        context.fillRect(at(index) - step / 2, 0, step, height);
        context.globalAlpha = 1;
      }
      if (row.corrected && index > 0) {
        context.strokeStyle = color("--soft");
        line(context, [[at(index), 0], [at(index), height]]);
      }
    });
    context.strokeStyle = color("--accent");
    context.lineWidth = 2 * ratio;
    line(context, rows.map((row, index) => [at(index), level(row.score)]));
    const lost = rows.filter((row) => row.status === "lost").length;
    const last = rows[rows.length - 1];
    const text = `Score over ${rows.length} frames: now ${last.score.toFixed(2)}, lost in ${lost} frames`;
    canvas.setAttribute("aria-label", text);
  }
}

/**
 * @param {CanvasRenderingContext2D} context
 * @param {number[][]} points
 */
function line(context, points) {
  context.beginPath();
  for (const [x, y] of points) context.lineTo(x, y);
  context.stroke();
}

/** The votes as bars.
 * @param {HTMLCanvasElement} canvas
 * @param {number[]} votes */
export function showVotes(canvas, votes) {
  const ratio = devicePixelRatio;
  canvas.width = Math.round(canvas.clientWidth * ratio);
  canvas.height = Math.round(canvas.clientHeight * ratio);
  const context = canvas.getContext("2d");
  if (!context || votes.length === 0) return;
  const most = Math.max(...votes);
  const width = canvas.width / votes.length;
  context.fillStyle = getComputedStyle(canvas).getPropertyValue("--accent");
  votes.forEach((vote, index) => {
    const height = (vote / most) * (canvas.height - 8 * ratio);
    context.fillRect(index * width + ratio, canvas.height - height, width - 2 * ratio, height);
  });
  const first = Math.round(100 * votes[0]);
  canvas.setAttribute("aria-label", `${votes.length} subspaces; the first has ${first} % of the vote`);
}
