// The client of bagtrack: `new Client(url)`, `client.open(frame, box)`, `session.track(frame)`. The
// tracker in this page or process: `new LocalClient()`, with the same calls.

export { Client } from "./client.js";
export { LocalClient, LocalSession, LocalStream } from "./local.js";
export { Problem } from "./problem.js";
export { Session } from "./session.js";
export { FrameStream } from "./stream.js";

/**
 * @typedef {import("./client.js").Frame} Frame
 * @typedef {import("./client.js").OpenOptions} OpenOptions
 * @typedef {import("./image.js").Image} Image
 * @typedef {import("./session.js").Box} Box
 * @typedef {import("./session.js").Answer} Answer
 * @typedef {import("./session.js").View} View
 * @typedef {import("./stream.js").StreamAnswer} StreamAnswer
 * @typedef {import("./stream.js").StreamOptions} StreamOptions
 * @typedef {import("./tracker.js").TrackerOptions} TrackerOptions
 */
