// What is said to people when something fails.

import { Problem } from "./js/bagtrack.js";

/** @type {Record<string, string>} */
const WORDS = {
  unreachable: "The service cannot be reached. Is it still running?",
  unauthorized: "The service does not know this key.",
  "session-expired": "The session has expired: no frame came for too long. Choose the video again.",
  "session-not-found": "The session has ended. Choose the video again.",
  "queue-full": "The service is busy. Try again in a moment.",
  "too-many-sessions": "The service is busy: it follows as many targets as it can. Try again in a moment.",
  "quota-exceeded": "You have as many sessions or frames under way as one client may. Try again in a moment.",
  "work-timeout": "The service is busy: a frame took too long. Try again in a moment.",
  "invalid-box": "This box cannot be followed. Draw a larger one inside the picture.",
  "not-ready": "The service is about to end. Try again in a moment.",
  NotAllowedError: "The camera was refused. Allow it in the browser's address bar, or choose a video file.",
  NotFoundError: "There is no camera. Choose a video file.",
  NotReadableError: "Another program has the camera.",
  NotSupportedError: "This browser cannot play the file.",
};

/**
 * @param {unknown} error
 * @returns {string}
 */
export function words(error) {
  if (error instanceof Problem) return WORDS[error.slug] ?? error.message;
  if (error instanceof Error) return WORDS[error.name] ?? error.message;
  return String(error);
}
