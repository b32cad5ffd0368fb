// Saving results: one function for each format. Boxes are in pixels of the video, from 0 (in MOT from 1); in YOLO as
// shares of its size, in Label Studio in percent.

import { projectOf } from "./project.js";
import { zip } from "./zip.js";

/** The name, size and rate of the video. A CSV repeats them in every row, so that it stays a plain table.
 * @param {Run} run */
function about({ source }) {
  const rate = source.rate && Number(source.rate.toFixed(3));
  return { video: source.name, video_width: source.size.width, video_height: source.size.height, frame_rate: rate };
}

/** The name of an object; its number where the user has emptied the name.
 * @param {FollowedObject} object */
const nameOf = ({ name, number }) => name.trim() || `Object ${number + 1}`;

/** The classes of objects: their names, each once.
 * @param {Run} run */
const classesOf = ({ objects }) => [...new Set(objects.map(nameOf))];

/** The rows of all objects, frame by frame. `target` counts objects from 0, as `bagtrack track` does.
 * @param {Run} run */
function flat({ objects }) {
  const rows = objects.flatMap((object) => {
    const { number } = object;
    return [...object.rows.values()].map((row) => ({ name: nameOf(object), number, row }));
  });
  rows.sort((a, b) => a.row.frame - b.row.frame || a.number - b.number);
  return rows.map(({ name, number, row: { frame, time, box: { x, y, width, height }, score, status } }) => {
    return { frame, time, target: number, name, x, y, width, height, score, status };
  });
}

/** A field of a CSV (RFC 4180).
 * @param {string | number | undefined} value */
function field(value = "") {
  const text = String(value);
  return /[",\r\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text;
}

/** @param {unknown} document */
const json = (document) => new Blob([`${JSON.stringify(document, undefined, 1)}\n`], { type: "application/json" });

/** @param {Run} run */
function csv(run) {
  const rows = flat(run).map((row) => ({ ...row, ...about(run) }));
  const lines = [Object.keys(rows[0]), ...rows.map(Object.values)].map((values) => values.map(field).join(","));
  return new Blob([`${lines.join("\n")}\n`], { type: "text/csv" });
}

/** @param {Run} run */
function plain(run) {
  const { video, ...size } = about(run);
  return json({ video, ...size, skipped: run.skipped, boxes: flat(run) });
}

/** MOTChallenge: frames, objects and pixels count from 1; the last three fields, a position in the world, are unknown.
 * @param {Run} run */
function mot(run) {
  const lines = flat(run).map(({ frame, target, x, y, width, height, score }) => {
    const box = [x + 1, y + 1, width, height].map((value) => value.toFixed(3));
    return [frame + 1, target + 1, ...box, score.toFixed(4), -1, -1, -1].join(",");
  });
  return new Blob([`${lines.join("\n")}\n`], { type: "text/plain" });
}

/** The part of a box inside the picture; undefined where that is empty, or the object is lost.
 * @param {Run} run
 * @param {ReturnType<typeof flat>[number]} row */
function inside({ source: { size } }, { x, y, width, height, status }) {
  const [left, top] = [Math.max(x, 0), Math.max(y, 0)];
  const [right, bottom] = [Math.min(x + width, size.width), Math.min(y + height, size.height)];
  if (status === "lost" || right <= left || bottom <= top) return undefined;
  return { left, top, width: right - left, height: bottom - top };
}

/** The numbers of the frames that were tracked, ascending.
 * @param {Run} run */
const tracked = (run) => [...new Set(flat(run).map(({ frame }) => frame))];

/** The file name of a frame's picture: that of the image, or one made of the frame's number.
 * @param {Run} run
 * @param {number} frame */
const imageName = ({ source }, frame) => source.imageNames?.[frame] ?? `frame_${String(frame).padStart(6, "0")}.jpg`;

/** COCO, with `track_id` and `video_id`, as in its variants for videos. Lost objects are left out.
 * @param {Run} run */
function coco(run) {
  const { video, video_width: width, video_height: height } = about(run);
  const images = tracked(run).map((frame) => {
    return { id: frame + 1, file_name: imageName(run, frame), width, height, video_id: 1, frame_id: frame };
  });
  const classes = classesOf(run);
  const annotations = flat(run).flatMap((row) => {
    const box = inside(run, row);
    if (!box) return [];
    const bbox = [box.left, box.top, box.width, box.height].map((value) => Number(value.toFixed(2)));
    const ids = { image_id: row.frame + 1, category_id: classes.indexOf(row.name) + 1, track_id: row.target + 1 };
    return [{ ...ids, video_id: 1, bbox, area: bbox[2] * bbox[3], iscrowd: 0, segmentation: [], score: row.score }];
  });
  const categories = classes.map((name, at) => ({ id: at + 1, name, supercategory: "" }));
  const numbered = annotations.map((annotation, at) => ({ id: at + 1, ...annotation }));
  const info = { description: `bagtrack: ${video}` };
  return json({ info, licenses: [], videos: [{ id: 1, name: video }], images, annotations: numbered, categories });
}

/** YOLO: a text file for each frame, with the centre and size of each box as shares of the picture. No lost ones.
 * @param {Run} run */
function yolo(run) {
  const { width, height } = run.source.size;
  const classes = classesOf(run);
  /** @type {Map<number, string[]>} */
  const lines = new Map(tracked(run).map((frame) => [frame, []]));
  for (const row of flat(run)) {
    const box = inside(run, row);
    if (!box) continue;
    const center = [(box.left + box.width / 2) / width, (box.top + box.height / 2) / height];
    const values = [...center, box.width / width, box.height / height].map((value) => value.toFixed(6));
    lines.get(row.frame)?.push([classes.indexOf(row.name), ...values].join(" "));
  }
  const names = classes.map((name, at) => `  ${at}: ${JSON.stringify(name)}\n`).join("");
  const texts = [...lines].map(([frame, text]) => ({
    name: `labels/train/${imageName(run, frame).replace(/\.[^./]*$/, "")}.txt`,
    text: text.map((line) => `${line}\n`).join(""),
  }));
  const about = `train: images/train\n# To train, add other frames to validate with: val: images/val\nnames:\n${names}`;
  return zip([{ name: "data.yaml", text: about }, ...texts]);
}

/** Whether the video has a frame after the last row of an object, as far as is known.
 * @param {Run} run
 * @param {Row} last */
function goesOn({ hasAll, source }, { time }) {
  const interval = 1 / (source.rate ?? 25);
  return !hasAll && source.duration !== undefined && time + 1.5 * interval < source.duration;
}

/** Escapes text for XML, and replaces control characters, which names of files may have and XML may not.
 * @param {string} text */
const escaped = (text) =>
  text.replace(/[\0-\x1f\x7f-\x9f\ufffe\uffff]/g, "\ufffd").replace(/[<>&"]/g, (sign) => `&#${sign.charCodeAt(0)};`);

/** A box of CVAT. Each frame is a key frame, since CVAT interpolates between them.
 * @param {Row} row
 * @param {number} frame
 * @param {boolean} isOutside */
function keyFrame({ box }, frame, isOutside) {
  const corners = { xtl: box.x, ytl: box.y, xbr: box.x + box.width, ybr: box.y + box.height };
  const sides = Object.entries(corners).map(([side, value]) => `${side}="${value.toFixed(2)}"`).join(" ");
  return `<box frame="${frame}" outside="${isOutside ? 1 : 0}" occluded="0" keyframe="1" ${sides} z_order="0"></box>`;
}

/** CVAT for video 1.1: a track for each object. CVAT shows a track until a box with `outside`: here, where the object
 * is lost, and after its last row if the video goes on.
 * @param {Run} run */
function cvat(run) {
  const { video, video_width: width, video_height: height } = about(run);
  const size = Number(tracked(run).pop()) + 1;
  const labels = classesOf(run).map((name) => `<label><name>${escaped(name)}</name><attributes></attributes></label>`);
  const tracks = run.objects.map((object) => {
    const { number, rows: own } = object;
    const boxes = [...own.values()].map((row) => keyFrame(row, row.frame, row.status === "lost"));
    const last = [...own.values()].pop();
    if (last && last.status !== "lost" && goesOn(run, last)) boxes.push(keyFrame(last, last.frame + 1, true));
    return `<track id="${number}" label="${escaped(nameOf(object))}" source="semi-auto">\n${boxes.join("\n")}\n</track>`;
  });
  const task = `<task><name>${escaped(video)}</name><size>${size}</size><mode>interpolation</mode><start_frame>0</start_frame>
<stop_frame>${size - 1}</stop_frame><labels>${labels.join("")}</labels>
<original_size><width>${width}</width><height>${height}</height></original_size></task>`;
  const document = `<?xml version="1.0" encoding="utf-8"?>
<annotations>
<version>1.1</version>
<meta>${task}</meta>
${tracks.join("\n")}
</annotations>
`;
  return new Blob([document], { type: "application/xml" });
}

/** The key frames of an object for Label Studio, which shows a key frame with `enabled` false, and nothing after it.
 * That is the last one before the object is lost; or the first lost one, if the frame right before that has no row.
 * @param {Run} run
 * @param {Map<number, Row>} rows */
function sequenceOf(run, rows) {
  const { width, height } = run.source.size;
  const sequence = [];
  for (const { frame, time, box, status } of rows.values()) {
    const area = { x: (100 * box.x) / width, y: (100 * box.y) / height };
    const size = { width: (100 * box.width) / width, height: (100 * box.height) / height };
    const item = { frame: frame + 1, time, enabled: status !== "lost", rotation: 0, ...area, ...size };
    const before = sequence[sequence.length - 1];
    if (item.enabled) sequence.push(item);
    else if (before?.enabled && before.frame === frame) before.enabled = false;
    else if (before?.enabled) sequence.push(item);
  }
  const [last, row] = [sequence[sequence.length - 1], [...rows.values()].pop()];
  if (last && row && goesOn(run, row)) last.enabled = false;
  return sequence;
}

/** Label Studio: a task with a video, and a region of it for each object. Frames count from 1, boxes are in percent.
 * @param {Run} run */
function labelStudio(run) {
  const last = Number(tracked(run).pop());
  const rate = run.source.rate ?? 25;
  const result = run.objects.map((object) => ({
    id: `object-${object.number + 1}`,
    type: "videorectangle",
    from_name: "box",
    to_name: "video",
    value: {
      framesCount: last + 1,
      duration: Number(((last + 1) / rate).toFixed(3)),
      labels: [nameOf(object)],
      sequence: sequenceOf(run, object.rows),
    },
  }));
  return json([{ data: { video: run.source.name }, annotations: [{ result }] }]);
}

/** @type {Record<string, {make: (run: Run) => Blob, ending: string}>} */
export const FORMATS = {
  csv: { make: csv, ending: "csv" },
  json: { make: plain, ending: "json" },
  mot: { make: mot, ending: "mot.txt" },
  coco: { make: coco, ending: "coco.json" },
  yolo: { make: yolo, ending: "yolo.zip" },
  cvat: { make: cvat, ending: "cvat.xml" },
  "label-studio": { make: labelStudio, ending: "label-studio.json" },
  project: { make: (run) => json(projectOf(run)), ending: "bagtrack.json" },
};

/**
 * @param {Blob} blob
 * @param {Run} run
 * @param {string} ending
 */
export function save(blob, run, ending) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = `${run.source.name.replace(/\.[^.]*$/, "")}-boxes.${ending}`;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}
