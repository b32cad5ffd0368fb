import { Problem } from "./problem.js";
export type Seen = {
    /**
     * Centre x and y, width, weight; likeliest first.
     */
    particles?: number[][];
    /**
     * One for each entry of the bag.
     */
    votes?: number[];
};
export type StreamAnswer = import("./session.js").Answer & Seen;
export type StreamOptions = {
    /**
     * Whether the newest frame wins: one that waits is skipped when a newer one comes.
     */
    live?: boolean;
    /**
     * Frames on their way at a time, 1 to 32 (8).
     */
    window?: number;
    /**
     * Milliseconds in which a broken line is opened again; as the client's when left out. It
     * ends before that where the service answers eight times, and gives no stream.
     */
    patience?: number;
    /**
     * Is told when the line breaks and when it is up again.
     */
    onLine?: (isUp: boolean) => void;
};
export type Socket = {
    onmessage: ((event: any) => void) | null;
    onclose: ((event: any) => void) | null;
    onerror: ((event: any) => void) | null;
    send: (data: any) => void;
    close: () => void;
};
export type Waiting = {
    frame: Blob | Uint8Array<ArrayBuffer>;
    header: {
        box?: import("./session.js").Box;
        see?: boolean;
    };
    resolve: (answer: StreamAnswer | undefined) => void;
    reject: (problem: unknown) => void;
};
export declare class FrameStream {
    session: import("./session.js").Session;
    live: boolean;
    window: number;
    patience: number;
    onLine: (isUp: boolean) => void;
    /** @type {Waiting[]} Oldest first. */
    waiting: Waiting[];
    /** How many of those that wait are on their way. */
    sent: number;
    /** How many of those have a number that is not theirs any more, since a frame before them was refused. */
    outOfOrder: number;
    /** @type {Waiting | undefined} Whose frame is being read: the next one to be sent. */
    reading: Waiting | undefined;
    /** @type {Socket | undefined} */
    socket: Socket | undefined;
    /** @type {ReturnType<typeof setTimeout> | undefined} Ends a line that is silent. */
    silence: ReturnType<typeof setTimeout> | undefined;
    isUp: boolean;
    /** Whether it was told that the line is broken. */
    isDown: boolean;
    /** How often the session could be read since the line broke, so that only the stream cannot be opened. */
    readings: number;
    /** How often the session was opened again since the last answer. */
    reopened: number;
    isEnded: boolean;
    wait: number;
    /** When the line broke. */
    downSince: number;
    /** @type {Problem | undefined} */
    lastProblem: Problem | undefined;
    /** @type {Problem | undefined} The service has lost the session; it is opened again with the next frame. */
    lost: Problem | undefined;
    /** @type {{origin: import("./kept.js").Origin, until: number} | undefined} A snapshot of a frame up to `until`. */
    newer: {
        origin: import("./kept.js").Origin;
        until: number;
    } | undefined;
    isRenewing: boolean;
    /** @type {Error | undefined} What a frame is told that comes too late. */
    whyEnded: Error | undefined;
    /** @type {(problem: Error | undefined) => void} */
    resolveEnded: (problem: Error | undefined) => void;
    /** @type {Promise<Error | undefined>} The stream has ended: why, if it was not by `close`. */
    ended: Promise<Error | undefined>;
    /** Browsers tell when the network goes. A socket does not, for long. */
    offline: () => void;
    /**
     * @param {import("./session.js").Session} session
     * @param {StreamOptions} [options]
     */
    constructor(session: import("./session.js").Session, options?: StreamOptions);
    /**
     * Sends the next frame. Many may be sent without waiting for their answers.
     * @param {import("./client.js").Frame} frame
     * @param {object} [header]
     * @param {import("./session.js").Box} [header.box] The right box in this frame, which may be one that was sent before.
     * @param {boolean} [header.see] Whether the answer shall tell what the tracker saw.
     * @returns {Promise<StreamAnswer | undefined>} Nothing where the frame was skipped, in a live stream.
     */
    track(frame: import("./client.js").Frame, { box, see }?: {
        box?: import("./session.js").Box;
        see?: boolean;
    }): Promise<StreamAnswer | undefined>;
    /** Of live frames that cannot be sent yet, the newest is kept. One with a box is skipped for another one with a box.
     * @param {boolean} hasBox Whether the newest has one. */
    skip(hasBox: boolean): void;
    /** Ends the stream; the session goes on. Nobody is told the answers to frames on their way, but those frames count. */
    close(): void;
    transmit(): Promise<void> | undefined;
    /** Takes the line for broken where what is asked for does not come: not every line that breaks tells. */
    listen(): void;
    /** Takes the line for broken. */
    drop(): void;
    /** Reads a frame that may be a file, and goes on. A socket that cannot read it would not tell.
     * @param {Waiting} next */
    read(next: Waiting): Promise<void>;
    /** @param {any} message */
    receive(message: any): void | Promise<void>;
    /** Makes sure, after an answer, that the session can be opened again.
     * @param {number | undefined} stored The last frame that a store has. */
    checkpoint(stored: number | undefined): Promise<void>;
    /** Takes the oldest frame on its way, which has an answer. */
    acknowledge(): Waiting | undefined;
    /** @param {Problem} problem */
    refused(problem: Problem): void | Promise<void>;
    /** The service expects frame `next`: it has those before it, and sends their answers.
     * @param {number} next */
    resume(next: number): void;
    /** The service has no frames from `next` on any more: they are sent again before those that wait.
     * @param {number} next */
    resendFrom(next: number): void;
    /** The service has lost the session.
     * @param {Problem} problem */
    gone(problem: Problem): void | Promise<void>;
    /** Opens the session again, and the stream with it.
     * @param {Problem} problem What told that the service has lost it. */
    reopen(problem: Problem): Promise<void>;
    connect(): Promise<void>;
    /** Whether the line has been broken for so long that it is not opened again. */
    get isLate(): boolean;
    /** A socket cannot send the key. It takes a token, as which a key that is a token itself will do. */
    token(): Promise<string>;
    /**
     * @param {number} code
     * @returns {Promise<void>}
     */
    closed(code: number): Promise<void>;
    /** Waits before another try, longer each time. */
    rest(): Promise<void>;
    breakLine(): void;
    /** The service does not take this stream.
     * @param {Error} problem */
    refusedFor(problem: Error): void;
    /** @param {number} status */
    reason(status: number): Problem;
    /** @param {Error | undefined} problem */
    end(problem: Error | undefined): void;
}
