//! What the tests, benchmarks, examples and the load generator share.
//!
//! | module | holds |
//! |---|---|
//! | [`scene`] | drawn frames for the tracker's tests |
//! | [`bench_scene`] | drawn frames for the benchmarks and the load generator |
//! | [`bench_pictures`] | the same as JPEG |
//! | [`textbook`] | sections III-B and III-D of the paper as printed: the oracle of the tracker's evaluation |
//! | [`picture_files`] | JPEG, PNG and WebP files of many forms |
//! | [`pictures`] | drawn frames for the tests of the service, as files |
//! | [`processes`] | other programs that the tests start, such as a Redis |
//! | [`cpu_time`] | times of actions in turns, in processor time of the thread |
//! | [`memory`] | memory of processes |
//! | [`issuer`] | an issuer of JSON Web Tokens |
//! | [`tiny_network`] | a network for the tracker's second opinion, as ONNX files |
//! | [`command`] | the programs of the workspace, run in folders that go away |
//! | [`service`] | services under test: in the process, as processes, behind a line that breaks |
//! | [`within`] | waiting for what does happen, unless what is tested is broken |

pub mod bench_pictures;
pub mod bench_scene;
pub mod command;
pub mod cpu_time;
#[cfg(feature = "issuer")]
pub mod issuer;
pub mod memory;
pub mod picture_files;
pub mod pictures;
pub mod processes;
pub mod scene;
#[cfg(feature = "service")]
pub mod service;
pub mod textbook;
pub mod tiny_network;
#[cfg(feature = "service")]
pub mod within;
