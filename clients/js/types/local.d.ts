import { Problem } from "./problem.js";
export type Image = import("./image.js").Image;
export type Answer = import("./session.js").Answer;
export type Box = import("./session.js").Box;
export type View = import("./session.js").View;
export type StreamAnswer = import("./stream.js").StreamAnswer;
export type Waiting = {
    resolve: (value: any) => void;
    reject: (problem: unknown) => void;
};
/** A thread with trackers. Sessions of one client share it, and decode a frame once for all of them. */
export declare class LocalClient {
    /** @type {Promise<any> | undefined} */
    worker: Promise<any> | undefined;
    /** @type {Problem | undefined} Why the worker before has ended. */
    lastProblem: Problem | undefined;
    /** @type {Map<number, Waiting>} Calls without an answer. */
    waiting: Map<number, Waiting>;
    calls: number;
    /** @type {Promise<unknown>} The calls before are sent. */
    before: Promise<unknown>;
    constructor();
    /** Loads the tracker, so that the first session need not wait for it. */
    warm(): Promise<void>;
    /**
     * Opens a session.
     * @param {Image} image The first frame.
     * @param {Box} box The target's box in it.
     * @param {import("./tracker.js").TrackerOptions & {signal?: AbortSignal}} [options]
     */
    open(image: Image, box: Box, { signal, ...options }?: import("./tracker.js").TrackerOptions & {
        signal?: AbortSignal;
    }): Promise<LocalSession>;
    /** Opens a session that goes on where a snapshot was taken: here, by another local session, or by the service.
     * @param {import("./client.js").Frame} snapshot
     * @param {AbortSignal} [signal] */
    restore(snapshot: import("./client.js").Frame, signal?: AbortSignal): Promise<LocalSession>;
    /**
     * Tracks the next frame of several sessions.
     * @param {LocalSession[]} sessions
     * @param {Image} image
     * @param {{see?: boolean, signal?: AbortSignal}} [options]
     * @returns {Promise<StreamAnswer[]>} Theirs, in their order.
     */
    track(sessions: LocalSession[], image: Image, { see, signal }?: {
        see?: boolean;
        signal?: AbortSignal;
    }): Promise<StreamAnswer[]>;
    /** Ends the thread, and all sessions with it. */
    close(): Promise<void>;
    /** @param {Problem} problem */
    fail(problem: Problem): void;
    /**
     * Makes a call to the thread. Calls are answered in their order. One that is aborted before it is sent has no effect.
     * @param {keyof import("./worker.js").Calls} name
     * @param {any} call
     * @param {AbortSignal} [signal]
     * @returns {Promise<any>}
     */
    call(name: keyof import("./worker.js").Calls, call: any, signal?: AbortSignal): Promise<any>;
    /** Refuses a call whose worker has ended since it was made: another one would not know what it is about.
     * @param {Problem | undefined} lastProblem The last one at that time. */
    check(lastProblem: Problem | undefined): void;
    /** The worker, which is started where there is none. */
    started(): Promise<any>;
    /** @param {(problem: Problem) => void} ends */
    start(ends: (problem: Problem) => void): Promise<any>;
    /**
     * @param {any} worker
     * @param {any} answer
     * @param {(problem: Problem) => void} ends
     */
    receive(worker: any, { number, value, problem, isBroken }: any, ends: (problem: Problem) => void): void;
}
/** A session in this page or process. */
export declare class LocalSession {
    client: LocalClient;
    id: number;
    /** The number of its last frame. */
    frame: number;
    /** The box of that frame. */
    box: import("./session.js").Box;
    score: number;
    status: "lost" | "tracking" | "uncertain";
    /**
     * @param {LocalClient} client
     * @param {number} id
     * @param {Answer} answer
     */
    constructor(client: LocalClient, id: number, answer: Answer);
    /** @param {Answer} answer */
    take({ frame, box, score, status }: Answer): void;
    /**
     * Tracks the next frame.
     * @param {Image} image
     * @param {AbortSignal} [signal]
     * @returns {Promise<Answer>}
     */
    track(image: Image, signal?: AbortSignal): Promise<Answer>;
    /**
     * Tracks several frames.
     * @param {Iterable<Image>} images
     * @param {AbortSignal} [signal]
     * @returns {Promise<Answer[]>}
     */
    trackAll(images: Iterable<Image>, signal?: AbortSignal): Promise<Answer[]>;
    /**
     * Takes the next frame with the right box in it. It may be one that was tracked before.
     * @param {Image} image
     * @param {Box} box
     * @param {AbortSignal} [signal]
     * @returns {Promise<Answer>}
     */
    correct(image: Image, box: Box, signal?: AbortSignal): Promise<Answer>;
    /** The session's state.
     * @returns {Promise<Omit<View, "id" | "expires_at">>} */
    read(): Promise<Omit<View, "id" | "expires_at">>;
    /** The whole session as bytes: for `restore` of a local client, and of a client whose service takes unsigned ones.
     * @returns {Promise<Uint8Array<ArrayBuffer>>} */
    snapshot(): Promise<Uint8Array<ArrayBuffer>>;
    /** A picture (PNG) of what the tracker keeps of the target, in browsers.
     * @returns {Promise<Blob>} */
    bag(): Promise<Blob>;
    /** Frames as of a stream of a service.
     * @param {{live?: boolean}} [options] */
    stream(options?: {
        live?: boolean;
    }): LocalStream;
    /** Ends the session.
     * @returns {Promise<void>} */
    end(): Promise<void>;
}
/** Frames one after the other; the newest of live ones. */
export declare class LocalStream {
    session: LocalSession;
    live: boolean;
    isEnded: boolean;
    underWay: number;
    /** @type {(problem: unknown) => void} */
    resolveEnded: (problem: unknown) => void;
    /** @type {Promise<unknown>} The stream has ended: why, if it was not by `close`. */
    ended: Promise<unknown>;
    /**
     * @param {LocalSession} session
     * @param {{live?: boolean}} [options]
     */
    constructor(session: LocalSession, { live }?: {
        live?: boolean;
    });
    /**
     * @param {Image} image
     * @param {{box?: Box, see?: boolean}} [header]
     * @returns {Promise<StreamAnswer | undefined>} Nothing where the frame was skipped, in a live stream.
     */
    track(image: Image, { box, see }?: {
        box?: Box;
        see?: boolean;
    }): Promise<StreamAnswer | undefined>;
    close(): void;
}
