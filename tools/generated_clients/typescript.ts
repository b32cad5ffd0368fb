// Tracks the sample clip of the service with the TypeScript client that openapi-generator generates.

import { Configuration, ResponseError, SessionsApi } from "./generated/index.js";

/** Given on the command line. */
declare const process: { argv: string[] };

const url = process.argv[2];
const sessions = new SessionsApi(new Configuration({ basePath: url }));
const clip = await (await fetch(`${url}/sample/card/clip.json`)).json();
const frame = async (index: number) => (await fetch(`${url}/sample/card/${index}.jpg`)).blob();
const box = clip.truth[0].slice(0, 4).join(",");
const session = await sessions.createSession({ body: await frame(0), box, seed: 7 });
const frames = await Promise.all(Array.from({ length: 100 }, (_, index) => frame(index + 1)));
const started = performance.now();
const boxes = [];
for (const [index, body] of frames.entries()) {
  const answer = await sessions.postFrames({ id: session.id, frame: index + 1, body });
  boxes.push([answer.box.x, answer.box.y, answer.box.width, answer.box.height].join());
}
const each = (performance.now() - started) / boxes.length;
// The same frames with plain posts.
const plain = await (await fetch(`${url}/sessions?box=${box}&seed=7`, { method: "POST", body: await frame(0) })).json();
let equal = 0;
for (const [index, body] of frames.entries()) {
  const answer = await (await fetch(`${url}/sessions/${plain.id}/frames`, { method: "POST", body })).json();
  equal += Number(boxes[index] === [answer.box.x, answer.box.y, answer.box.width, answer.box.height].join());
}
console.log(`openapi-generator, TypeScript: ${equal} of 100 boxes equal to plain posts, ${each.toFixed(1)} ms a frame`);
const snapshot = await sessions.getSnapshot({ id: session.id });
const restored = await sessions.createSession({ body: snapshot });
const { raw } = await sessions.postFramesRaw({ id: session.id, body: frames[0], draw: true });
if (raw.headers.get("content-type") !== "image/png" || !(await raw.blob()).size) throw new Error("nothing was drawn");
if (equal !== 100 || restored.frame !== 100) throw new Error("not as it should be");
try {
  await sessions.postFrames({ id: session.id, body: new Blob(["no picture"]) });
  throw new Error("no picture was taken");
} catch (error) {
  if (!(error instanceof ResponseError) || error.response.status !== 415) throw error;
}
