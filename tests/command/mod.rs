//! Runs the real binary, in folders that go away.
#![allow(dead_code, reason = "each test binary uses another part")]

use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use tempfile::TempDir;

/// A folder that goes away with the test.
pub fn folder() -> TempDir {
    tempfile::tempdir().expect("the system has a place for temporary folders")
}

pub fn bagtrack(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_bagtrack"))
        .args(args)
        .output()
        .expect("cargo has built the binary")
}

/// Standard output of a command that must succeed.
pub fn succeeds(args: &[&str]) -> String {
    let output = bagtrack(args);
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{args:?}: {errors}");
    assert_eq!(
        errors, "",
        "{args:?} complains, or draws a progress bar for nobody"
    );
    String::from_utf8(output.stdout).expect("the output is text")
}

/// The one line that a command which must fail prints on standard error.
pub fn fails(args: &[&str]) -> String {
    let output = bagtrack(args);
    assert_eq!(output.status.code(), Some(1), "{args:?}");
    let errors = String::from_utf8(output.stderr).expect("the message is text");
    assert!(errors.starts_with("bagtrack: "), "{errors}");
    assert_eq!(errors.lines().count(), 1, "{errors}");
    errors
}

/// A small sample clip under `parent`: 12 frames unless `extra` says otherwise.
pub fn clip(parent: &Path, name: &str, extra: &[&str]) -> PathBuf {
    let dir = parent.join(name);
    let out = text(&dir).to_owned();
    let mut args = vec!["sample", "--out", &out];
    args.extend(extra);
    if !extra.contains(&"--frames") {
        args.extend(["--frames", "12"]);
    }
    succeeds(&args);
    dir
}

pub fn text(path: &Path) -> &str {
    path.to_str().expect("temporary folders have plain names")
}
