import { Problem } from "./problem.js";
/** @param {string} detail */
export declare const unsupported: (detail: string) => Problem;
/** Refuses what is no image for a tracker here.
 * @param {unknown} image */
export declare function checkImage(image: unknown): void;
/** Refuses what a WebSocket would send as a text, or not at all.
 * @param {unknown} frame */
export declare function checkFrame(frame: unknown): void;
/** @param {number} window Frames on their way at a time. */
export declare function checkWindow(window: number): number;
/** The box itself, which its owner may change afterwards; or a refusal.
 * @param {import("./session.js").Box} box
 * @returns {import("./session.js").Box} */
export declare function boxOf(box: import("./session.js").Box): import("./session.js").Box;
/** @param {import("./session.js").Box} box */
export declare function boxText(box: import("./session.js").Box): string;
