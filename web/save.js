// Saving results.

/** @typedef {import("./run.js").Row} Row */

const COLUMNS = /** @type {const} */ (["frame", "time", "x", "y", "width", "height", "score", "status"]);
/** Most bytes of a recording; then it stops. */
const MOST_RECORDED = 300 << 20;

/** @param {Row[]} rows */
function flat(rows) {
  return rows.map(({ frame, time, box, score, status }) => ({ frame, time, ...box, score, status }));
}

/**
 * @param {Row[]} rows
 * @returns {Blob}
 */
export function asCsv(rows) {
  const lines = flat(rows).map((row) => COLUMNS.map((name) => row[name]).join(","));
  return new Blob([`${[COLUMNS.join(","), ...lines].join("\n")}\n`], { type: "text/csv" });
}

/**
 * @param {Row[]} rows
 * @returns {Blob}
 */
export function asJson(rows) {
  return new Blob([`${JSON.stringify(flat(rows), undefined, 1)}\n`], { type: "application/json" });
}

/**
 * @param {Blob} blob
 * @param {string} name
 */
export function save(blob, name) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}

/** Records what a canvas shows, as WebM. */
export class Recording {
  /** @param {HTMLCanvasElement} canvas */
  constructor(canvas) {
    /** @type {Blob[]} */
    this.pieces = [];
    let bytes = 0;
    this.recorder = new MediaRecorder(canvas.captureStream(25), { mimeType: "video/webm" });
    this.recorder.ondataavailable = ({ data }) => {
      this.pieces.push(data);
      bytes += data.size;
      if (bytes > MOST_RECORDED) this.recorder.stop();
    };
    this.recorder.start(1000);
  }

  static isPossible() {
    return typeof MediaRecorder !== "undefined" && MediaRecorder.isTypeSupported("video/webm");
  }

  /** The recording up to now.
   * @returns {Promise<Blob>} */
  finish() {
    const whole = () => new Blob(this.pieces, { type: "video/webm" });
    if (this.recorder.state === "inactive") return Promise.resolve(whole());
    return new Promise((resolve) => {
      this.recorder.onstop = () => resolve(whole());
      this.recorder.stop();
    });
  }
}
