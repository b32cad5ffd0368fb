// Measures the milliseconds of a step in Node.js, on the sample clip in 640 x 480: `node step.bench.js FOLDER`, a
// folder of PNGs.

import { readFileSync, readdirSync } from "node:fs";
import { join } from "node:path";
import { Tracker, frameFor } from "../tracker.js";
import { decodePng } from "./png.js";

const folder = process.argv[2];
const names = readdirSync(join(folder, "img")).sort();
const images = names.map((name) => decodePng(new Uint8Array(readFileSync(join(folder, "img", name)))));
const [x, y, width, height] = readFileSync(join(folder, "groundtruth_rect.txt"), "utf8").split("\n")[0].split(",").map(Number);
const tracker = await Tracker.create(images[0], { x: x - 1, y: y - 1, width, height }, { seed: 0 });
const taken = [];
for (const image of images.slice(1)) {
  const frame = await frameFor(image);
  const started = performance.now();
  tracker.wasm.step(frame).free();
  taken.push(performance.now() - started);
  frame.free();
}
// Without the first third of the steps, in which the engine has not optimised the module yet.
const warm = taken.slice(taken.length / 3).sort((a, b) => a - b);
console.log(warm[warm.length >> 1].toFixed(3));
