export { Client } from "./client.js";
export { LocalClient, LocalSession, LocalStream } from "./local.js";
export { Problem } from "./problem.js";
export { Session } from "./session.js";
export { FrameStream } from "./stream.js";
export type Frame = import("./client.js").Frame;
export type OpenOptions = import("./client.js").OpenOptions;
export type Image = import("./image.js").Image;
export type Box = import("./session.js").Box;
export type Answer = import("./session.js").Answer;
export type View = import("./session.js").View;
export type StreamAnswer = import("./stream.js").StreamAnswer;
export type StreamOptions = import("./stream.js").StreamOptions;
export type TrackerOptions = import("./tracker.js").TrackerOptions;
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
