//! The problems of requests that take more than one may.

use super::kind::Kind;
use super::problem::Problem;

impl Problem {
    /// The address has as many connections as it may, and all of them are busy.
    pub fn too_many_connections() -> Self {
        let detail = "This address has as many connections as one may, all of them busy. Use them again, or try again \
            after the time in `Retry-After`.";
        Self::new(Kind::QuotaExceeded, detail)
    }

    /// The body did not arrive in time.
    pub fn body_timeout() -> Self {
        let detail = "Send the whole body faster, or a smaller frame. The session is unchanged.";
        Self::new(Kind::BodyTimeout, detail)
    }

    /// The body has more bytes than it may.
    pub fn body_too_large(limit: usize) -> Self {
        let detail =
            format!("A body may have at most {limit} bytes; send smaller or fewer frames.");
        Self::new(Kind::BodyTooLarge, detail)
    }

    /// The frames of the request have more pixels than those of one request may.
    pub fn too_many_pixels(pixels: u64, limit: u64) -> Self {
        let detail = format!(
            "The frames of this request have {pixels} pixels together; at most {limit} are taken. Send fewer frames \
             in a request. None of them was tracked."
        );
        Self::new(Kind::RequestTooCostly, detail)
    }

    /// The client has as many of something as one client may have.
    pub fn quota_exceeded(what: &str, limit: usize) -> Self {
        let detail = format!(
            "One client may have {limit} {what} here. Try again after the time in `Retry-After`. Nothing was changed."
        );
        Self::new(Kind::QuotaExceeded, detail)
    }

    /// The request has more frames than it may.
    pub fn too_many_frames(limit: usize) -> Self {
        let detail = format!(
            "A request may have at most {limit} frames here; send the rest in another one."
        );
        Self::new(Kind::TooManyFrames, detail)
    }
}
