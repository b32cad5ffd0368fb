//! `bagtrack serve`: its messages at the start, and that it answers as `bagtrack track` does.

use crate::command::{clip, folder, succeeds, text};
use crate::program::{self, Program};
use serde_json::Value;
use std::fs;

/// Starts the service, and reads its log up to the line with the address for this machine, which comes last.
fn start(flags: &[&str]) -> (Program, String) {
    let mut service = Program::start(flags, &[]);
    let line = service.logs("in a browser");
    let (_, rest) = line.split_once("open ").expect("it is said");
    let (url, _) = rest.split_once(" in a browser").expect("it is said");
    (service, url.to_owned())
}

fn page(url: &str) -> String {
    let answer = reqwest::blocking::get(url).expect("it answers");
    assert!(answer.status().is_success(), "{url}: {}", answer.status());
    answer.text().expect("text")
}

#[test]
fn the_start_says_what_to_open_in_a_browser_and_the_page_is_there() {
    for format in ["text", "json"] {
        let (service, url) = start(&["--log-format", format]);
        assert!(url.starts_with("http://127.0.0.1:"), "{url}");
        assert!(page(&url).contains("<html"), "{url}");
        let said = service.said();
        let others = said.iter().any(|line| line.contains("other machines"));
        assert!(!others, "only this machine reaches it: {said:?}");
    }
}

#[test]
fn the_address_has_the_base_path() {
    let (_service, url) = start(&["--base-path", "/tracker"]);
    assert!(url.ends_with("/tracker"), "{url}");
    assert!(page(&url).contains("<html"), "{url}");
}

/// The address in the log must be one that a browser can open, which http://0.0.0.0 is not.
#[test]
fn for_all_interfaces_it_says_the_address_of_this_machine_in_its_network() {
    let (service, here) = start(&["--listen", "0.0.0.0:0", "--no-auth"]);
    assert!(here.starts_with("http://127.0.0.1:"), "{here}");
    assert!(page(&here).contains("<html"), "{here}");
    let mut elsewhere = service.said().iter().filter_map(|line| {
        let (_, url) = line.split_once("on other machines, open ")?;
        Some(url)
    });
    let Some(url) = elsewhere.next() else {
        eprintln!("left out: this machine is in no network");
        return;
    };
    let is_here = ["0.0.0.0", "127.0.0.1"]
        .iter()
        .any(|name| url.contains(name));
    assert!(!is_here, "{url}");
    assert!(page(url).contains("<html"), "{url}");
    let mut said = service.said().iter();
    let hint = said.any(|line| line.contains("camera to https only"));
    assert!(hint, "{:?}", service.said());
}

#[test]
fn a_session_of_several_targets_gets_the_answers_that_track_gives() {
    let parent = folder();
    let dir = clip(parent.path(), "clip", &["--frames", "6"]);
    let boxes = ["44.1,101.4,46.1,57.6", "200,30,20,16"];
    let flags = ["--seed", "5", "--format", "json"];
    let targets = ["--box", boxes[0], "--box", boxes[1]];
    let lines = succeeds(&[&["track", text(&dir)], &flags[..], &targets].concat());
    let lines: Vec<Value> = lines
        .lines()
        .map(|line| serde_json::from_str(line).expect("JSON"))
        .collect();
    let (_service, url) = start(&[]);
    let client = reqwest::blocking::Client::new();
    let post = |path: &str, index: usize| {
        let frame = fs::read(dir.join(format!("img/{index:04}.jpg"))).expect("it is there");
        let answer = client.post(format!("{url}{path}")).body(frame).send();
        let answer = answer.expect("it answers");
        assert!(answer.status().is_success(), "{}", answer.status());
        answer
    };
    let opened = post(&format!("/sessions?seed=5&boxes={}", boxes.join(";")), 1);
    let session = opened.headers()["location"]
        .to_str()
        .expect("text")
        .to_owned();
    for index in 2..=6 {
        let answer = post(&format!("{session}/frames"), index);
        let answer: Value = serde_json::from_str(&answer.text().expect("text")).expect("JSON");
        for (target, found) in answer["targets"]
            .as_array()
            .expect("a list")
            .iter()
            .enumerate()
        {
            let line = &lines[2 * (index - 1) + target];
            assert_eq!(
                (&line["frame"], &line["target"]),
                (&answer["frame"], &target.into())
            );
            // The service rounds to hundredths of a pixel.
            for side in ["x", "y", "width", "height"] {
                let exact = line["box"][side].as_f64().expect("a number");
                let rounded = (100.0 * exact).round() / 100.0;
                assert_eq!(found["box"][side], rounded, "{side}: {line} {found}");
            }
            assert_eq!(line["status"], found["status"]);
        }
        assert_eq!(answer["targets"].as_array().map(Vec::len), Some(2));
    }
}

/// The message of the program, which must not start with these flags.
fn refusal(flags: &[&str]) -> String {
    refusal_with(flags, &[])
}

/// Like [`refusal`], with variables of the environment.
fn refusal_with(flags: &[&str], variables: &[(&str, &str)]) -> String {
    let mut command = program::serve(&bagtrack_testing::command::program("bagtrack"));
    let command = command.args(flags).envs(variables.iter().copied());
    match Program::spawn(command) {
        Ok(_) => panic!("{flags:?} {variables:?} is taken"),
        Err(error) => error.to_string(),
    }
}

/// If these values were accepted, nothing would be logged, or hosts would be refused.
#[test]
fn settings_that_cannot_work_are_refused_with_what_would() {
    for log in ["warning", "loud", "info,bagtrak"] {
        let said = refusal(&["--log", log]);
        assert!(said.contains("write error, warn, info"), "{said}");
    }
    for hosts in ["http://example.org", "*", "localhost, example.org"] {
        let said = refusal(&["--allowed-hosts", hosts]);
        assert!(said.contains("hosts like example.org"), "{said}");
    }
    // A lenient parser would take `ss` for the host of the second address.
    for store in ["redis://:pa#ss@localhost", "redis://user:pa@ss#w@localhost"] {
        let said = refusal(&["--store", store]);
        assert!(said.contains("`%23`") && !said.contains("ss@"), "{said}");
    }
}

/// Charts and compose files pass variables without a value.
#[test]
fn an_empty_variable_counts_as_not_set_but_for_those_of_access() {
    let empty = [
        ("BAGTRACK_WORKERS", ""),
        ("BAGTRACK_TLS_CERT", ""),
        ("BAGTRACK_STORE", ""),
        ("BAGTRACK_MODEL_IN_DOUBT", ""),
        ("BAGTRACK_LOG_FORMAT", ""),
    ];
    let mut service = Program::start(&[], &empty);
    service.logs("in a browser");
    let said = service.said().join("\n");
    assert!(!said.contains("is no setting"), "{said}");
    for name in ["api-keys", "api-keys-file", "metrics-key"] {
        let variable = format!("BAGTRACK_{}", name.replace('-', "_").to_uppercase());
        let said = refusal_with(&[], &[(&variable, "")]);
        assert!(said.contains(&format!("--{name}")), "{said}");
    }
}

/// The folder of the store may exist already, readable for everybody.
#[cfg(unix)]
#[test]
fn files_of_a_store_are_for_the_user_of_the_process_alone() {
    use std::fs::Permissions;
    use std::os::unix::fs::PermissionsExt;
    let parent = folder();
    let store = parent.path().join("sessions");
    fs::create_dir(&store).expect("it is new");
    fs::set_permissions(&store, Permissions::from_mode(0o755)).expect("it is ours");
    let (_service, _) = start(&["--store", &format!("file:{}", text(&store))]);
    let mut folders = vec![store];
    let mut files = 0;
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).expect("a folder") {
            let path = entry.expect("an entry").path();
            let about = fs::metadata(&path).expect("it is there");
            let mode = about.permissions().mode() & 0o777;
            assert_eq!(mode & 0o077, 0, "{mode:o} {}", path.display());
            match about.is_dir() {
                true => folders.push(path),
                false => files += 1,
            }
        }
    }
    assert!(files > 3, "{files}");
}
