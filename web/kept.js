// The browser's database of runs. An entry has the project, the states of the trackers, and the files if they are
// small. One tab at a time has an entry open.

const NAME = "bagtrack";
/** The `sessionStorage` key of this tab's entry, which survives a reload. */
const OWN = "work";
const STORE = "kept";
/** Most bytes of a run's files that are copied into the database. */
export const MOST_BYTES = 512 << 20;
/** Most entries that no tab has open. */
const MOST = 5;
/** Milliseconds after which such entries are removed. */
const OLDEST = 30 * 24 * 3600 * 1000;
/** Milliseconds to wait for the lock of an entry: after a reload, the old page may still hold it. */
const PATIENCE = 1000;

/** @type {Promise<IDBDatabase> | undefined} */
let database;

/** The database. After the browser has closed it, the next call opens it again. */
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
 * @param {(store: IDBObjectStore) => IDBRequest<T>} run Makes the requests, and returns the one whose result is wanted.
 */
async function within(mode, run) {
  const transaction = (await opened()).transaction(STORE, mode);
  const request = run(transaction.objectStore(STORE));
  // Without `commit`, the browser rolls the transaction back if the page is left right away.
  transaction.commit();
  return new Promise((resolve, reject) => {
    transaction.oncomplete = () => resolve(request.result);
    // A full disk or quota aborts the transaction.
    transaction.onabort = () => reject(transaction.error ?? request.error);
  });
}

/** @param {IDBValidKey} key */
const read = (key) => within("readonly", (store) => store.get(key));

/** Keeps a run. Where there is no room, keeps it without its files; if that fails too, removes the oldest entry that no
 * tab has open, and tries again.
 * @param {Kept} kept
 * @param {File[]} [files] Replace those in the entry.
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

/** The entries that no tab has open, newest first. Removes those over `MOST` or older than `OLDEST`. */
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

/** The id of this tab's entry; empty where there is none, or where the browser denies storage to pages. */
export function ownWork() {
  try {
    return sessionStorage.getItem(OWN) ?? "";
  } catch {
    return "";
  }
}

/** @param {string} id Empty to unset. */
export function setOwnWork(id) {
  try {
    if (id) sessionStorage.setItem(OWN, id);
    else sessionStorage.removeItem(OWN);
  } catch {
    // Without storage, a reload does not find the entry again.
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

/** @type {Map<string, () => void>} The ids of the entries that this page has open, each with what releases its lock. */
const mine = new Map();

/** @param {string} id */
const lockOf = (id) => `bagtrack work ${id}`;

/** Opens an entry for this page alone, until `giveUp` or until the page is left.
 * @param {string} id
 * @returns {Promise<boolean>} False where another tab has it. Over plain http there are no locks: always true. */
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
      // `giveUp` may have been called before the lock was granted.
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
