//! Each line of the threat tables of SECURITY.md and docs/RELIABILITY.md names a test or an attack that there is.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use syn::visit::{self, Visit};
use walkdir::WalkDir;

/// The names of all tests.
#[derive(Default)]
struct Tests(BTreeSet<String>);

impl<'ast> Visit<'ast> for Tests {
    fn visit_item_fn(&mut self, function: &'ast syn::ItemFn) {
        let is_test = function.attrs.iter().any(|attribute| {
            let last = attribute.path().segments.last();
            last.is_some_and(|segment| segment.ident == "test")
        });
        if is_test {
            self.0.insert(function.sig.ident.to_string());
        }
        visit::visit_item_fn(self, function);
    }
}

fn read(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

fn tests(root: &Path) -> BTreeSet<String> {
    let mut tests = Tests::default();
    for folder in ["src", "crates", "tests"] {
        for entry in WalkDir::new(root.join(folder)) {
            let path = entry.expect("a readable folder").into_path();
            if path.extension().is_some_and(|extension| extension == "rs") {
                let parsed = syn::parse_file(&read(&path));
                tests.visit_file(
                    &parsed.unwrap_or_else(|error| panic!("{}: {error}", path.display())),
                );
            }
        }
    }
    tests.0
}

/// The attacks that the attack program runs.
fn attacks(root: &Path) -> BTreeSet<String> {
    let main = read(&root.join("examples/attack/main.rs"));
    let (_, list) = main.split_once("attack!(\n").expect("the list of attacks");
    let (list, _) = list.split_once(')').expect("its end");
    list.split(',').map(|name| name.trim().to_owned()).collect()
}

/// The names in the last column of each line of the table below a heading.
fn held_by(text: &str, heading: &str) -> Vec<(String, Vec<String>)> {
    let (_, section) = text.split_once(heading).expect("the heading");
    let section = section.split("\n## ").next().unwrap_or_default();
    let lines = section.lines().filter(|line| line.starts_with('|')).skip(2);
    lines
        .map(|line| {
            let cells: Vec<&str> = line.trim_matches('|').split('|').collect();
            let last = cells.last().expect("a cell");
            let names = last.split('`').skip(1).step_by(2).map(str::to_owned);
            (line.to_owned(), names.collect())
        })
        .collect()
}

#[test]
fn every_line_of_the_threat_tables_names_tests_that_there_are() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let (tests, attacks) = (tests(root), attacks(root));
    let is_there = |name: &String| match name.strip_suffix('…') {
        Some(begin) => tests.iter().filter(|test| test.starts_with(begin)).count() == 1,
        None => tests.contains(name) || attacks.contains(name),
    };
    for (document, heading) in [
        ("SECURITY.md", "## What one client can cost at most"),
        ("docs/RELIABILITY.md", "# Reliability"),
    ] {
        let table = held_by(&read(&root.join(document)), heading);
        assert!(table.len() >= 12, "{table:?}");
        let missing: Vec<_> = table
            .iter()
            .filter(|(_, names)| names.is_empty() || !names.iter().all(is_there))
            .collect();
        assert!(missing.is_empty(), "{document}: {missing:#?}");
    }
}

#[test]
fn every_attack_is_told_in_the_documents() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let reliability = read(&root.join("docs/RELIABILITY.md"));
    let untold: Vec<String> = attacks(root)
        .into_iter()
        .filter(|name| !reliability.contains(&format!("`{name}`")))
        .collect();
    assert!(untold.is_empty(), "{untold:?}");
}
