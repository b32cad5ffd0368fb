// What the browser keeps of the page, so that nothing is lost when it is loaded anew: the project, the states of the
// trackers, and the video file where it is small.

/**
 * @typedef {import("./project.js").Project} Project
 *
 * @typedef {object} Kept
 * @property {string} tab Of which tab it is.
 * @property {boolean} isLocal Whether it was tracked in the page.
 * @property {Project} project
 * @property {Record<number, {bytes: Uint8Array<ArrayBuffer>, frames: number[]}>} states The last one of each object.
 * @property {string} [clip] The sample clip.
 */

const NAME = "bagtrack";
const STORE = "kept";
/** A larger file is not copied. */
export const MOST_BYTES = 512 << 20;

/**
 * @template T
 * @param {IDBRequest<T>} request
 * @returns {Promise<T>}
 */
const done = (request) =>
  new Promise((resolve, reject) => {
    request.onsuccess = () => resolve(request.result);
    request.onerror = () => reject(request.error);
  });

/** @type {Promise<IDBDatabase> | undefined} */
let database;

/**
 * @template T
 * @param {IDBTransactionMode} mode
 * @param {(store: IDBObjectStore) => IDBRequest<T>} run
 * @returns {Promise<T>}
 */
async function within(mode, run) {
  database ??= (() => {
    const request = indexedDB.open(NAME, 1);
    request.onupgradeneeded = () => request.result.createObjectStore(STORE);
    return done(request);
  })();
  return done(run((await database).transaction(STORE, mode).objectStore(STORE)));
}

/** The tab that this is, also after it was loaded anew. */
export function tab() {
  const known = sessionStorage.getItem("tab");
  const own = known ?? crypto.getRandomValues(new Uint32Array(2)).join("");
  if (!known) sessionStorage.setItem("tab", own);
  return own;
}

/** @param {Kept} kept */
export const keepWork = (kept) => within("readwrite", (store) => store.put(kept, "work"));

/** @returns {Promise<Kept | undefined>} */
export const keptWork = () => within("readonly", (store) => store.get("work"));

/** @param {File[]} files */
export const keepFiles = (files) => within("readwrite", (store) => store.put(files, "files"));

/** @returns {Promise<File[] | undefined>} */
export const keptFiles = () => within("readonly", (store) => store.get("files"));

export const forget = () => within("readwrite", (store) => store.clear());
