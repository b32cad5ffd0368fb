/** The tracker's own snapshot in one of the service; another one as it is.
 * @param {Uint8Array<ArrayBuffer>} snapshot
 * @returns {Promise<Uint8Array<ArrayBuffer>>} */
export declare function trackerOf(snapshot: Uint8Array<ArrayBuffer>): Promise<Uint8Array<ArrayBuffer>>;
