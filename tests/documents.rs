//! The documents lead where they say: each link of one to a file or a heading of the project finds it.

use std::fs;
use std::path::{Path, PathBuf};

use walkdir::WalkDir;

/// Folders that are not the project's own text.
const OTHERS: [&str; 4] = ["target", "node_modules", ".git", "wasm"];

fn documents() -> Vec<PathBuf> {
    let entries = WalkDir::new(env!("CARGO_MANIFEST_DIR"))
        .into_iter()
        .filter_entry(|entry| !OTHERS.iter().any(|name| entry.file_name() == *name));
    let paths = entries.map(|entry| entry.expect("a readable folder").into_path());
    paths
        .filter(|path| path.extension().is_some_and(|ending| ending == "md"))
        .collect()
}

/// The text without its blocks of code, whose brackets are no links.
fn prose(text: &str) -> String {
    let parts = text.split("\n```").enumerate();
    parts
        .filter_map(|(at, part)| (at % 2 == 0).then_some(part))
        .collect()
}

/// Where its links lead, but for those to other places.
fn links(prose: &str) -> Vec<&str> {
    let targets = prose.split("](").skip(1);
    let targets = targets.filter_map(|rest| Some(rest.split_once(')')?.0));
    targets
        .filter(|target| !target.contains("://") && !target.starts_with("mailto:"))
        .collect()
}

/// What GitHub and others call the place of a heading.
fn anchor(heading: &str) -> String {
    let words = heading.trim_start_matches('#').trim().to_lowercase();
    let kept = words.chars().filter_map(|sign| match sign {
        ' ' => Some('-'),
        '-' | '_' => Some(sign),
        _ => sign.is_alphanumeric().then_some(sign),
    });
    kept.collect()
}

/// What is wrong with a link of a document.
fn fault(document: &Path, link: &str) -> Option<String> {
    let (path, place) = link.split_once('#').unwrap_or((link, ""));
    let folder = document.parent().expect("a file is in a folder");
    let target = match path {
        "" => document.to_owned(),
        path => folder.join(path),
    };
    let fault = |what: &str| Some(format!("{}: {link}: {what}", document.display()));
    if !target.exists() {
        return fault("there is no such file");
    }
    if place.is_empty() || target.extension().is_none_or(|ending| ending != "md") {
        return None;
    }
    let text = fs::read_to_string(&target).expect("a document is text");
    let has_it = prose(&text)
        .lines()
        .any(|line| line.starts_with('#') && anchor(line) == place);
    match has_it {
        true => None,
        false => fault("there is no such heading"),
    }
}

#[test]
fn links_lead_somewhere() {
    let documents = documents();
    assert!(documents.len() >= 15, "{documents:?}");
    let mut count = 0;
    let mut faults = Vec::new();
    for document in &documents {
        let text = fs::read_to_string(document).expect("a document is text");
        let prose = prose(&text);
        let links = links(&prose);
        count += links.len();
        faults.extend(links.iter().filter_map(|link| fault(document, link)));
    }
    assert!(count > 100, "{count} links");
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn a_link_that_leads_nowhere_is_found() {
    let readme = Path::new(env!("CARGO_MANIFEST_DIR")).join("README.md");
    for link in ["docs/nothing.md", "README.md#nothing", "#nothing"] {
        assert!(fault(&readme, link).is_some(), "{link}");
    }
    for link in ["docs", "README.md", "README.md#licence", "#limits"] {
        assert_eq!(fault(&readme, link), None);
    }
}
