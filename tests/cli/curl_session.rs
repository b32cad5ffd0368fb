//! The curl session of docs/QUICKSTART.md, run as it is typed.

use crate::program::Program;
use std::path::Path;
use std::process::Command;

/// The first shell block after the heading.
fn block(text: &str, heading: &str) -> String {
    let (_, section) = text
        .split_once(heading)
        .expect("the document has the section");
    let (_, block) = section
        .split_once("```sh\n")
        .expect("the section has a shell block");
    block
        .split_once("```")
        .expect("the block ends")
        .0
        .to_owned()
}

#[test]
#[ignore = "needs curl, uuidgen and bash: apt-get install curl uuid-runtime"]
fn the_whole_curl_session_works_as_typed() {
    let document = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/QUICKSTART.md");
    let document = std::fs::read_to_string(document).expect("the project has a quickstart");
    let session = block(&document, "## A whole session");
    let service = Program::start(&[], &[]);
    let folder = tempfile::tempdir().expect("the system has a place for temporary folders");
    // Changes to the documented commands: the path of the binary, the port, and that an error ends the script.
    let script = session
        .replace(
            "bagtrack sample",
            &format!("{} sample", env!("CARGO_BIN_EXE_bagtrack")),
        )
        .replace("http://127.0.0.1:8080", &service.url(""))
        .replace(
            "curl ",
            "curl --silent --show-error --fail-with-body --write-out '\\n' ",
        );
    assert!(
        script.contains(&service.url("")) && script.contains(env!("CARGO_BIN_EXE_bagtrack")),
        "{script}"
    );
    let output = Command::new("bash")
        .args(["-euo", "pipefail", "-c", &script])
        .current_dir(folder.path())
        .output()
        .expect("bash runs");
    let (answers, errors) = (
        String::from_utf8_lossy(&output.stdout),
        String::from_utf8_lossy(&output.stderr),
    );
    assert!(output.status.success(), "{answers}\n{errors}");
    let documents: Vec<serde_json::Value> = answers
        .lines()
        .filter_map(|line| serde_json::from_str(line).ok())
        .collect();
    assert!(
        !script.contains("sed ") && !script.contains("tr "),
        "plain commands alone"
    );
    // The opening, one frame, two frames, one frame twice, a correction, the session's state, the restored session.
    assert_eq!(documents.len(), 8, "{answers}");
    assert_eq!(documents[0]["box"]["x"], 44.1);
    let documents = &documents[1..];
    assert_eq!(documents[0]["frame"], 1);
    assert_eq!(documents[1]["answers"][1]["frame"], 3);
    assert_eq!(
        documents[2], documents[3],
        "the same frame gets the same answer"
    );
    assert_eq!(documents[2]["frame"], 4);
    assert_eq!(documents[4]["box"]["x"], 41.0);
    assert_eq!(documents[5]["frames"], 6);
    assert_eq!(
        documents[6]["frame"], 5,
        "the snapshot goes on where the session stood"
    );
    assert_eq!(documents[6]["box"]["x"], 41.0);
}
