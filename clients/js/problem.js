// The error that calls of this client throw.

/** Statuses with which the same request may succeed later: of the service, and of proxies before it. */
const LATER = new Set([408, 429, 502, 503, 504]);

/** A problem document of the service (RFC 9457), or a failure to reach it. */
export class Problem extends Error {
  /**
   * @param {{type?: string, status?: number, title?: string, detail?: string, expected_frame?: number}} document
   * @param {number} [retryAfter] Seconds after which trying again makes sense.
   */
  constructor(document, retryAfter) {
    super(document.detail ?? document.title ?? "The service cannot be reached.");
    this.name = "Problem";
    /** The kind: the last part of the type, such as `session-not-found`; `unreachable` where there was no answer. */
    this.slug = (document.type ?? (document.status ? "" : "unreachable")).split(/[#:]/).pop() ?? "";
    /** The status of the answer; 0 where there was none. */
    this.status = document.status ?? 0;
    /** With a wrong frame number: the number of the next frame. */
    this.expectedFrame = document.expected_frame;
    this.retryAfter = retryAfter;
  }

  /** Whether the service does not have the session any more. */
  get isGone() {
    return this.status === 404 || this.status === 410;
  }

  /** Whether the same request may succeed later. */
  get isTemporary() {
    return this.status === 0 || LATER.has(this.status) || this.slug === "not-in-order";
  }
}
