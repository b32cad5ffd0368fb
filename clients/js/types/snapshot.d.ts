/** The tracker's own snapshot in one of the service; another one as it is.
 * @param {Uint8Array} snapshot
 * @returns {Promise<Uint8Array>} */
export declare function trackerOf(snapshot: Uint8Array): Promise<Uint8Array>;
