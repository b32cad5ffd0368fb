/** Pauses that grow, until the time is up. */
export declare class Backoff {
    late: number;
    own: number;
    /** @param {number} patience Milliseconds. */
    constructor(patience: number);
    /**
     * The next pause, at least as long as the service asks for; nothing where the time would be up then.
     * @param {number} [asked] Milliseconds.
     */
    next(asked?: number): number | undefined;
}
