//! The rules for the sources that the compiler does not keep: no circles between folders, each folder says what it is,
//! and each file is compiled.
//!
//! A crate is a wall, so what a crate may use stands in its manifest. Inside a crate a folder is a room: two rooms, of
//! which none is in the other, do not use each other, directly or through others. Files of one room may.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use syn::visit::{self, Visit};
use walkdir::WalkDir;

/// The sources of all crates but the Python package.
fn crates() -> Vec<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let members = fs::read_dir(root.join("crates")).expect("the folder of the crates");
    let members = members.map(|member| member.expect("a readable folder").path());
    let others = [root.to_owned(), root.join("clients/rust"), root.join("sim")];
    members.chain(others).map(|path| path.join("src")).collect()
}

/// The folders of a crate that are its rooms, as module paths.
fn rooms(src: &Path) -> BTreeSet<Vec<String>> {
    let folders = WalkDir::new(src)
        .min_depth(1)
        .into_iter()
        .map(|entry| entry.expect("a readable folder"));
    let folders = folders.filter(|entry| entry.file_type().is_dir());
    folders.map(|entry| module(src, entry.path())).collect()
}

/// The module path of a file or folder.
fn module(src: &Path, path: &Path) -> Vec<String> {
    let inner = path
        .strip_prefix(src)
        .expect("it is below the folder")
        .with_extension("");
    let names = inner
        .iter()
        .map(|name| name.to_str().expect("a plain name").to_owned());
    names
        .filter(|name| !["lib", "main", "mod"].contains(&name.as_str()))
        .collect()
}

/// Collects the paths that code uses, as written.
#[derive(Default)]
struct Paths(Vec<Vec<String>>);

impl Paths {
    fn tree(&mut self, prefix: &[String], tree: &syn::UseTree) {
        match tree {
            syn::UseTree::Path(path) => {
                self.tree(&[prefix, &[path.ident.to_string()]].concat(), &path.tree);
            }
            syn::UseTree::Group(group) => {
                group.items.iter().for_each(|tree| self.tree(prefix, tree))
            }
            syn::UseTree::Name(name) => self.0.push([prefix, &[name.ident.to_string()]].concat()),
            syn::UseTree::Rename(name) => self.0.push([prefix, &[name.ident.to_string()]].concat()),
            syn::UseTree::Glob(_) => self.0.push(prefix.to_vec()),
        }
    }
}

fn is_test(attributes: &[syn::Attribute]) -> bool {
    attributes.iter().any(|attribute| {
        let list = attribute.meta.require_list();
        list.is_ok_and(|list| list.path.is_ident("cfg") && list.tokens.to_string() == "test")
    })
}

impl<'ast> Visit<'ast> for Paths {
    fn visit_item_use(&mut self, item: &'ast syn::ItemUse) {
        self.tree(&[], &item.tree);
    }

    fn visit_path(&mut self, path: &'ast syn::Path) {
        self.0.push(
            path.segments
                .iter()
                .map(|segment| segment.ident.to_string())
                .collect(),
        );
        visit::visit_path(self, path);
    }

    fn visit_item_mod(&mut self, item: &'ast syn::ItemMod) {
        if !is_test(&item.attrs) {
            visit::visit_item_mod(self, item);
        }
    }
}

/// The module path that a path in `file` begins with, from the crate's root.
fn resolve(file: &[String], is_folder: bool, path: &[String]) -> Option<Vec<String>> {
    // `super` of a mod.rs is the folder above its own.
    let ups = path.iter().take_while(|name| *name == "super").count();
    match path.first()?.as_str() {
        "crate" => Some(path[1..].to_vec()),
        "super" => {
            let depth = file.len().checked_sub(ups)?;
            Some([&file[..depth], &path[ups..]].concat())
        }
        "self" if is_folder => Some([file, &path[1..]].concat()),
        _ => None,
    }
}

/// The innermost room of a module path.
fn room_of<'a>(rooms: &'a BTreeSet<Vec<String>>, path: &[String]) -> Option<&'a Vec<String>> {
    (1..=path.len())
        .rev()
        .find_map(|length| rooms.get(&path[..length]))
}

type Uses = BTreeMap<Vec<String>, BTreeSet<Vec<String>>>;

/// Which rooms of a crate each of its rooms uses. Rooms that are in each other count as one.
fn uses(src: &Path) -> Uses {
    let rooms = rooms(src);
    let mut uses = Uses::new();
    for entry in WalkDir::new(src) {
        let entry = entry.expect("a readable folder");
        if entry
            .path()
            .extension()
            .is_none_or(|extension| extension != "rs")
        {
            continue;
        }
        let file = module(src, entry.path());
        let is_folder = entry.file_name() == "mod.rs";
        let Some(from) = room_of(&rooms, &file) else {
            continue;
        };
        let text = fs::read_to_string(entry.path()).expect("a readable file");
        let parsed = syn::parse_file(&text)
            .unwrap_or_else(|error| panic!("{}: {error}", entry.path().display()));
        let mut paths = Paths::default();
        paths.visit_file(&parsed);
        let targets = paths
            .0
            .iter()
            .filter_map(|path| resolve(&file, is_folder, path));
        let targets = targets.filter_map(|path| room_of(&rooms, &path).cloned());
        let apart = targets.filter(|to| !to.starts_with(from) && !from.starts_with(to));
        uses.entry(from.clone()).or_default().extend(apart);
    }
    uses
}

/// The rooms that can be reached from `room`.
fn reached(uses: &Uses, room: &[String]) -> BTreeSet<Vec<String>> {
    let mut reached = BTreeSet::new();
    let mut open = vec![room.to_vec()];
    while let Some(room) = open.pop() {
        for next in uses.get(&room).into_iter().flatten() {
            if reached.insert(next.clone()) {
                open.push(next.clone());
            }
        }
    }
    reached
}

/// The rooms that use each other, directly or through others.
fn circles(src: &Path) -> Vec<String> {
    let uses = uses(src);
    let rooms = uses
        .iter()
        .filter(|(room, _)| reached(&uses, room).contains(*room));
    let shown = rooms.map(|(room, to)| {
        let to: Vec<String> = to.iter().map(|to| to.join("/")).collect();
        format!("{}: {} -> {}", src.display(), room.join("/"), to.join(", "))
    });
    shown.collect()
}

/// The mod.rs files that do not begin with a text.
fn without_header(src: &Path) -> Vec<String> {
    let files = WalkDir::new(src)
        .into_iter()
        .map(|entry| entry.expect("a readable folder").into_path());
    let files = files.filter(|path| path.file_name().is_some_and(|name| name == "mod.rs"));
    let bare = files.filter(|path| {
        let text = fs::read_to_string(path).expect("a readable file");
        text.lines()
            .next()
            .is_none_or(|line| !line.starts_with("//! ") || line.contains("TODO"))
    });
    bare.map(|path| path.display().to_string()).collect()
}

/// The files that their parent does not declare: the compiler never reads them.
fn undeclared(src: &Path) -> Vec<String> {
    let text = |path: &str| fs::read_to_string(src.join(path)).unwrap_or_default();
    let files = WalkDir::new(src)
        .into_iter()
        .map(|entry| entry.expect("a readable folder").into_path());
    let sources = files.filter(|path| path.extension().is_some_and(|extension| extension == "rs"));
    let lost = sources.filter(|path| {
        let file = module(src, path);
        let Some((name, parent)) = file.split_last() else {
            return false;
        };
        let parents = match parent.join("/") {
            root if root.is_empty() => ["lib.rs".to_owned(), "main.rs".to_owned()],
            parent => [format!("{parent}.rs"), format!("{parent}/mod.rs")],
        };
        let declares = format!("mod {name};");
        !parents
            .iter()
            .any(|parent| text(parent).contains(&declares))
    });
    lost.map(|path| path.display().to_string()).collect()
}

fn assert_none(faults: &[String], what: &str) {
    assert!(faults.is_empty(), "{what}:\n{}", faults.join("\n"));
}

#[test]
fn no_rooms_use_each_other_in_a_circle() {
    let found: Vec<String> = crates().iter().flat_map(|src| circles(src)).collect();
    assert_none(&found, "rooms that use each other");
}

#[test]
fn every_room_says_what_it_is() {
    let found: Vec<String> = crates()
        .iter()
        .flat_map(|src| without_header(src))
        .collect();
    assert_none(&found, "rooms without a header");
}

#[test]
fn every_file_is_compiled() {
    let found: Vec<String> = crates().iter().flat_map(|src| undeclared(src)).collect();
    assert_none(&found, "files that no module declares");
}

/// The circles among these files.
fn circles_of(files: &[(&str, &str)]) -> Vec<String> {
    let folder = tempfile::tempdir().expect("the system has a place for temporary folders");
    for (name, text) in files {
        let path = folder.path().join(name);
        fs::create_dir_all(path.parent().expect("it is in the folder")).expect("a new folder");
        fs::write(path, text).expect("a new file");
    }
    circles(folder.path())
}

#[test]
fn a_circle_is_found_in_each_way_of_naming() {
    for takes in [
        "use crate::a::A;",
        "use super::super::{a::{self, A}};",
        "fn f() { crate::a::one::g(); }",
        "pub mod inner { fn f() -> crate::a::A {} }",
        "impl crate::a::Trait for B {}",
    ] {
        let found = circles_of(&[
            ("lib.rs", "mod a; mod b;"),
            ("a/mod.rs", "mod one; use crate::b::B;"),
            ("b/mod.rs", "mod two;"),
            ("b/two.rs", takes),
        ]);
        assert_eq!(found.len(), 2, "{takes}: {found:?}");
    }
}

#[test]
fn a_line_of_uses_is_no_circle_and_tests_and_inner_rooms_do_not_count() {
    let found = circles_of(&[
        ("lib.rs", "mod a; mod b;"),
        ("a/mod.rs", "mod inner; pub use inner::I; use crate::b::B;"),
        ("a/inner/mod.rs", "use super::A; use crate::a::A;"),
        ("b/mod.rs", "#[cfg(test)] mod tests { use crate::a::A; }"),
    ]);
    assert!(found.is_empty(), "{found:?}");
}
