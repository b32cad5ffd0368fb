/** Refuses what is no image for a tracker here.
 * @param {unknown} image */
export declare function checkImage(image: unknown): void;
