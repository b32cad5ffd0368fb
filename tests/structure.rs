//! The rules for the files of src/: no import circles, data goes one way, no long files, each room says what it is.

mod source_graph;

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use source_graph::SourceGraph;
use walkdir::WalkDir;

const MAX_LINES: usize = 300;
const MAX_HEADER_LINES: usize = 40;
/// The lines of src/tracker without its tests.
const MAX_TRACKER_LINES: usize = 9500;

/// A folder, and those from which it must not import. The tracker imports from no other.
const NOT_FROM: [(&str, &[&str]); 3] = [
    ("ingest/", &["http/", "sessions/", "drawing/"]),
    ("drawing/", &["http/", "sessions/"]),
    ("sessions/", &["http/"]),
];

fn src() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("src")
}

fn graph(folder: &Path) -> SourceGraph {
    SourceGraph::read(folder, env!("CARGO_PKG_NAME"))
}

/// The Rust files below `folder`, by their paths in it, and their texts.
fn files(folder: &Path) -> Vec<(String, String)> {
    let entries = WalkDir::new(folder).sort_by_file_name().into_iter();
    entries
        .map(|entry| entry.expect("a readable folder").into_path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "rs"))
        .map(|path| {
            let name = path.strip_prefix(folder).expect("it is below the folder");
            let name = name.to_str().expect("a plain name").replace('\\', "/");
            (name, fs::read_to_string(path).expect("a readable file"))
        })
        .collect()
}

fn too_long(folder: &Path) -> Vec<String> {
    let lengths = files(folder)
        .into_iter()
        .map(|(name, text)| (name, text.lines().count()));
    let long = lengths.filter(|(_, lines)| *lines > MAX_LINES);
    long.map(|(name, lines)| format!("{name}: {lines} lines"))
        .collect()
}

/// The lines of the files below `folder` but for the tests at the end of each; other code for tests counts.
fn lines_without_tests(folder: &Path) -> usize {
    let lines = files(folder).into_iter().map(|(_, text)| {
        let tests = text.find("\n#[cfg(test)]\nmod tests {");
        let end = tests.map_or(text.len(), |newline| newline + 1);
        text[..end].lines().count()
    });
    lines.sum()
}

/// The mod.rs files of the tracker's rooms that do not begin with a text of 1 to 40 lines.
fn without_header(folder: &Path) -> Vec<String> {
    let rooms = files(folder).into_iter().filter(|(name, _)| {
        name.starts_with("tracker/") && name.ends_with("/mod.rs") && name != "tracker/mod.rs"
    });
    let faults = rooms.filter_map(|(name, text)| {
        let header: Vec<&str> = text
            .lines()
            .map_while(|line| line.strip_prefix("//!"))
            .collect();
        let says_nothing = header.iter().all(|line| line.trim().is_empty());
        if says_nothing || header.iter().any(|line| line.contains("TODO")) {
            Some(format!("{name}: its header is missing or not written yet"))
        } else if header.len() > MAX_HEADER_LINES {
            Some(format!("{name}: a header of {} lines", header.len()))
        } else {
            None
        }
    });
    faults.collect()
}

fn against_the_flow(graph: &SourceGraph) -> Vec<String> {
    let forbidden = |from: &str, to: &str| {
        let leaves_tracker = from.starts_with("tracker/") && !to.starts_with("tracker/");
        let rule = NOT_FROM.iter().find(|(folder, _)| from.starts_with(folder));
        leaves_tracker || rule.is_some_and(|(_, not)| not.iter().any(|not| to.starts_with(not)))
    };
    let imports = graph
        .imports
        .iter()
        .filter(|((from, to), _)| forbidden(from, to));
    imports
        .map(|((from, to), path)| format!("{from} -> {to} by {path}"))
        .collect()
}

fn assert_none(faults: &[String], what: &str) {
    assert!(faults.is_empty(), "{what}:\n{}", faults.join("\n"));
}

#[test]
fn no_files_import_each_other_in_a_circle() {
    assert_none(&graph(&src()).circles(), "import circles");
}

#[test]
fn data_goes_one_way() {
    assert_none(
        &against_the_flow(&graph(&src())),
        "imports against http -> ingest -> sessions -> tracker",
    );
}

#[test]
fn no_file_is_too_long() {
    assert_none(&too_long(&src()), "files over 300 lines");
}

#[test]
fn the_tracker_is_not_too_long() {
    let lines = lines_without_tests(&src().join("tracker"));
    assert!(
        lines <= MAX_TRACKER_LINES,
        "src/tracker has {lines} lines without tests, over {MAX_TRACKER_LINES}"
    );
}

#[test]
fn every_room_of_the_tracker_says_what_it_is() {
    assert_none(
        &without_header(&src()),
        "rooms without a header of 1 to 40 lines",
    );
}

/// Its lib.rs names every file, and nothing leads back to it.
#[test]
fn the_rust_client_keeps_to_the_rules() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("clients/rust/src");
    let graph = SourceGraph::read(&folder, "bagtrack_client");
    let files = files(&folder);
    let all: BTreeSet<&str> = files.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(graph.files(), all);
    assert_none(&graph.circles(), "import circles");
    assert_none(&too_long(&folder), "files over 300 lines");
}

/// What is not read cannot be found wrong.
#[test]
fn every_file_is_read() {
    let files = files(&src());
    let all: BTreeSet<&str> = files.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(graph(&src()).files(), all);
}

/// A folder with these files, which goes away with the test.
fn tree(files: &[(&str, &str)]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("the system has a place for temporary folders");
    for (name, text) in files {
        let path = folder.path().join(name);
        fs::create_dir_all(path.parent().expect("it is in the folder")).expect("a new folder");
        fs::write(path, text).expect("a new file");
    }
    folder
}

/// The imports among these files, `from to`.
fn imports(files: &[(&str, &str)]) -> Vec<String> {
    let graph = graph(tree(files).path());
    graph
        .imports
        .keys()
        .map(|(from, to)| format!("{from} {to}"))
        .collect()
}

#[test]
fn a_circle_is_found_in_each_way_of_naming() {
    let root = "pub mod a; pub mod b; pub use a::A;";
    let b = "pub struct B; pub fn b() {}";
    // Each takes `A` from a.rs, which takes `B` from b.rs.
    for takes in [
        "use crate::a::A;",
        "use crate::A as Other;",
        "use super::{a::{self, A}};",
        "use super::a::*;",
        "use crate::*; type T = Vec<A>;",
        "fn f() { crate::a::g(); }",
        "fn f() { super::a::g() }",
        "fn f() { use crate::a; a::g() }",
        "use crate::a; impl a::Trait for B {}",
        "fn f() { println!(\"{}\", vec![crate::a::g()].len()); }",
        "#[derive(Clone)] #[given(with(crate::a::g))] struct C;",
        "pub mod inner { use super::super::a::A; }",
        "impl B { #[cfg(not(test))] fn f(_: bagtrack::A) {} }",
    ] {
        let b = format!("{b} {takes}");
        let a = "use crate::b::B; pub struct A; pub trait Trait {} pub fn g() {}";
        let folder = tree(&[("lib.rs", root), ("a.rs", a), ("b.rs", &b)]);
        let circles = graph(folder.path()).circles();
        assert_eq!(circles.len(), 1, "{takes}: {circles:?}");
        assert!(circles[0].contains("a.rs -> b.rs") && circles[0].contains("b.rs -> a.rs"));
    }
}

#[test]
fn a_line_of_imports_is_no_circle_and_tests_do_not_count() {
    let tests = "#[cfg(test)] mod tests { use super::*; use crate::a::A; } #[cfg(test)] fn f(_: crate::a::A) {}";
    let b = format!("//! Not [`crate::a::A`].\npub(in crate::room) struct B; {tests}");
    let files = [
        ("lib.rs", "pub mod a; mod room;"),
        ("a.rs", "use crate::room::B; pub struct A;"),
        ("room/mod.rs", "//! A front.\nmod b; pub use self::b::B;"),
        ("room/b.rs", &b),
    ];
    assert_eq!(imports(&files), ["a.rs room/b.rs", "room/mod.rs room/b.rs"]);
    let folder = tree(&files);
    assert!(graph(folder.path()).circles().is_empty());
}

#[test]
fn names_lead_to_the_files_that_define_them() {
    let files = [
        (
            "lib.rs",
            "pub mod front; mod user; pub use front::inner::deep as renamed;",
        ),
        (
            "front/mod.rs",
            "pub mod inner; pub use inner::*; pub use inner::run; pub const OWN: u8 = 0;",
        ),
        (
            "front/inner/mod.rs",
            "mod run; pub use run::run; pub mod deep; made! {}",
        ),
        ("front/inner/run.rs", "pub fn run() {}"),
        ("front/inner/deep.rs", "pub enum Deep { Variant }"),
        ("user/mod.rs", "mod one; mod two; mod three; mod four;"),
        ("user/one.rs", "use crate::front; fn f() { front::run(); }"),
        (
            "user/two.rs",
            "fn f() { crate::renamed::Deep::Variant; std::mem::drop(1) }",
        ),
        ("user/three.rs", "use crate::front::{self, OWN};"),
        ("user/four.rs", "use crate::front::inner::Made;"),
        ("main.rs", "mod cli; fn main() {}"),
        (
            "cli.rs",
            "use bagtrack::front::run; fn f() { crate::main(); }",
        ),
    ];
    let mut found = imports(&files);
    found.retain(|import| import.starts_with("user") || import.starts_with("cli"));
    let expected = [
        "cli.rs front/inner/run.rs",
        "cli.rs main.rs",
        "user/four.rs front/inner/mod.rs",
        "user/one.rs front/inner/run.rs",
        "user/three.rs front/mod.rs",
        "user/two.rs front/inner/deep.rs",
    ];
    assert_eq!(found, expected);
}

#[test]
fn an_import_against_the_flow_a_long_file_and_a_bare_room_are_found() {
    let long = "\n".repeat(301);
    let folder = tree(&[
        ("lib.rs", "mod http; mod ingest; mod sessions; mod tracker;"),
        ("http/mod.rs", "use crate::sessions::S; pub struct H;"),
        (
            "ingest/mod.rs",
            "use crate::sessions::S; use crate::tracker::T;",
        ),
        ("sessions/mod.rs", "use crate::http::H; pub struct S;"),
        ("tracker/mod.rs", "mod room; mod other; pub use room::t::T;"),
        ("tracker/room/mod.rs", "pub mod t;"),
        ("tracker/room/t.rs", "pub struct T(crate::ingest::I);"),
        ("tracker/other/mod.rs", &format!("//! TODO{long}")),
    ]);
    let found = against_the_flow(&graph(folder.path()));
    let froms: Vec<&str> = found
        .iter()
        .filter_map(|fault| fault.split(' ').next())
        .collect();
    assert_eq!(
        froms,
        ["ingest/mod.rs", "sessions/mod.rs", "tracker/room/t.rs"]
    );
    assert_eq!(too_long(folder.path()), ["tracker/other/mod.rs: 301 lines"]);
    let bare = without_header(folder.path());
    assert!(
        bare.len() == 2
            && bare[0].starts_with("tracker/other")
            && bare[1].starts_with("tracker/room")
    );
    let wordy = tree(&[("tracker/room/mod.rs", &"//! word\n".repeat(41))]);
    assert_eq!(
        without_header(wordy.path()),
        ["tracker/room/mod.rs: a header of 41 lines"]
    );
    let right = tree(&[("tracker/room/mod.rs", &"//! word\n".repeat(40))]);
    assert!(without_header(right.path()).is_empty());
}

#[test]
fn tests_at_the_end_of_a_file_are_no_lines_of_it() {
    let folder = tree(&[
        (
            "a.rs",
            "fn a() {}\n#[cfg(test)]\nfn b() {}\n\n#[cfg(test)]\nmod tests {\n}\n",
        ),
        ("room/b.rs", "fn a() {}\nfn b() {}\n"),
    ]);
    assert_eq!(lines_without_tests(folder.path()), 6);
}
