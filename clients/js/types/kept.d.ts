export type Origin = {
    frame: number;
    request: import("./transport.js").Request;
};
export type KeptFrame = {
    number: number;
    frame: Uint8Array<ArrayBuffer>;
    /**
     * Where the user corrected it.
     */
    box?: import("./session.js").Box;
};
/**
 * @typedef {object} Origin What opens the session again, as it was at a frame or later.
 * @property {number} frame
 * @property {import("./transport.js").Request} request
 *
 * @typedef {object} KeptFrame A frame that was sent or is to be sent.
 * @property {number} number
 * @property {Uint8Array<ArrayBuffer>} frame
 * @property {import("./session.js").Box} [box] Where the user corrected it.
 */
/** Most frames that are kept. */
export declare const MOST_KEPT = 256;
export declare const SNAPSHOT = "application/vnd.bagtrack.snapshot";
/** The request that goes on where a snapshot was taken.
 * @param {Uint8Array<ArrayBuffer>} snapshot
 * @returns {import("./transport.js").Request} */
export declare function restoring(snapshot: Uint8Array<ArrayBuffer>): import("./transport.js").Request;
export declare class Kept {
    /** While there is one, all frames after it are kept. */
    origin: Origin | undefined;
    /** @type {KeptFrame[]} Oldest first, without gaps. */
    frames: KeptFrame[];
    /** @param {Origin} [origin] */
    constructor(origin?: Origin);
    /** The number of the newest frame. */
    get last(): number | undefined;
    /** @param {number} number */
    find(number: number): KeptFrame | undefined;
    /** Keeps the next frame. The oldest goes where there are too many.
     * @param {KeptFrame} kept */
    put(kept: KeptFrame): void;
    /** A newer origin; the frames up to there are not needed any more.
     * @param {Origin} origin */
    renew(origin: Origin): void;
    /** Forgets the frames up to this one, which the service does not ask for again.
     * @param {number} number */
    forgetUntil(number: number): void;
    /** Forgets the frames after this one, which the service does not have.
     * @param {number} number */
    forgetAfter(number: number): void;
    /** The frames after this one.
     * @param {number} number */
    after(number: number): KeptFrame[];
}
