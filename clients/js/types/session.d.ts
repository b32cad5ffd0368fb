import { Kept } from "./kept.js";
import { Problem } from "./problem.js";
import { FrameStream } from "./stream.js";
export type Box = {
    x: number;
    y: number;
    width: number;
    height: number;
};
export type Answer = {
    /**
     * The number of the frame; the first of a session is 0.
     */
    frame: number;
    box: Box;
    /**
     * The chance that the box overlaps the target by half or more.
     */
    score: number;
    status: "tracking" | "uncertain" | "lost";
};
export type View = {
    id: string;
    frames: number;
    answer: Answer;
    image: {
        width: number;
        height: number;
    };
    parameters: Record<string, unknown>;
    expires_at: string;
};
export type Frame = import("./client.js").Frame;
export type Sent = {
    frames: (Blob | Uint8Array<ArrayBuffer>)[];
    /**
     * Where the user corrects it.
     */
    box?: Box;
    make: (number: number, frames: Uint8Array<ArrayBuffer>[]) => Promise<Response>;
    signal?: AbortSignal;
};
export declare class Session {
    client: import("./client.js").Client;
    id: string;
    /** The number of its last frame. */
    frame: number;
    /** The box of that frame. */
    box: Box;
    score: number;
    status: "lost" | "tracking" | "uncertain";
    isOwn: boolean;
    /** The last frame that the service has, as far as is known. */
    lastAcknowledged: number;
    /** Whether the service is about to end: the session goes on elsewhere, as soon as another one takes it. */
    isDraining: boolean;
    /** When that was tried last. */
    triedToMove: number;
    /** What the service may ask for again. */
    kept: Kept;
    /** @type {Promise<unknown>} The requests before. */
    before: Promise<unknown>;
    /** @type {Set<Promise<unknown>>} What is being read of it. */
    reading: Set<Promise<unknown>>;
    isEnded: boolean;
    /** @type {FrameStream | undefined} */
    open: FrameStream | undefined;
    /**
     * @param {import("./client.js").Client} client
     * @param {string} id
     * @param {Answer} answer The last one.
     * @param {Headers} headers Of the answer that told so.
     * @param {import("./kept.js").Origin} [origin] What opens it again.
     * @param {boolean} [isOwn] Whether this client has opened it.
     */
    constructor(client: import("./client.js").Client, id: string, answer: Answer, headers: Headers, origin?: import("./kept.js").Origin, isOwn?: boolean);
    /** @param {Answer} answer */
    take({ frame, box, score, status }: Answer): void;
    /**
     * Sends the next frame. Calls are made one after the other, in the order of `track`. A frame that got no answer, or
     * whose call was aborted, is kept: the next call sends it before its own.
     * @param {Frame} frame
     * @param {AbortSignal} [signal]
     * @returns {Promise<Answer>}
     */
    track(frame: Frame, signal?: AbortSignal): Promise<Answer>;
    /**
     * Sends several frames at once. If one is bad, none is taken.
     * @param {Iterable<Frame>} frames
     * @param {AbortSignal} [signal]
     * @returns {Promise<Answer[]>}
     */
    trackAll(frames: Iterable<Frame>, signal?: AbortSignal): Promise<Answer[]>;
    /**
     * Sends a frame as the next one with the right box in it. It may be one that was sent before.
     * @param {Frame} frame
     * @param {Box} box
     * @param {AbortSignal} [signal]
     * @returns {Promise<Answer>}
     */
    correct(frame: Frame, box: Box, signal?: AbortSignal): Promise<Answer>;
    /** The session's state; the service does not count this as a frame.
     * @returns {Promise<View>} */
    read(): Promise<View>;
    /** The whole session as bytes, for `client.restore`.
     * @returns {Promise<Uint8Array<ArrayBuffer>>} */
    snapshot(): Promise<Uint8Array<ArrayBuffer>>;
    /** A picture (PNG) of what the tracker keeps of the target.
     * @returns {Promise<Blob>} */
    bag(): Promise<Blob>;
    /** A token for this session alone, to be given to a page.
     * @param {number} [seconds] How long it is good for (3600).
     * @returns {Promise<string>} */
    token(seconds?: number): Promise<string>;
    /** Sends frames over a WebSocket, many at a time. Until it is closed no frames are sent otherwise.
     * @param {import("./stream.js").StreamOptions} [options]
     * @returns {FrameStream} */
    stream(options?: import("./stream.js").StreamOptions): FrameStream;
    /** @param {FrameStream | undefined} stream What sends this session's frames now. */
    hold(stream: FrameStream | undefined): void;
    /** Ends the session, and its stream. */
    end(): Promise<void>;
    /**
     * @param {string} method
     * @param {string} path Below that of the session.
     * @param {import("./transport.js").Request} [request]
     */
    call(method: string, path: string, request?: import("./transport.js").Request): Promise<Response>;
    /** @param {Promise<Response>} called */
    noteReading(called: Promise<Response>): Promise<Response>;
    /**
     * @param {string} method
     * @param {string} path
     * @param {Record<string, string | number>} query
     * @param {BodyInit} body
     * @param {AbortSignal} [signal]
     */
    post(method: string, path: string, query: Record<string, string | number>, body: BodyInit, signal?: AbortSignal): Promise<Response>;
    /**
     * @param {number} number
     * @param {Uint8Array<ArrayBuffer>} frame
     * @param {Box} box
     * @param {AbortSignal} [signal]
     */
    put(number: number, frame: Uint8Array<ArrayBuffer>, box: Box, signal?: AbortSignal): Promise<Response>;
    /**
     * Makes a request with the next frames after those before.
     * @param {Sent} sent
     */
    next(sent: Sent): Promise<any>;
    /** @param {Sent} sent */
    send({ frames: given, box, make, signal }: Sent): Promise<any>;
    /** Makes sure, after an answer, that the session can go on elsewhere.
     * @param {string | null} stored The last frame that a store has. */
    checkpoint(stored: string | null): Promise<void>;
    get takesSnapshots(): boolean;
    get isSnapshotDue(): boolean;
    /** A snapshot of now or later; nothing where there is none for the moment.
     * @returns {Promise<import("./kept.js").Origin | undefined>} */
    takeOrigin(): Promise<import("./kept.js").Origin | undefined>;
    /** Takes a snapshot; without it the older one and more frames are kept. */
    renewOrigin(): Promise<import("./kept.js").Origin | undefined>;
    /** Goes on elsewhere, under another id. While there is nothing else, it goes on here. */
    move(): Promise<void>;
    /**
     * Makes a call for which the service must have the frames before one, and sends those that it does not have.
     * @param {number} number The first frame that the call does not need.
     * @param {(number: number) => Promise<Response>} call
     * @param {AbortSignal} [signal]
     */
    deliver(number: number, call: (number: number) => Promise<Response>, signal?: AbortSignal): Promise<Response>;
    /**
     * @param {number} number A frame that the service does not have.
     * @param {AbortSignal} [signal]
     */
    resend(number: number, signal?: AbortSignal): Promise<void>;
    /**
     * The frame to go on with after an error; undefined: the session is to be opened again. Throws the error where neither
     * helps.
     * @param {unknown} error
     * @param {number} number The first frame that the call does not need.
     * @returns {number | undefined}
     */
    recovery(error: unknown, number: number): number | undefined;
    /**
     * Opens the session again after the service has lost it, under another id.
     * @param {Problem} lost What told so.
     * @param {AbortSignal} [signal]
     * @returns {Promise<number>} The last frame that it has then.
     */
    reopen(lost: Problem, signal?: AbortSignal): Promise<number>;
}
