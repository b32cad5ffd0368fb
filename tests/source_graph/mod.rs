//! Which file of a source folder takes something from which other, as the compiler resolves names: through `use`,
//! inline paths, paths within macros, globs and re-exports. Code under `#[cfg(test)]` is left out.
//!
//! A name that a file only passes on by `use` counts as taken from the file that defines it. Naming a module alone
//! counts for its file unless that is a `mod.rs`, of which only the items that it defines itself count.

mod references;

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::fs;
use std::path::Path;

use petgraph::algo::tarjan_scc;
use petgraph::graphmap::DiGraphMap;
use references::{References, Segments};
use syn::Item;
use syn::visit::Visit;

/// Longer chains of re-exports are taken for endless ones.
const MAX_DEPTH: usize = 32;

/// What a name stands for in a module.
enum Name {
    Module(usize),
    Item,
    Import(Segments),
}

/// What a path leads to: a module, or an item that a module defines.
#[derive(Clone, Copy)]
enum Target {
    Module(usize),
    ItemOf(usize),
}

struct Module {
    file: String,
    root: usize,
    parent: Option<usize>,
    names: HashMap<String, Vec<Name>>,
    globs: Vec<Segments>,
}

/// The files of a source folder by their paths in it, and what they take from each other.
#[derive(Default)]
pub struct SourceGraph {
    modules: Vec<Module>,
    references: Vec<(usize, Segments)>,
    /// The importing file and the imported one, with one path that leads there.
    pub imports: BTreeMap<(String, String), String>,
}

impl SourceGraph {
    /// Reads the crates `lib.rs`, called `library` by others, and `main.rs` in `folder`, where there are such files.
    pub fn read(folder: &Path, library: &str) -> Self {
        let mut graph = Self::default();
        for root in ["lib.rs", "main.rs"] {
            if folder.join(root).exists() {
                graph.load(folder, root.to_owned(), None);
            }
        }
        for (from, path) in &graph.references {
            let target = match graph.resolve(*from, path, library, 0) {
                Some(Target::ItemOf(module)) => module,
                Some(Target::Module(module)) if !graph.is_front(module) => module,
                _ => continue,
            };
            let [from, to] = [*from, target].map(|module| graph.modules[module].file.clone());
            if from != to {
                let shown = || path.join("::");
                graph.imports.entry((from, to)).or_insert_with(shown);
            }
        }
        graph
    }

    /// The files that were read.
    pub fn files(&self) -> BTreeSet<&str> {
        self.modules.iter().map(|m| m.file.as_str()).collect()
    }

    /// The imports among the files of each circle, a text for each circle.
    pub fn circles(&self) -> Vec<String> {
        let edges = self.imports.keys();
        let graph: DiGraphMap<&str, ()> = edges.map(|(a, b)| (a.as_str(), b.as_str())).collect();
        let circles = tarjan_scc(&graph).into_iter().filter(|c| c.len() > 1);
        let text = |circle: Vec<&str>| {
            let inside = |file: &String| circle.contains(&file.as_str());
            let edges = self
                .imports
                .iter()
                .filter(|((a, b), _)| inside(a) && inside(b));
            let lines = edges.map(|((a, b), path)| format!("\n    {a} -> {b} by {path}"));
            format!("{} files:{}", circle.len(), lines.collect::<String>())
        };
        circles.map(text).collect()
    }

    fn is_front(&self, module: usize) -> bool {
        let file = &self.modules[module].file;
        ["mod.rs", "lib.rs", "main.rs"].contains(&file.rsplit('/').next().unwrap_or(file))
    }

    /// Reads a file and the modules in it; returns its module.
    fn load(&mut self, folder: &Path, file: String, parent: Option<usize>) -> usize {
        let text = fs::read_to_string(folder.join(&file)).expect("a readable file");
        let syntax = syn::parse_file(&text).unwrap_or_else(|error| panic!("{file}: {error}"));
        let stem = file.strip_suffix(".rs").expect("a Rust file");
        let (above, name) = stem.rsplit_once('/').unwrap_or(("", stem));
        let children = if ["mod", "lib", "main"].contains(&name) {
            above
        } else {
            stem
        };
        let module = self.add(file.clone(), parent);
        self.declare(folder, children, module, &syntax.items);
        module
    }

    fn add(&mut self, file: String, parent: Option<usize>) -> usize {
        let module = self.modules.len();
        self.modules.push(Module {
            file,
            root: parent.map_or(module, |parent| self.modules[parent].root),
            parent,
            names: HashMap::new(),
            globs: Vec::new(),
        });
        module
    }

    /// Takes in the items of a module, whose child modules are files in `children`.
    fn declare(&mut self, folder: &Path, children: &str, module: usize, items: &[Item]) {
        for item in items.iter().filter(|item| !references::is_for_tests(item)) {
            let Item::Mod(child) = item else {
                if let Some(name) = references::defined(item) {
                    self.name(module, name, Name::Item);
                }
                let mut taken = References::default();
                taken.visit_item(item);
                for (name, path) in taken.uses {
                    self.references.push((module, path.clone()));
                    match name.as_str() {
                        "*" => self.modules[module].globs.push(path),
                        _ => self.name(module, name, Name::Import(path)),
                    }
                }
                let paths = taken.paths.into_iter().map(|path| (module, path));
                self.references.extend(paths);
                continue;
            };
            let name = child.ident.to_string();
            let below = format!("{children}/{name}")
                .trim_start_matches('/')
                .to_owned();
            let id = if let Some((_, items)) = &child.content {
                let file = self.modules[module].file.clone();
                let id = self.add(file, Some(module));
                self.declare(folder, &below, id, items);
                id
            } else {
                let files = [format!("{below}.rs"), format!("{below}/mod.rs")];
                let file = files.into_iter().find(|file| folder.join(file).exists());
                let file = file.unwrap_or_else(|| panic!("no file for the module {below}"));
                self.load(folder, file, Some(module))
            };
            self.name(module, name, Name::Module(id));
        }
    }

    fn name(&mut self, module: usize, name: String, stands_for: Name) {
        let names = &mut self.modules[module].names;
        names.entry(name).or_default().push(stands_for);
    }

    fn resolve(&self, from: usize, path: &[String], library: &str, depth: usize) -> Option<Target> {
        let (first, rest) = path.split_first()?;
        let find = |module: usize, name: &String, is_last: bool| match name.as_str() {
            "self" => Some(Target::Module(module)),
            "super" => self.modules[module].parent.map(Target::Module),
            _ => self.lookup(module, name, is_last, library, depth + 1),
        };
        let library_root = || (first == library).then_some(Target::Module(0));
        let mut target = match first.as_str() {
            "crate" => Target::Module(self.modules[from].root),
            _ => find(from, first, rest.is_empty()).or_else(library_root)?,
        };
        for (index, name) in rest.iter().enumerate() {
            let Target::Module(module) = target else {
                break;
            };
            // What is not found was made by a macro of that module.
            let found = find(module, name, index + 1 == rest.len());
            target = found.unwrap_or(Target::ItemOf(module));
        }
        Some(target)
    }

    /// A module and an item may have the same name: the last name of a path is rather the item's.
    fn lookup(
        &self,
        module: usize,
        name: &str,
        is_last: bool,
        library: &str,
        depth: usize,
    ) -> Option<Target> {
        if depth > MAX_DEPTH {
            return None;
        }
        let here = &self.modules[module];
        let mut found: Vec<Target> = Vec::new();
        for stands_for in here.names.get(name).into_iter().flatten() {
            found.extend(match stands_for {
                Name::Module(child) => Some(Target::Module(*child)),
                Name::Item => Some(Target::ItemOf(module)),
                Name::Import(path) => self.resolve(module, path, library, depth),
            });
        }
        let preferred = |target: &&Target| matches!(target, Target::ItemOf(_)) == is_last;
        if let Some(target) = found.iter().find(preferred).or(found.first()) {
            return Some(*target);
        }
        here.globs
            .iter()
            .find_map(|glob| match self.resolve(module, glob, library, depth) {
                Some(Target::Module(other)) if other != module => {
                    self.lookup(other, name, is_last, library, depth + 1)
                }
                _ => None,
            })
    }
}
