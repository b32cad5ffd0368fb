//! Writes a network for the tracker's second opinion that needs no training: it follows a mean colour.
//!
//!     cargo run --example tiny_network -- FOLDER
//!     cargo run --release -- serve --model nanotrack:FOLDER/backbone.onnx,FOLDER/head.onnx
//!
//! With it the road of `--model` can be tried without the weights of NanoTrack. It does not make tracking better.

use std::path::PathBuf;
use std::{env, fs, io};

use bagtrack_testing::tiny_network;

fn main() -> io::Result<()> {
    let Some(folder) = env::args_os().nth(1).map(PathBuf::from) else {
        return Err(io::Error::other("usage: tiny_network FOLDER"));
    };
    fs::create_dir_all(&folder)?;
    tiny_network::write(&folder).map(drop)
}
