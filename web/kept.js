// What the browser keeps of the page, so that nothing is lost: of each run the project, the states of the trackers, and
// the files where they are small. A run has an entry of its own, which one tab at a time has open.

const NAME = "bagtrack";
/** What the tab has open, also after it was loaded anew. */
const OWN = "work";
const STORE = "kept";
/** Larger files are not copied. */
export const MOST_BYTES = 512 << 20;
/** Entries that no tab has open. */
const MOST = 5;
/** Milliseconds after which they are forgotten. */
const OLDEST = 30 * 24 * 3600 * 1000;
/** Milliseconds in which a page that is loaded anew lets go of its entry. */
const PATIENCE = 1000;

/** @type {Promise<IDBDatabase> | undefined} */
let database;

/** What runs are kept in. The browser may remove it: then it is another one. */
export function opened() {
  database ??= new Promise((resolve, reject) => {
    const request = indexedDB.open(NAME, 1);
    request.onupgradeneeded = () => request.result.createObjectStore(STORE);
    request.onsuccess = () => {
      request.result.onclose = () => (database = undefined);
      resolve(request.result);
    };
    request.onerror = () => {
      database = undefined;
      reject(request.error);
    };
  });
  return database;
}

/**
 * @template T
 * @param {IDBTransactionMode} mode
 * @param {(store: IDBObjectStore) => IDBRequest<T>} run The last one of its requests is answered.
 */
async function within(mode, run) {
  const transaction = (await opened()).transaction(STORE, mode);
  const request = run(transaction.objectStore(STORE));
  // Without this, a page that is left at once takes back what it wrote.
  transaction.commit();
  return new Promise((resolve, reject) => {
    transaction.oncomplete = () => resolve(request.result);
    // Want of room is told here.
    transaction.onabort = () => reject(transaction.error ?? request.error);
  });
}

/** @param {IDBValidKey} key */
const read = (key) => within("readonly", (store) => store.get(key));

/** Keeps a run. Where there is no room, it is kept without its files, or the oldest entry that no tab has open makes
 * room.
 * @param {Kept} kept
 * @param {File[]} [files] Instead of those that it has.
 * @returns {Promise<boolean>} Whether there was room for the files. */
export async function keepWork(kept, files) {
  try {
    await within("readwrite", (store) => {
      if (files) store.put(files, ["files", kept.id]);
      return store.put(kept, ["work", kept.id]);
    });
    return true;
  } catch (error) {
    if (Object(error).name !== "QuotaExceededError") throw error;
    if (files?.length) return keepWork(kept, []).then(() => false);
    const oldest = (await freeWorks()).pop();
    if (!oldest) throw error;
    await forget(oldest.id);
    return keepWork(kept, files);
  }
}

/** @param {string} id
 * @returns {Promise<Kept | undefined>} */
export const keptWork = (id) => read(["work", id]);

/** @param {string} id
 * @returns {Promise<File[] | undefined>} */
export const keptFiles = (id) => read(["files", id]);

/** @param {string} id */
export const forget = (id) =>
  within("readwrite", (store) => {
    store.delete(["files", id]);
    return store.delete(["work", id]);
  });

/** The entries that no tab has open, newest first. Those that are too many or too old are forgotten. */
export async function freeWorks() {
  await moveOld();
  /** @type {Kept[]} */
  const works = await within("readonly", (store) => store.getAll(IDBKeyRange.bound(["work"], ["work", []])));
  const { held = [] } = (await navigator.locks?.query()) ?? {};
  const taken = new Set([...held.map(({ name }) => name), ...[...mine.keys()].map(lockOf)]);
  const free = works.filter(({ id }) => !taken.has(lockOf(id))).sort((one, other) => other.at - one.at);
  const isLeft = (/** @type {Kept} */ { at }, /** @type {number} */ index) => index < MOST && Date.now() - at < OLDEST;
  await Promise.all(free.filter((work, index) => !isLeft(work, index)).map(({ id }) => forget(id)));
  return free.filter(isLeft);
}

/** The entry that this tab has open; empty where there is none, or where the browser keeps nothing for pages. */
export function ownWork() {
  try {
    return sessionStorage.getItem(OWN) ?? "";
  } catch {
    return "";
  }
}

/** @param {string} id Empty where there is none any more. */
export function setOwnWork(id) {
  try {
    if (id) sessionStorage.setItem(OWN, id);
    else sessionStorage.removeItem(OWN);
  } catch {
    // It is not found again after the page is loaded anew.
  }
}

/** Earlier versions of the page had one entry for all tabs. */
async function moveOld() {
  const [work, files] = await Promise.all([read("work"), read("files")]);
  if (!work) return;
  await keepWork({ ...work, id: work.tab, at: Date.now() }, files ?? []);
  await within("readwrite", (store) => {
    store.delete("files");
    return store.delete("work");
  });
}

/** @type {Map<string, () => void>} The entries that this page has open, and what gives them up. */
const mine = new Map();

/** @param {string} id */
const lockOf = (id) => `bagtrack work ${id}`;

/** Has an entry open, until it is given up or the page is left.
 * @param {string} id
 * @returns {Promise<boolean>} Not where another tab has it. Over plain http browsers do not tell. */
export async function claim(id) {
  if (mine.has(id)) return true;
  mine.set(id, () => undefined);
  if (!navigator.locks || (await locked(id, { ifAvailable: true }))) return true;
  const isHeld = mine.has(id) && (await locked(id, { signal: AbortSignal.timeout(PATIENCE) }));
  if (!isHeld) mine.delete(id);
  return isHeld;
}

/** @param {string} id
 * @param {LockOptions} options
 * @returns {Promise<boolean>} Whether this page has the lock. */
const locked = (id, options) =>
  new Promise((resolve) => {
    const granted = (/** @type {Lock | null} */ lock) => {
      // It may have been given up meanwhile.
      const isHeld = lock !== null && mine.has(id);
      resolve(isHeld);
      return isHeld ? new Promise((release) => mine.set(id, () => release(undefined))) : undefined;
    };
    navigator.locks.request(lockOf(id), options, granted).catch(() => resolve(false));
  });

/** @param {string} id */
export function giveUp(id) {
  mine.get(id)?.();
  mine.delete(id);
}
