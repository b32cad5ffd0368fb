//! Errors as problem documents (RFC 9457).
//!
//! A handler returns a [`Problem`](problem::Problem): its [kind](bagtrack_api::ProblemKind) (status, type and title,
//! which never change), a detail that tells the client what to do, and the cause, which only the log gets. The errors
//! of the other modules [turn into problems](from_errors) by `?`. The middleware
//! [`answer_problems`](crate::http::middleware::answer_problems) writes the [document](bagtrack_api::ProblemDocument),
//! since it knows the path and the id of the request.
//!
//! The kinds make one catalogue. [The page](page) that the types of problems lead to is made from it, too.
//!
//! What can go wrong: a cause in an answer tells the client too much. So the document has no field for causes.

mod from_errors;
pub mod page;
pub mod problem;
