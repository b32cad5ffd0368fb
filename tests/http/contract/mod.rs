//! What the service says of itself: the OpenAPI document, problem documents, the page.

pub mod manners;
pub mod openapi;
pub mod openapi_examples;
pub mod page;
pub mod problem_page;
pub mod problems;
