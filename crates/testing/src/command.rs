//! Runs the real programs, in folders that go away.
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use tempfile::TempDir;

/// A folder that goes away with the test.
pub fn folder() -> TempDir {
    tempfile::tempdir().expect("the system has a place for temporary folders")
}

/// The path of a program of this workspace, which cargo builds beside the test that asks for it.
pub fn program(name: &str) -> PathBuf {
    let test = std::env::current_exe().expect("a running program has a path");
    // A test is in `deps`, an example in `examples`; programs are in the folder above.
    let folder = test.parent().and_then(Path::parent);
    let folder = folder.expect("cargo puts tests into a folder of its own");
    folder.join(format!("{name}{}", std::env::consts::EXE_SUFFIX))
}

/// Runs a program of this workspace.
pub fn run(name: &str, args: &[&str]) -> Output {
    let output = Command::new(program(name)).args(args).output();
    output.unwrap_or_else(|error| panic!("{name}, which cargo builds: {error}"))
}

/// Standard output of a run that must succeed without a word on standard error.
pub fn success(output: Output) -> String {
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{errors}");
    assert_eq!(
        errors, "",
        "it complains, or draws a progress bar for nobody"
    );
    String::from_utf8(output.stdout).expect("the output is text")
}

/// The one line that `name`, which must fail, prints on standard error.
pub fn failure(name: &str, output: Output) -> String {
    assert_eq!(output.status.code(), Some(1), "{output:?}");
    let errors = String::from_utf8(output.stderr).expect("the message is text");
    assert!(errors.starts_with(&format!("{name}: ")), "{errors}");
    assert_eq!(errors.lines().count(), 1, "{errors}");
    errors
}

pub fn bagtrack(args: &[&str]) -> Output {
    run("bagtrack", args)
}

/// Standard output of `bagtrack`, which must succeed.
pub fn succeeds(args: &[&str]) -> String {
    success(bagtrack(args))
}

/// The one line that `bagtrack`, which must fail, prints on standard error.
pub fn fails(args: &[&str]) -> String {
    failure("bagtrack", bagtrack(args))
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
