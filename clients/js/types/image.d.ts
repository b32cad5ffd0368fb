export type Pixels = {
    width: number;
    height: number;
    data: Uint8Array | Uint8ClampedArray;
};
export type Planes = {
    width: number;
    height: number;
    luma: Uint8Array;
    cb?: Uint8Array;
    cr?: Uint8Array;
};
export type Drawable = ImageBitmap | VideoFrame | HTMLCanvasElement | OffscreenCanvas | HTMLVideoElement | HTMLImageElement;
export type Image = Pixels | Planes | Drawable | Blob;
/** The pixels of an image.
 * @param {Image} image
 * @returns {Promise<Pixels | Planes>} */
export declare function pixelsOf(image: Image): Promise<Pixels | Planes>;
