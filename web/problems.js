// The messages for users when something fails.

import { Problem } from "./js/problem.js";

/** One message for a chosen file that is gone: browsers report it by different errors. */
const UNREADABLE = "The file cannot be read: it was moved, changed or removed.";
/** Whether an error means that a chosen file cannot be read any more.
 * @param {unknown} error */
export const isUnreadable = (error) => error instanceof Error && WORDS[error.name] === UNREADABLE;
export const GONE = new DOMException("", "NotReadableError");

/** Whether a chosen file can still be read. In some browsers a removed file has size 0, and reading an empty slice of
 * it succeeds: so then the file itself is read.
 * @param {Blob} file */
export const isReadable = (file) => (file.size > 0 ? file.slice(0, 1) : file).arrayBuffer().then(() => true, () => false);

const PART = "A part of the page cannot be loaded. Is the service still running? Then load the page anew.";

/** @type {Record<string, string>} */
const WORDS = {
  unreachable: "The service cannot be reached. Is it still running?",
  unauthorized: "The service does not know this key.",
  "session-expired": "The session has expired: no frame came for too long.",
  "session-not-found": "The session is lost.",
  "queue-full": "The service is busy. Try again in a moment.",
  "too-many-sessions": "The service is busy: it follows as many targets as it can. Try again in a moment.",
  "quota-exceeded": "You have as many sessions or frames under way as one client may. Try again in a moment.",
  "work-timeout": "The service is busy: a frame took too long. Try again in a moment.",
  "invalid-box": "This box cannot be followed. Draw a larger one inside the picture.",
  "not-ready": "The service is about to end. Try again in a moment.",
  CameraNotAllowedError: "The camera was refused. Allow it in the browser's address bar, or choose a video file.",
  CameraNotFoundError: "There is no camera. Choose a video file.",
  CameraNotReadableError: "The camera has stopped, or another program has it.",
  NotReadableError: UNREADABLE,
  NotFoundError: UNREADABLE,
  SecurityError:
    "Browsers give the camera to pages over https and from localhost only, and this page came over plain http. Open it " +
    "over https, or choose a video file.",
  NotSupportedError:
    "This browser cannot play the file. MP4 (H.264) and WebM play in all; `bagtrack track` reads many more formats.",
  EncodingError: "The rest of the file cannot be played. The results up to here can be saved.",
};

/** The browser cannot play a file, but the service may be able to decode it. */
export class UnplayableError extends Error {
  /** @param {File} file */
  constructor(file) {
    super(`This browser cannot play ${file.name}. The service may decode it: it gets the whole file then.`);
    this.file = file;
  }
}

/**
 * @param {unknown} error
 * @param {boolean} hasKey Whether a key was given.
 * @returns {string}
 */
export function words(error, hasKey) {
  if (error instanceof Problem && error.slug === "unauthorized" && !hasKey) return "This service asks for an API key.";
  if (error instanceof Problem) return WORDS[error.slug] ?? error.message;
  // Browsers word a failed import differently, and some do not request the module again.
  if (error instanceof TypeError && /import/i.test(error.message)) return PART;
  if (error instanceof Error) return WORDS[error.name] ?? error.message;
  return String(error);
}
