//! The process that decodes videos: its sandbox, and how the service finds the program.

use crate::application::BOX;
use crate::helpers::video_files::{FRAMES, video};
use crate::program::{Program, serve};
use crate::requests::lines::lines;
use reqwest::Client;
use std::process::Command;

#[cfg(target_os = "linux")]
#[test]
fn the_decoder_of_the_program_may_read_no_other_file_and_open_no_socket() {
    let program = env!("CARGO_BIN_EXE_bagtrack");
    let service = Program::start(&[], &[]);
    let mut said = service.said().iter();
    if said.any(|line| line.contains("Landlock or seccomp is not to be had")) {
        return eprintln!("left out: this kernel has no Landlock or no seccomp");
    }
    let run = |command: &[&str]| {
        let mut confined = Command::new(program);
        let output = confined.arg("confined").args(command).output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        (output.status.code(), said)
    };
    assert_eq!(run(&["true"]).0, Some(0));
    let (code, said) = run(&["cat", concat!(env!("CARGO_MANIFEST_DIR"), "/Cargo.toml")]);
    assert!(
        code == Some(1) && said.contains("Permission denied"),
        "{said}"
    );
    // It cannot read or write files that everybody may access, either.
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("file");
    std::fs::write(&file, "text").unwrap();
    let (code, said) = run(&["cat", file.to_str().unwrap()]);
    assert!(
        code == Some(1) && said.contains("Permission denied"),
        "{said}"
    );
    let (code, said) = run(&["touch", folder.path().join("other").to_str().unwrap()]);
    assert!(
        code == Some(1) && said.contains("Permission denied"),
        "{said}"
    );
    let (_, said) = run(&["bash", "-c", "exec 3<>/dev/tcp/127.0.0.1/9"]);
    assert!(said.contains("Operation not permitted"), "{said}");
    assert_eq!(run(&["/nowhere/ffmpeg"]).0, Some(127));
}

/// After an upgrade, another file has the name of the running program. The decoder must be the running program.
#[tokio::test]
#[ignore = "needs ffmpeg"]
async fn a_program_whose_file_was_removed_decodes_videos() {
    let folder = tempfile::tempdir().unwrap();
    let own = folder.path().join("bagtrack");
    // `cp` writes the file: if this process did, a child that another test starts meanwhile would inherit it, open for
    // writing, and the program could not start.
    let program = bagtrack_testing::command::program("bagtrack");
    let copied = Command::new("cp").arg(program).arg(&own).status();
    assert!(copied.unwrap().success());
    let (service, client) = (Program::spawn(&mut serve(&own)).unwrap(), Client::new());
    std::fs::remove_file(&own).unwrap();
    let url = service.url(&format!("/track?box={BOX}"));
    let answer = client.post(url).body(video("mp4")).send().await.unwrap();
    assert_eq!(answer.status(), 200);
    assert_eq!(lines(answer).await.len(), FRAMES as usize);
}
