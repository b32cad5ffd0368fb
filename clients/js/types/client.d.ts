import { Session } from "./session.js";
import { Transport } from "./transport.js";
export type Frame = Blob | ArrayBuffer | Uint8Array;
export type OpenOptions = {
    preset?: "robust" | "paper";
    /**
     * Seed of all random draws; a random one when left out.
     */
    seed?: number;
    /**
     * Parameters that are set otherwise than in the preset.
     */
    parameters?: Record<string, unknown>;
    signal?: AbortSignal;
};
export type SocketClass = new (url: URL, protocols: string[]) => import("./stream.js").Socket;
export declare class Client {
    transport: Transport;
    snapshotEvery: number;
    /** @type {SocketClass | undefined} */
    WebSocket: SocketClass | undefined;
    /**
     * @param {string | URL} url Where the service is, with its base path, where it has one.
     * @param {object} [options]
     * @param {string} [options.key] An API key or a session token, where the service has keys.
     * @param {number} [options.patience] Milliseconds in which a call that fails for a moment is made again (20,000).
     * @param {number} [options.snapshotEvery] Frames after which a session takes a snapshot, to go on after the service has
     *   lost it (30). At 0 it takes none, and such a session has ended.
     * @param {SocketClass} [options.WebSocket] For streams, where the platform has none: Node before 22.
     */
    constructor(url: string | URL, options?: {
        key?: string;
        patience?: number;
        snapshotEvery?: number;
        WebSocket?: SocketClass;
    });
    /** The key that is sent with every call. */
    set key(/** @type {string} */ key: string);
    /**
     * Opens a session. The client makes its id, so that asking twice opens one session.
     * @param {Frame} frame The first frame.
     * @param {import("./session.js").Box} box The target's box in it.
     * @param {OpenOptions} [options]
     * @returns {Promise<Session>}
     */
    open(frame: Frame, box: import("./session.js").Box, { preset, seed, parameters, signal }?: OpenOptions): Promise<Session>;
    /**
     * Opens a session that goes on where a snapshot was taken, here or at another instance with the same secret.
     * @param {Frame} snapshot
     * @param {AbortSignal} [signal]
     * @param {number} [patience] Milliseconds in which a call that fails for a moment is made again; as the client's.
     * @returns {Promise<Session>}
     */
    restore(snapshot: Frame, signal?: AbortSignal, patience?: number): Promise<Session>;
    /**
     * A session that is open already, such as one that a page was given a token for. When the service loses it, it has
     * ended: only a session that this client has opened goes on.
     * @param {string} id
     * @returns {Promise<Session>}
     */
    attach(id: string): Promise<Session>;
    /** @param {import("./transport.js").Request} request */
    create(request: import("./transport.js").Request): Promise<Session>;
}
