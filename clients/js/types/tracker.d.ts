import { Frame, Tracker as Wasm } from "./wasm/bagtrack_wasm.js";
export type Image = import("./image.js").Image;
export type Box = import("./session.js").Box;
export type Answer = import("./session.js").Answer;
export type StreamAnswer = import("./stream.js").StreamAnswer;
export type TrackerOptions = {
    preset?: "robust" | "paper";
    /**
     * Seed of all random draws; a random one when left out.
     */
    seed?: number;
    /**
     * Parameters that are set otherwise than in the preset.
     */
    parameters?: Record<string, unknown>;
};
/** A frame for any number of trackers, which its caller frees.
 * @param {Image} image */
export declare function frameFor(image: Image): Promise<Frame>;
/** Follows one object. A call that fails leaves it as it was. */
export declare class Tracker {
    /** @type {Wasm | undefined} */
    own: Wasm | undefined;
    /** The last answer. */
    answer: import("./session.js").Answer;
    /** @type {Promise<unknown>} The calls before. */
    before: Promise<unknown>;
    /** @param {Wasm} wasm */
    constructor(wasm: Wasm);
    /**
     * Starts on the first frame, with the target's box in it.
     * @param {Image | Frame} image
     * @param {Box} box
     * @param {TrackerOptions} [options]
     */
    static create(image: Image | Frame, box: Box, options?: TrackerOptions): Promise<Tracker>;
    get wasm(): Wasm;
    /** Runs with the next frame, after the calls before it.
     * @template T
     * @param {Image | Frame} image
     * @param {(frame: Frame) => T} run */
    next<T>(image: Image | Frame, run: (frame: Frame) => T): Promise<T>;
    /** A tracker that goes on from a snapshot: of `save`, or of the service.
     * @param {import("./client.js").Frame} snapshot */
    static load(snapshot: import("./client.js").Frame): Promise<Tracker>;
    /** The whole state as bytes: for `load`, and for a service that takes unsigned snapshots. */
    save(): Uint8Array<ArrayBuffer>;
    /**
     * Finds the target in the next frame. Frames are taken in the order of the calls.
     * @param {Image | Frame} image
     * @param {object} [options]
     * @param {boolean} [options.see] Whether the answer shall tell what the tracker saw.
     * @returns {Promise<StreamAnswer>}
     */
    step(image: Image | Frame, { see }?: {
        see?: boolean;
    }): Promise<StreamAnswer>;
    /** Takes the next frame with the right box in it.
     * @param {Image | Frame} image
     * @param {Box} box */
    correct(image: Image | Frame, box: Box): Promise<import("./session.js").Answer>;
    /** The number of the last frame; that of the first is 0. */
    get frame(): number;
    get box(): import("./session.js").Box;
    get score(): number;
    get status(): "lost" | "tracking" | "uncertain";
    /** Of the frames, in pixels. */
    get size(): {
        width: number;
        height: number;
    };
    get parameters(): Record<string, number>;
    /** What it keeps of the target: for each affine subspace, oldest first, its mean, then the columns of its basis, each as
     * gray values row by row. */
    get bag(): {
        columns: number;
        vectors: Float32Array<ArrayBuffer>[];
    }[];
    /** Gives up its memory. */
    free(): void;
}
