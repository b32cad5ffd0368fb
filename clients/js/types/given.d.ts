import { Problem } from "./problem.js";
/** @param {string} detail */
export declare const unsupported: (detail: string) => Problem;
/** The name of a value's class, also of one of another realm, such as a frame's or a test runner's.
 * @param {unknown} value */
export declare const className: (value: unknown) => string;
/** Refuses what is no image for a tracker here.
 * @param {any} image */
export declare function checkImage(image: any): undefined;
/** The size in which an image is drawn; or a refusal, since in place of nothing a black frame would be tracked.
 * @param {import("./image.js").Drawable} image */
export declare function sizeOf(image: import("./image.js").Drawable): number[];
/** The frame itself; or a refusal. What a WebSocket would send as a text or not at all is none, and shared memory is
 * sent by no browser.
 * @param {import("./client.js").Frame} frame
 * @returns {Blob | Uint8Array<ArrayBuffer>} */
export declare function frameOf(frame: import("./client.js").Frame): Blob | Uint8Array<ArrayBuffer>;
/** The bytes of a snapshot; or a refusal.
 * @param {import("./client.js").Frame} snapshot */
export declare function snapshotBytes(snapshot: import("./client.js").Frame): Promise<Uint8Array<ArrayBuffer>>;
/** The bytes of a frame. A file is read, since it may be changed or removed before it is sent, or sent again.
 * @param {Blob | Uint8Array<ArrayBuffer>} frame
 * @returns {Promise<Uint8Array<ArrayBuffer>>} */
export declare function bytesOf(frame: Blob | Uint8Array<ArrayBuffer>): Promise<Uint8Array<ArrayBuffer>>;
/** @param {number} window Frames on their way at a time. */
export declare function checkWindow(window: number): number;
/** A number of this name; or a refusal: with "20s" or NaN a client would wait for ever, or not at all.
 * @param {string} name
 * @param {number} number */
export declare function checkNumber(name: string, number: number): number;
/** The box itself, which its owner may change afterwards; or a refusal.
 * @param {import("./session.js").Box} box
 * @returns {import("./session.js").Box} */
export declare function boxOf(box: import("./session.js").Box): import("./session.js").Box;
/** @param {import("./session.js").Box} box */
export declare function boxText(box: import("./session.js").Box): string;
