// Saving results.

/** @typedef {import("./run.js").Run} Run */

/** What is said of a video. In a CSV it stands in every row, so that spreadsheets and programs read the table as it is.
 * @param {Run} run */
function about({ source }) {
  const rate = source.rate && Number(source.rate.toFixed(3));
  return { video: source.name, video_width: source.size.width, video_height: source.size.height, frame_rate: rate };
}

/** @param {Run} run */
function flat({ rows }) {
  return rows.map(({ frame, time, box: { x, y, width, height }, score, status }) => {
    return { frame, time, x, y, width, height, score, status };
  });
}

/** A field of a CSV (RFC 4180).
 * @param {string | number | undefined} value */
function field(value = "") {
  const text = String(value);
  return /[",\r\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text;
}

/**
 * @param {Run} run
 * @returns {Blob}
 */
export function asCsv(run) {
  const rows = flat(run).map((row) => ({ ...row, ...about(run) }));
  const lines = [Object.keys(rows[0]), ...rows.map(Object.values)].map((values) => values.map(field).join(","));
  return new Blob([`${lines.join("\n")}\n`], { type: "text/csv" });
}

/**
 * @param {Run} run
 * @returns {Blob}
 */
export function asJson(run) {
  const { video, ...size } = about(run);
  const document = { video, ...size, skipped: run.skipped, boxes: flat(run) };
  return new Blob([`${JSON.stringify(document, undefined, 1)}\n`], { type: "application/json" });
}

/**
 * @param {Blob} blob
 * @param {Run} run
 * @param {string} extension
 */
export function save(blob, run, extension) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = `${run.source.name.replace(/\.[^.]*$/, "")}-boxes.${extension}`;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}
