/** A connection is taken for dead when there is no answer for so many milliseconds, with so many bytes on their way.
 * @param {number} bytes */
export declare const longest: (bytes: number) => number;
export type Request = {
    query?: Record<string, string | number | undefined>;
    body?: BodyInit;
    /**
     * The media type of the body.
     */
    type?: string;
    signal?: AbortSignal;
    /**
     * Milliseconds in which the call is made again; as the client's when left out.
     */
    patience?: number;
};
/**
 * @typedef {object} Request
 * @property {Record<string, string | number | undefined>} [query]
 * @property {BodyInit} [body]
 * @property {string} [type] The media type of the body.
 * @property {AbortSignal} [signal]
 * @property {number} [patience] Milliseconds in which the call is made again; as the client's when left out.
 */
/**
 * Waits, or fails as soon as the signal says so.
 * @param {number} milliseconds
 * @param {AbortSignal} [signal]
 * @returns {Promise<void>}
 */
export declare function pause(milliseconds: number, signal?: AbortSignal): Promise<void>;
/**
 * What an answer says. A problem where it is none of the service's, such as a page of a proxy.
 * @param {Response} response
 * @param {...string} members What its document has.
 * @returns {Promise<any>}
 */
export declare function documentOf(response: Response, ...members: string[]): Promise<any>;
/** The snapshot in an answer.
 * @param {Response} response */
export declare function snapshotOf(response: Response): Promise<Uint8Array<ArrayBuffer>>;
export declare class Transport {
    url: URL;
    key: string;
    patience: number;
    /**
     * @param {string | URL} url Where the service is.
     * @param {string} key An API key or a session token; empty where the service has no keys.
     * @param {number} patience Milliseconds in which a call is made again.
     */
    constructor(url: string | URL, key: string, patience: number);
    /**
     * @param {string} path Below the service's address.
     * @param {Request["query"]} [query]
     */
    at(path: string, query?: Request["query"]): URL;
    /**
     * Makes a call, again and again while it fails for a moment: every call of this client can be made twice.
     * @param {string} method
     * @param {string} path
     * @param {Request} [request]
     * @returns {Promise<Response>} A good answer.
     */
    call(method: string, path: string, request?: Request): Promise<Response>;
    /**
     * @param {string} method
     * @param {URL} url
     * @param {Request} request
     */
    attempt(method: string, url: URL, { body, type, signal }: Request): Promise<Response>;
}
