// Writes rows in all formats of the page, with the page's own module: node page.mjs PAGE ROWS.json FOLDER whole|part
//
// PAGE is a folder with the page's files as they are served, the JavaScript client in its folder js among them.
// ROWS.json is what `bagtrack track --format json` writes of two targets in clip.mp4.

import { readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { pathToFileURL } from "node:url";

const [, , page, table, folder, extent] = process.argv;
const { FORMATS } = await import(pathToFileURL(join(page, "save.js")).href);
const told = readFileSync(table, "utf8").trim().split("\n").map((line) => JSON.parse(line));
const names = ['a <thing> & "more"', "Object 2"];
const objects = names.map((name, number) => {
  const own = told.filter(({ target }) => target === number);
  return { number, name, rows: new Map(own.map((row) => [row.frame, row])) };
});
const source = { name: "clip.mp4", size: { width: 320, height: 240 }, rate: 25, duration: 6, skipped: 0 };
const run = { source, objects, skipped: 0, hasAll: extent === "whole" };
for (const [format, file] of [
  ["mot", "mot.txt"],
  ["coco", "coco.json"],
  ["yolo", "yolo.zip"],
  ["cvat", "cvat.xml"],
  ["label-studio", "label-studio.json"],
]) {
  writeFileSync(join(folder, file), Buffer.from(await FORMATS[format].make(run).arrayBuffer()));
}
