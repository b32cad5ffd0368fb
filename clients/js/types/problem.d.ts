/** A problem document of the service (RFC 9457), or a failure to reach it. */
export declare class Problem extends Error {
    /** The kind: the last part of the type, such as `session-not-found`; `unreachable` where there was no answer. */
    slug: string;
    /** The status of the answer; 0 where there was none. */
    status: number;
    /** With a wrong frame number: the number of the next frame. */
    expectedFrame: number | undefined;
    retryAfter: number | undefined;
    /**
     * @param {{type?: string, status?: number, title?: string, detail?: string, expected_frame?: number}} document
     * @param {number} [retryAfter] Seconds after which trying again makes sense.
     */
    constructor(document: {
        type?: string;
        status?: number;
        title?: string;
        detail?: string;
        expected_frame?: number;
    }, retryAfter?: number);
    /** Whether the service does not have the session any more. */
    get isGone(): boolean;
    /** Whether the same request may succeed later. */
    get isTemporary(): boolean;
}
