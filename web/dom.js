// Elements of the page by their ids.

/**
 * @template {HTMLElement} T
 * @param {string} id
 * @returns {T}
 */
export const get = (id) => /** @type {T} */ (document.getElementById(id));

/** @param {string} id */
export const button = (id) => /** @type {HTMLButtonElement} */ (get(id));
/** @param {string} id */
export const canvas = (id) => /** @type {HTMLCanvasElement} */ (get(id));
/** @param {string} id */
export const input = (id) => /** @type {HTMLInputElement} */ (get(id));
