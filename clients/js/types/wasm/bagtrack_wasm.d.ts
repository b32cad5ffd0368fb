/**
 * An affine subspace of the bag, as pictures.
 */
export declare class Entry {
    __wbg_ptr: number | undefined;
    static __wrap(ptr: any): any;
    __destroy_into_raw(): number | undefined;
    free(): void;
    /**
     * Cells across.
     * @returns {number}
     */
    get columns(): number;
    /**
     * The values of the mean, then those of the columns of the basis.
     * @returns {Float32Array}
     */
    get values(): Float32Array;
    /**
     * Cells across.
     * @param {number} arg0
     */
    set columns(arg0: number);
    /**
     * The values of the mean, then those of the columns of the basis.
     * @param {Float32Array | number[]} arg0
     */
    set values(arg0: Float32Array | number[]);
}
/**
 * The answer to a frame.
 */
export declare class Estimate {
    __wbg_ptr: number | undefined;
    static __wrap(ptr: any): any;
    __destroy_into_raw(): number | undefined;
    free(): void;
    /**
     * `tracking`, `uncertain` or `lost`.
     * @returns {string}
     */
    get status(): string;
    /**
     * The number of the frame; that of the first is 0.
     * @returns {number}
     */
    get frame(): number;
    /**
     * The height of the box.
     * @returns {number}
     */
    get height(): number;
    /**
     * The chance that the box overlaps the target by half or more.
     * @returns {number}
     */
    get score(): number;
    /**
     * The width of the box.
     * @returns {number}
     */
    get width(): number;
    /**
     * The left edge of the box, in pixels of the frame.
     * @returns {number}
     */
    get x(): number;
    /**
     * The upper edge of the box.
     * @returns {number}
     */
    get y(): number;
    /**
     * The number of the frame; that of the first is 0.
     * @param {number} arg0
     */
    set frame(arg0: number);
    /**
     * The height of the box.
     * @param {number} arg0
     */
    set height(arg0: number);
    /**
     * The chance that the box overlaps the target by half or more.
     * @param {number} arg0
     */
    set score(arg0: number);
    /**
     * The width of the box.
     * @param {number} arg0
     */
    set width(arg0: number);
    /**
     * The left edge of the box, in pixels of the frame.
     * @param {number} arg0
     */
    set x(arg0: number);
    /**
     * The upper edge of the box.
     * @param {number} arg0
     */
    set y(arg0: number);
}
/**
 * A frame of a video.
 */
export declare class Frame {
    __wbg_ptr: number | undefined;
    static __wrap(ptr: any): any;
    __destroy_into_raw(): number | undefined;
    free(): void;
    /**
     * A frame of planes, as JPEG has them (Rec. 601, full range): `width` x `height` values of luma and, where there
     * is colour, Cb and Cr in half of the columns and rows, rounded up.
     *
     * # Errors
     * A side of 0, or a plane of another size.
     * @param {number} width
     * @param {number} height
     * @param {Uint8Array | number[]} luma
     * @param {Uint8Array | number[] | null} [cb]
     * @param {Uint8Array | number[] | null} [cr]
     * @returns {Frame}
     */
    static fromPlanes(width: number, height: number, luma: Uint8Array | number[], cb?: Uint8Array | number[] | null, cr?: Uint8Array | number[] | null): Frame;
    /**
     * A frame of `width` x `height` RGBA pixels row by row, as in `ImageData`. What is transparent is blended over
     * black.
     *
     * # Errors
     * A side of 0, or a number of bytes that is not `4 * width * height`.
     * @param {number} width
     * @param {number} height
     * @param {Uint8Array | number[]} rgba
     * @returns {Frame}
     */
    static fromRgba(width: number, height: number, rgba: Uint8Array | number[]): Frame;
}
/**
 * The parameters of a tracker.
 */
export declare class Parameters {
    __wbg_ptr: any;
    static __wrap(ptr: any): any;
    __destroy_into_raw(): any;
    free(): void;
    /**
     * The value of a parameter; undefined where there is no such one.
     * @param {string} name
     * @returns {number | undefined}
     */
    get(name: string): number | undefined;
    /**
     * The names of all that can be set.
     * @returns {string[]}
     */
    static names(): string[];
    /**
     * Those of the preset `robust` or `paper`.
     *
     * # Errors
     * There is no such preset.
     * @param {string} preset
     */
    constructor(preset: string);
    /**
     * Sets a parameter. Its range is checked when a tracker starts.
     *
     * # Errors
     * There is no such parameter, or it is a whole number and `value` is none.
     * @param {string} name
     * @param {number} value
     */
    set(name: string, value: number): void;
}
/**
 * What the answer to a frame was chosen from.
 */
export declare class Seen {
    __wbg_ptr: number | undefined;
    static __wrap(ptr: any): any;
    __destroy_into_raw(): number | undefined;
    free(): void;
    /**
     * The answer.
     * @returns {Estimate}
     */
    get estimate(): Estimate;
    /**
     * For each of the likeliest particles its centre x and y, its width and its weight; the likeliest first.
     * @returns {Float64Array}
     */
    get particles(): Float64Array;
    /**
     * For each entry of the bag, oldest first, its share of the vote for the answer.
     * @returns {Float64Array}
     */
    get votes(): Float64Array;
    /**
     * The answer.
     * @param {Estimate} arg0
     */
    set estimate(arg0: Estimate);
    /**
     * For each of the likeliest particles its centre x and y, its width and its weight; the likeliest first.
     * @param {Float64Array | number[]} arg0
     */
    set particles(arg0: Float64Array | number[]);
    /**
     * For each entry of the bag, oldest first, its share of the vote for the answer.
     * @param {Float64Array | number[]} arg0
     */
    set votes(arg0: Float64Array | number[]);
}
/**
 * Follows one object.
 */
export declare class Tracker {
    __wbg_ptr: any;
    static __wrap(ptr: any): any;
    __destroy_into_raw(): any;
    free(): void;
    /**
     * What the tracker keeps of the target: for each entry of the bag, oldest first, the gray values of its mean and
     * of the columns of its basis, each row by row.
     * @returns {Entry[]}
     */
    get bag(): Entry[];
    /**
     * Takes `frame` as the next one, with the right box in it.
     *
     * # Errors
     * As for `step` and `new`.
     * @param {Frame} frame
     * @param {Float64Array | number[]} target
     * @returns {Estimate}
     */
    correct(frame: Frame, target: Float64Array | number[]): Estimate;
    /**
     * The last answer.
     * @returns {Estimate}
     */
    get estimate(): Estimate;
    /**
     * A tracker that goes on from the bytes of `save`, here or elsewhere.
     *
     * # Errors
     * Bytes that are no such snapshot, or are damaged.
     * @param {Uint8Array | number[]} snapshot
     * @returns {Tracker}
     */
    static load(snapshot: Uint8Array | number[]): Tracker;
    /**
     * Starts on `frame` with a box in its pixels: x, y, width, height.
     *
     * # Errors
     * A parameter or a box that cannot be used.
     * @param {Frame} frame
     * @param {Float64Array | number[]} target
     * @param {Parameters} parameters
     */
    constructor(frame: Frame, target: Float64Array | number[], parameters: Parameters);
    /**
     * Its parameters.
     * @returns {Parameters}
     */
    get parameters(): Parameters;
    /**
     * The whole state as bytes.
     * @returns {Uint8Array}
     */
    save(): Uint8Array;
    /**
     * Like `step`, with what the answer was chosen from.
     *
     * # Errors
     * As for `step`.
     * @param {Frame} frame
     * @returns {Seen}
     */
    see(frame: Frame): Seen;
    /**
     * Width and height of the frames.
     * @returns {Uint32Array}
     */
    get size(): Uint32Array;
    /**
     * Finds the target in the next frame.
     *
     * # Errors
     * A frame of another size than the first one.
     * @param {Frame} frame
     * @returns {Estimate}
     */
    step(frame: Frame): Estimate;
}
declare function initSync(module: any): any;
declare function __wbg_init(module_or_path: any): Promise<any>;
export { initSync, __wbg_init as default };
