// The client of bagtrack: `new Client(url)`, `client.open(frame, box)`, `session.track(frame)`.

export { Client } from "./client.js";
export { Problem } from "./problem.js";
export { Session } from "./session.js";
export { FrameStream } from "./stream.js";

/**
 * @typedef {import("./client.js").Frame} Frame
 * @typedef {import("./client.js").OpenOptions} OpenOptions
 * @typedef {import("./session.js").Box} Box
 * @typedef {import("./session.js").Answer} Answer
 * @typedef {import("./session.js").View} View
 * @typedef {import("./stream.js").StreamAnswer} StreamAnswer
 * @typedef {import("./stream.js").StreamOptions} StreamOptions
 */
