export type Image = import("./image.js").Image;
/** The same frame, as it can be sent to a worker, and what is handed over to it.
 * @param {Image} image
 * @returns {Promise<{sent: Image, handed: Transferable[]}>} */
export declare function sendable(image: Image): Promise<{
    sent: Image;
    handed: Transferable[];
}>;
/** Gives up what was handed over.
 * @param {Image} image */
export declare function close(image: Image): void;
