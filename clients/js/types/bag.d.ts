/**
 * @param {{columns: number, vectors: Float32Array[]}[]} bag
 * @returns {Promise<Blob>}
 */
export declare function pictureOf(bag: {
    columns: number;
    vectors: Float32Array[];
}[]): Promise<Blob>;
