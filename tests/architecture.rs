//! Holds the invariants of ARCHITECTURE.md: what must stay absent where.
//!
//! Reads the sources as text, without comments and without their unit tests.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test")]

use std::fs;
use std::path::{Path, PathBuf};

/// Uses of a module below one's own that are allowed, as (file, module): none.
const UPWARD: &[(&str, &str)] = &[];

/// Where files may be read or written: importers, and the formats of results.
const FILES: &[&str] = &["scene/", "store", "export"];

/// The one file with `unsafe` code.
const UNSAFE: &[&str] = &["simd.rs"];

struct Source {
    /// Below `src`, with `/`.
    name: String,
    code: String,
}

impl Source {
    /// The module of lib.rs that it belongs to.
    fn module(&self) -> &str {
        self.name.split(['/', '.']).next().unwrap()
    }

    /// How many `super::` lead to the root of the crate.
    fn depth(&self) -> usize {
        self.name.split('/').count()
    }
}

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn sources() -> Vec<Source> {
    let src = root().join("src");
    let mut folders = vec![src.clone()];
    let mut found = Vec::new();
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path: PathBuf = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
                continue;
            }
            let parts: Vec<_> =
                path.strip_prefix(&src).unwrap().iter().map(|p| p.to_str().unwrap()).collect();
            let name = parts.join("/");
            if name.ends_with(".rs") && !name.ends_with("tests.rs") && name != "lib.rs" {
                let code = code_of(&fs::read_to_string(&path).unwrap());
                found.push(Source { name, code });
            }
        }
    }
    assert!(found.len() > 30, "the sources were not found");
    found
}

/// Without comments and unit tests.
fn code_of(text: &str) -> String {
    let mut code = String::new();
    let mut lines = text.lines().peekable();
    while let Some(line) = lines.next() {
        let tests = lines.peek().is_some_and(|next| next.contains("mod tests {"));
        if line == "#[cfg(test)]" && tests {
            lines.by_ref().find(|&line| line == "}");
            continue;
        }
        code += line.split("//").next().unwrap();
        code.push('\n');
    }
    code
}

/// Modules in the order of lib.rs.
fn modules() -> Vec<String> {
    let lib = fs::read_to_string(root().join("src/lib.rs")).unwrap();
    let modules: Vec<String> = lib
        .lines()
        .filter_map(|line| {
            line.strip_prefix("pub mod ").or(line.strip_prefix("mod "))?.strip_suffix(';')
        })
        .map(str::to_owned)
        .collect();
    assert!(modules.len() > 10, "lib.rs was not understood");
    modules
}

fn is_word(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

/// Where `word` stands as a word of its own.
fn words<'a>(code: &'a str, word: &'a str) -> impl Iterator<Item = usize> + 'a {
    code.match_indices(word).map(|m| m.0).filter(move |&at| {
        !code[..at].ends_with(is_word) && !code[at + word.len()..].starts_with(is_word)
    })
}

/// The names that follow `path` directly, or in braces: `crate::a` and `crate::{a::B, c}`.
fn names_after(code: &str, path: &str) -> Vec<String> {
    let mut names = Vec::new();
    for (at, _) in code.match_indices(path) {
        if code[..at].ends_with(|c| is_word(c) || c == ':') {
            continue;
        }
        let rest = &code[at + path.len()..];
        let first = |s: &str| -> String { s.trim().chars().take_while(|&c| is_word(c)).collect() };
        let Some(list) = rest.strip_prefix('{') else {
            names.push(first(rest));
            continue;
        };
        let (mut depth, mut from) = (0, 0);
        for (i, c) in list.char_indices() {
            match c {
                '{' => depth += 1,
                '}' if depth > 0 => depth -= 1,
                '}' | ',' if depth == 0 => {
                    names.push(first(&list[from..i]));
                    from = i + 1;
                    if c == '}' {
                        break;
                    }
                }
                _ => {}
            }
        }
    }
    names.retain(|n| !n.is_empty());
    names
}

/// The sources of a module of lib.rs that have one of `words` in them.
fn mentions(sources: &[Source], module: &str, forbidden: &[&str]) -> Vec<String> {
    sources
        .iter()
        .filter(|s| s.module() == module)
        .flat_map(|s| forbidden.iter().map(move |&w| (s, w)))
        .filter(|(s, w)| words(&s.code, w).next().is_some())
        .map(|(s, w)| format!("{}: {w}", s.name))
        .collect()
}

#[test]
fn a_module_uses_only_those_above_it() {
    let modules = modules();
    let place = |name: &str| modules.iter().position(|m| m == name);
    let mut wrong = Vec::new();
    for source in sources() {
        let own = place(source.module())
            .unwrap_or_else(|| panic!("{} belongs to no module of lib.rs", source.name));
        let to_root = "super::".repeat(source.depth());
        for used in ["crate::", &to_root].iter().flat_map(|p| names_after(&source.code, p)) {
            let allowed = UPWARD.contains(&(source.name.as_str(), used.as_str()));
            if place(&used).is_some_and(|p| p > own) && !allowed {
                wrong.push(format!("{} uses {used}, which is below {}", source.name, modules[own]));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn the_library_never_prints_exits_or_reads_the_environment() {
    const FORBIDDEN: &[&str] =
        &["print!", "println!", "eprint!", "eprintln!", "dbg!", "stdout", "stderr", "stdin"];
    let mut wrong = Vec::new();
    for source in sources() {
        for word in FORBIDDEN.iter().chain(&["std::env", "process::exit", "process::abort"]) {
            if words(&source.code, word).next().is_some() {
                wrong.push(format!("{}: {word}", source.name));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn unsafe_code_has_one_place() {
    let wrong: Vec<String> = sources()
        .into_iter()
        .filter(|s| words(&s.code, "unsafe").next().is_some() && !UNSAFE.contains(&&*s.name))
        .map(|s| s.name)
        .collect();
    assert!(wrong.is_empty(), "{wrong:?}");
}

#[test]
fn files_are_touched_by_importers_and_results_alone() {
    let wrong: Vec<String> = sources()
        .into_iter()
        .filter(|s| {
            ["fs", "tempfile", "OpenOptions"].iter().any(|w| words(&s.code, w).next().is_some())
        })
        .map(|s| s.name)
        .filter(|name| !FILES.iter().any(|place| name.starts_with(place)))
        .collect();
    assert!(wrong.is_empty(), "{wrong:?}");
}

#[test]
fn form_factors_see_no_materials() {
    let sources = sources();
    // `Texture` alone is a word of graphics devices.
    let optics = &["optics", "Optics", "Material", "TextureSampler", "Scene"];
    let mut wrong = mentions(&sources, "form_factors", optics);
    wrong.extend(mentions(&sources, "engines", optics));
    wrong.extend(mentions(&sources, "patches", optics));
    wrong.extend(mentions(&sources, "visibility", optics));
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn solvers_know_no_engine_and_no_device() {
    let wrong = mentions(
        &sources(),
        "solve",
        &["Engine", "Hemicube", "Draw", "wgpu", "visibility", "Geometry", "Patches"],
    );
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn the_document_lists_the_modules_in_order() {
    let document = fs::read_to_string(root().join("ARCHITECTURE.md")).unwrap();
    let listed: Vec<&str> = document
        .lines()
        .filter_map(|line| line.strip_prefix("| `")?.split_once('`'))
        .map(|(name, _)| name)
        .collect();
    assert_eq!(listed, modules(), "the table of modules in ARCHITECTURE.md");
}

#[test]
fn the_documents_point_at_files_that_exist() {
    for name in ["README.md", "ARCHITECTURE.md", "CONTRIBUTING.md", "docs/benchmarks.md"] {
        let path = root().join(name);
        let text = fs::read_to_string(&path).unwrap();
        for target in text.split("](").skip(1).filter_map(|s| s.split([')', '#']).next()) {
            let outside = target.is_empty() || target.starts_with("http");
            assert!(outside || path.with_file_name(target).exists(), "{name}: {target}");
        }
    }
}

#[test]
fn the_reader_of_sources_finds_what_it_looks_for() {
    let code = code_of(
        "use crate::{a::B, c::{D, E}, f};\nlet x = crate::g::H; // crate::no\n\
         use super::super::i;\n#[cfg(test)]\nmod tests {\n    use crate::j;\n}\nuse crate::k;\n",
    );
    assert_eq!(names_after(&code, "crate::"), ["a", "c", "f", "g", "k"]);
    assert_eq!(names_after(&code, "super::super::"), ["i"]);
    assert_eq!(names_after(&code, "super::"), ["super"], "a longer path is another place");
    assert_eq!(words("fs::read(offs, fs)", "fs").count(), 2);
}
