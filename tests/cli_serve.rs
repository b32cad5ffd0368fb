//! What `bagtrack serve` says at its start: the addresses to open.

use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};

/// A running service, which ends with the test.
struct Service {
    process: Child,
    /// The messages of the start.
    messages: Vec<String>,
}

impl Drop for Service {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

impl Service {
    /// Starts it, and reads its log up to the address for this machine, which is said last.
    fn start(flags: &[&str]) -> Self {
        let mut command = Command::new(env!("CARGO_BIN_EXE_bagtrack"));
        command.arg("serve").args(flags).env("NO_COLOR", "1");
        let mut process = command
            .stderr(Stdio::piped())
            .spawn()
            .expect("cargo has built it");
        let mut log = BufReader::new(process.stderr.take().expect("it is a pipe")).lines();
        let mut messages = Vec::new();
        loop {
            let line = log.next().expect("it starts").expect("text");
            let is_last = line.contains("in a browser");
            messages.push(line);
            if is_last {
                break;
            }
        }
        // What is not read is dropped.
        std::thread::spawn(move || log.for_each(drop));
        Self { process, messages }
    }

    /// The address in the message with these words before and after it.
    fn address(&self, before: &str, after: &str) -> Option<String> {
        self.messages.iter().find_map(|line| {
            let (_, rest) = line.split_once(before)?;
            let (address, _) = rest.split_once(after)?;
            Some(address.to_owned())
        })
    }
}

fn page(url: &str) -> String {
    let answer = reqwest::blocking::get(url).expect("it answers");
    assert!(answer.status().is_success(), "{url}: {}", answer.status());
    answer.text().expect("text")
}

#[test]
fn the_start_says_what_to_open_in_a_browser_and_the_page_is_there() {
    for format in ["text", "json"] {
        let flags = ["--listen", "127.0.0.1:0", "--log-format", format];
        let service = Service::start(&flags);
        let url = service.address("open ", " in a browser");
        let url = url.unwrap_or_else(|| panic!("{:?}", service.messages));
        assert!(url.starts_with("http://127.0.0.1:"), "{url}");
        assert!(page(&url).contains("<html"), "{url}");
        let others = service
            .messages
            .iter()
            .any(|line| line.contains("other machines"));
        assert!(
            !others,
            "only this machine reaches it: {:?}",
            service.messages
        );
    }
}

#[test]
fn the_address_has_the_base_path() {
    let flags = ["--listen", "127.0.0.1:0", "--base-path", "/tracker"];
    let service = Service::start(&flags);
    let url = service
        .address("open ", " in a browser")
        .expect("it is said");
    assert!(url.ends_with("/tracker"), "{url}");
    assert!(page(&url).contains("<html"), "{url}");
}

/// Nobody can open http://0.0.0.0.
#[test]
fn for_all_interfaces_it_says_the_address_of_this_machine_in_its_network() {
    let service = Service::start(&["--listen", "0.0.0.0:0", "--no-auth"]);
    let here = service
        .address("open ", " in a browser")
        .expect("it is said");
    assert!(here.starts_with("http://127.0.0.1:"), "{here}");
    assert!(page(&here).contains("<html"), "{here}");
    let mut elsewhere = service.messages.iter().filter_map(|line| {
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
    let hint = service
        .messages
        .iter()
        .any(|line| line.contains("camera to https only"));
    assert!(hint, "{:?}", service.messages);
}
