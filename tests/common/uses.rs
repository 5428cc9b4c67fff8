//! Which files of a crate use which, and where they do so in a circle.
//!
//! `mod x;` and a parent's `pub use x::Y;` are a table of contents and no use. Every other `use`,
//! and every path in code, is a use of the file that defines the name.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use crate::modules::Module;
use crate::sources::Source;

/// The files of a crate and what they use of each other.
pub struct Crate {
    modules: Vec<Module>,
    /// The names that one file uses of another.
    pub uses: BTreeMap<(usize, usize), BTreeSet<String>>,
    /// Paths that lead nowhere, or that the reader does not follow.
    pub unknown: Vec<String>,
}

/// What a path leads to: a module, an item (by the file that defines it), or both of one name.
#[derive(Clone, Copy, Default)]
struct Target {
    module: Option<usize>,
    item: Option<usize>,
}

impl Target {
    fn is_none(self) -> bool {
        self.module.is_none() && self.item.is_none()
    }
}

/// Files that use each other.
pub struct Circle {
    /// All files from each of which one comes to each other.
    pub files: Vec<String>,
    /// A shortest way round, with the names that lead on.
    pub way: Vec<String>,
}

impl Crate {
    pub fn new(sources: &[Source]) -> Self {
        let mut modules: Vec<Module> = sources.iter().map(Module::read).collect();
        let place = |path: &str| sources.iter().position(|s| path_of(&s.name) == path);
        for (i, source) in sources.iter().enumerate() {
            let path = path_of(&source.name);
            if path.is_empty() {
                continue;
            }
            let (above, own) = path.rsplit_once('/').unwrap_or(("", path));
            let parent = place(above).unwrap_or_else(|| panic!("no parent of {}", source.name));
            modules[i].parent = Some(parent);
            modules[parent].children.insert(own.to_owned(), i);
        }
        let mut all = Self { modules, uses: BTreeMap::new(), unknown: Vec::new() };
        for from in 0..all.modules.len() {
            all.follow_uses(from);
        }
        all
    }

    pub fn name(&self, file: usize) -> &str {
        &self.modules[file].name
    }

    fn follow_uses(&mut self, from: usize) {
        let mut found: Vec<(String, usize)> = Vec::new();
        let module = &self.modules[from];
        let mut unknown = Vec::new();
        let mut add = |path: &[String], target: Target| {
            if let Some(to) = target.item.filter(|&to| to != from) {
                // Of a type's own function the type.
                let of_type = path.iter().find(|name| name.starts_with(char::is_uppercase));
                found.push((of_type.or(path.last()).cloned().unwrap_or_default(), to));
            }
            let ours = ["crate", "super", "self"].contains(&path[0].as_str());
            if target.is_none() && ours {
                unknown.push(format!("{}: {}", module.name, path.join("::")));
            }
        };
        let of_child =
            |path: &[String]| path.iter().find(|s| *s != "self").map(|s| module.children.get(s));
        for import in &module.imports {
            let target = self.resolve(from, &import.path, 0);
            if import.alias == "*" && target.module.is_some() {
                add(&["self".to_owned(), import.path.join("::") + "::*"], Target::default());
            } else if !(import.public && of_child(&import.path).flatten().is_some()) {
                add(&import.path, target);
            }
        }
        for path in &module.paths {
            add(path, self.resolve(from, path, 0));
        }
        for (name, to) in found {
            self.uses.entry((from, to)).or_default().insert(name);
        }
        self.unknown.append(&mut unknown);
    }

    /// Where a path leads to that stands in file `from`; nowhere if to another crate.
    fn resolve(&self, from: usize, path: &[String], depth: usize) -> Target {
        let mut at = Target::default();
        for (k, name) in path.iter().enumerate() {
            at = match (name.as_str(), k) {
                ("crate", 0) => Target { module: self.root(), item: None },
                ("self", 0) => Target { module: Some(from), item: None },
                ("super", 0) => Target { module: self.modules[from].parent, item: None },
                ("super", _) => {
                    Target { module: at.module.and_then(|m| self.modules[m].parent), item: None }
                }
                (name, 0) => self.find(from, name, depth),
                (name, _) => match at.module {
                    Some(module) => self.find(module, name, depth),
                    // What belongs to an item is where the item is.
                    None => return at,
                },
            };
        }
        at
    }

    /// What a name means in a module.
    fn find(&self, module: usize, name: &str, depth: usize) -> Target {
        /// Re-exports are followed so far; those of other crates name themselves without end.
        const DEEPEST: usize = 8;
        let here = &self.modules[module];
        let mut found = Target {
            module: here.children.get(name).copied(),
            item: here.defined.contains(name).then_some(module),
        };
        for import in here.imports.iter().filter(|i| i.alias == name && depth < DEEPEST) {
            let more = self.resolve(module, &import.path, depth + 1);
            found.module = found.module.or(more.module);
            found.item = found.item.or(more.item);
        }
        found
    }

    fn root(&self) -> Option<usize> {
        self.modules.iter().position(|m| m.parent.is_none())
    }

    /// All groups of files that use each other in circles.
    pub fn circles(&self) -> Vec<Circle> {
        let reached: Vec<BTreeSet<usize>> = (0..self.modules.len())
            .map(|from| self.ways(from).into_iter().map(|(to, _)| to).collect())
            .collect();
        let mut circles = Vec::new();
        let mut seen = BTreeSet::new();
        for from in 0..self.modules.len() {
            if !reached[from].contains(&from) || seen.contains(&from) {
                continue;
            }
            let files: Vec<usize> =
                reached[from].iter().copied().filter(|&to| reached[to].contains(&from)).collect();
            seen.extend(files.iter().copied());
            let shortest = files
                .iter()
                .map(|&file| self.way_back(file))
                .min_by_key(Vec::len)
                .unwrap_or_default();
            circles.push(Circle {
                files: files.iter().map(|&f| self.name(f).to_owned()).collect(),
                way: shortest,
            });
        }
        circles
    }

    /// The files that one comes to from a file, nearest first, and from which.
    fn ways(&self, from: usize) -> Vec<(usize, usize)> {
        let mut found: Vec<(usize, usize)> = Vec::new();
        let mut next = VecDeque::from([from]);
        while let Some(at) = next.pop_front() {
            for &(_, to) in self.uses.range((at, 0)..(at + 1, 0)).map(|(pair, _)| pair) {
                if found.iter().all(|f| f.0 != to) {
                    found.push((to, at));
                    next.push_back(to);
                }
            }
        }
        found
    }

    /// A shortest way from a file back to itself.
    fn way_back(&self, file: usize) -> Vec<String> {
        let ways: BTreeMap<usize, usize> = self.ways(file).into_iter().collect();
        let (mut at, mut way) = (file, Vec::new());
        loop {
            let from = ways[&at];
            let names: Vec<&str> = self.uses[&(from, at)].iter().map(String::as_str).collect();
            way.push(format!("{} -> {} ({})", self.name(from), self.name(at), names.join(", ")));
            at = from;
            if at == file {
                way.reverse();
                return way;
            }
        }
    }
}

/// The path of a file's module below the root, which has none.
fn path_of(name: &str) -> &str {
    let path = name.strip_suffix(".rs").unwrap_or(name);
    if path == "lib" || path == "main" { "" } else { path }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The uses of made-up files, as `from -> to: names`, but those of the root.
    fn uses(files: &[(&str, &str)]) -> Vec<String> {
        let all = read(files);
        assert!(all.unknown.is_empty(), "{:?}", all.unknown);
        let names = |names: &BTreeSet<String>| names.iter().cloned().collect::<Vec<_>>().join(" ");
        all.uses
            .iter()
            .map(|(&(from, to), of)| {
                format!("{} -> {}: {}", all.name(from), all.name(to), names(of))
            })
            .collect()
    }

    fn read(files: &[(&str, &str)]) -> Crate {
        let sources: Vec<Source> =
            files.iter().map(|(name, text)| Source::new(&format!("{name}.rs"), text)).collect();
        Crate::new(&sources)
    }

    #[test]
    fn a_table_of_contents_is_no_use() {
        let files = [
            ("lib", "pub mod a; pub use a::X;"),
            ("a", "mod b; pub(crate) mod c; pub use b::X; pub(super) use self::c::{Y, Z};"),
            ("a/b", "use super::Y; pub struct X;"),
            ("a/c", "pub struct Y; pub struct Z;"),
        ];
        assert_eq!(uses(&files), ["a/b.rs -> a/c.rs: Y"]);
    }

    #[test]
    fn a_name_is_found_where_it_is_defined() {
        let files = [
            ("lib", "mod a; mod d;"),
            ("a", "mod b; pub use b::{X as R, make}; pub const K: f64 = 1.0;"),
            ("a/b", "mod c; pub use c::X; pub fn make() {}"),
            ("a/b/c", "use super::super::K; pub struct X; macro_rules! m { () => {} } use m;"),
            (
                "d",
                "use crate::a::{self, R}; use crate::{a::b::{c::m as _, c}, other}; use std::fs;\n\
                 fn f(x: c::X) { a::make(); R::new(); std::iter::once(crate::a::K) }",
            ),
        ];
        let found = [
            "a/b/c.rs -> a.rs: K",
            "d.rs -> a.rs: K",
            "d.rs -> a/b.rs: make",
            "d.rs -> a/b/c.rs: R X m",
        ];
        let unknown = read(&files).unknown;
        assert_eq!(unknown, ["d.rs: crate::other"]);
        let files = files.map(|(name, text)| (name, text.replace(", other", "")));
        assert_eq!(uses(&files.each_ref().map(|(name, text)| (*name, text.as_str()))), found);
    }

    #[test]
    fn a_parent_uses_a_child_that_it_works_with() {
        let child = ("a/b", "pub struct X; pub fn make() {}");
        for (parent, names) in [
            ("mod b; use b::X;", "X"),
            ("mod b; fn f() { b::make() }", "make"),
            ("mod b; fn f() -> self::b::X {}", "X"),
            ("mod b; pub use b::{X, make}; fn f(x: X) { x.make(); make() }", "X make"),
            ("mod b; pub use b::X; fn f() { X::new() }", "X"),
        ] {
            let files = [("lib", "mod a;"), ("a", parent), child];
            assert_eq!(uses(&files), [format!("a.rs -> a/b.rs: {names}")], "{parent}");
        }
        let parent = "mod b; pub use b::make; struct S { make: bool } fn f(s: S) { s.make() }\n\
                      #[cfg(test)] mod tests { use super::b::X; } // b::X\nfn g() { \"b::X\" }";
        assert_eq!(uses(&[("lib", "mod a;"), ("a", parent), child]), [""; 0]);
    }

    #[test]
    fn items_within_the_call_of_a_macro_are_defined() {
        let files = [
            ("lib", "mod a; mod b;"),
            ("a", "twice! { pub fn f() { const K: u8 = 0; } }"),
            (
                "b",
                "use super::a::f; impl Iterator + use<'a> {} use f as g; pub(in crate::a) fn h();",
            ),
        ];
        assert_eq!(uses(&files), ["b.rs -> a.rs: f"]);
        let hidden = [("lib", "mod a; mod b;"), files[1], ("b", "use super::a::K;")];
        assert_eq!(read(&hidden).unknown, ["b.rs: super::a::K"]);
        let all = [("lib", "mod a; mod b;"), files[1], ("b", "use super::a::*;")];
        assert_eq!(read(&all).unknown.len(), 1, "all names at once cannot be followed");
    }

    #[test]
    fn circles_are_found_with_a_shortest_way_round() {
        let files = [
            ("lib", "mod a; mod b; mod c; mod d;"),
            ("a", "use crate::b::B; pub struct A; pub struct O;"),
            ("b", "use crate::c::C; pub struct B;"),
            ("c", "use crate::{a::A, d::D}; fn f() { super::b::B } pub struct C;"),
            ("d", "pub struct D;"),
        ];
        let circles = read(&files).circles();
        assert_eq!(circles.len(), 1);
        assert_eq!(circles[0].files, ["a.rs", "b.rs", "c.rs"]);
        assert_eq!(circles[0].way, ["b.rs -> c.rs (C)", "c.rs -> b.rs (B)"]);
    }
}
