//! The parameters of a tracker: one table of fields and ranges, two presets, and the limits on products of sizes.
//!
//! - `table`: [`Params`](table::Params), with each parameter's meaning, type and range said once.
//! - `presets`: the paper's printed settings and the default.
//! - `limits`: what several sizes may cost together.
//!
//! The input is numbers alone. A parameter out of its range, or sizes that cost too much together, give a
//! [`ParamsError`](table::ParamsError) that names the parameter, its value and what is allowed.

pub(crate) mod limits;
pub(crate) mod presets;
pub(crate) mod table;
