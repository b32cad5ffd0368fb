/** A module of Node.js, for which no bundler shall look.
 * @param {string} name
 * @returns {Promise<any>} */
export declare function ofNode(name: string): Promise<any>;
