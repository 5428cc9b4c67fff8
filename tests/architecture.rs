//! Holds the invariants of ARCHITECTURE.md: what must stay absent where.
//!
//! Reads the sources as text, without comments and without their unit tests.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test")]

#[path = "common/modules.rs"]
mod modules;
#[path = "common/sources.rs"]
mod sources;
#[path = "common/uses.rs"]
mod uses;

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use sources::{Source, files_below, name_below, sources};
use uses::Crate;

/// Uses of a module below one's own that are allowed, as "file uses module": none.
const UPWARD: &[&str] = &[];

/// Where files may be read or written: importers, and the formats of results.
const FILES: &[&str] = &["scene/", "export/"];

/// The one file with `unsafe` code.
const UNSAFE: &[&str] = &["simd.rs"];

/// Most lines of code in a file, and in half of all files.
const LONGEST: usize = 500;
const MEDIAN: usize = 150;

/// Most columns of a line.
const WIDEST: usize = 100;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The sources of the library but lib.rs.
fn library() -> Vec<Source> {
    let mut sources = sources(&root().join("src"));
    sources.retain(|s| s.name != "lib.rs");
    sources
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

/// The sources of a module of lib.rs that have one of `words` in them.
fn mentions(sources: &[Source], module: &str, forbidden: &[&str]) -> Vec<String> {
    assert!(sources.iter().any(|s| s.module() == module), "there is no module {module}");
    sources
        .iter()
        .filter(|s| s.module() == module)
        .flat_map(|s| forbidden.iter().map(move |&w| (s, w)))
        .filter(|(s, w)| s.has(w))
        .map(|(s, w)| format!("{}: {w}", s.name))
        .collect()
}

/// Fails for each of `found` that no allowance begins, and for each allowance that nothing needs.
#[track_caller]
fn allow(found: &[String], allowances: &[&str]) {
    let wrong: Vec<_> =
        found.iter().filter(|f| !allowances.iter().any(|a| f.starts_with(a))).collect();
    assert!(wrong.is_empty(), "{wrong:#?}");
    let idle: Vec<_> =
        allowances.iter().filter(|a| !found.iter().any(|f| f.starts_with(**a))).collect();
    assert!(idle.is_empty(), "nothing needs these allowances any more: {idle:#?}");
}

#[test]
fn a_module_uses_only_those_above_it() {
    let modules = modules();
    let all = Crate::new(&sources(&root().join("src")));
    assert!(all.unknown.is_empty(), "paths that lead nowhere: {:#?}", all.unknown);
    let place = |file: usize| {
        let module = all.name(file).split(['/', '.']).next();
        modules.iter().position(|m| Some(m.as_str()) == module)
    };
    let mut upward = BTreeSet::new();
    for &(from, to) in all.uses.keys().filter(|(from, _)| all.name(*from) != "lib.rs") {
        let own = place(from);
        assert!(own.is_some(), "{} belongs to no module of lib.rs", all.name(from));
        if let Some(used) = place(to).filter(|&used| Some(used) > own) {
            upward.insert(format!("{} uses {}", all.name(from), modules[used]));
        }
    }
    allow(&upward.into_iter().collect::<Vec<_>>(), UPWARD);
}

#[test]
fn no_files_use_each_other_in_a_circle() {
    let circles = Crate::new(&sources(&root().join("src"))).circles();
    let shown = circles.iter().map(|circle| {
        let way = circle.way.join("\n    ");
        format!("{}, with a shortest way round:\n    {way}\n", circle.files.join(", "))
    });
    assert!(circles.is_empty(), "{}", shown.collect::<String>());
}

#[test]
fn the_library_never_prints_exits_or_reads_the_environment() {
    const FORBIDDEN: &[&str] =
        &["print!", "println!", "eprint!", "eprintln!", "dbg!", "stdout", "stderr", "stdin"];
    let mut wrong = Vec::new();
    for source in library() {
        for word in FORBIDDEN.iter().chain(&["env::", "process::exit", "process::abort"]) {
            if source.has(word) {
                wrong.push(format!("{}: {word}", source.name));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn unsafe_code_has_one_place() {
    let found: Vec<String> =
        library().into_iter().filter(|s| s.has("unsafe")).map(|s| s.name).collect();
    allow(&found, UNSAFE);
}

#[test]
fn files_are_touched_by_importers_and_results_alone() {
    let touches = |s: &Source| ["fs", "tempfile", "OpenOptions"].iter().any(|w| s.has(w));
    let found: Vec<String> = library().into_iter().filter(touches).map(|s| s.name).collect();
    allow(&found, FILES);
}

#[test]
fn patches_visibility_and_engines_see_no_materials() {
    let sources = library();
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
        &library(),
        "solve",
        &["Engine", "Hemicube", "Draw", "wgpu", "visibility", "Geometry", "Patches"],
    );
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn files_are_short() {
    let mut lengths = Vec::new();
    for folder in ["src", "cli/src", "py/src"] {
        let sources = sources(&root().join(folder)).into_iter();
        lengths.extend(sources.map(|s| (s.lines(), format!("{folder}/{}", s.name))));
    }
    lengths.sort();
    let long = lengths.iter().filter(|l| l.0 > LONGEST);
    let long: Vec<String> = long.map(|(lines, name)| format!("{name}: {lines} lines")).collect();
    assert!(long.is_empty(), "{long:#?}");
    let median = lengths[lengths.len() / 2].0;
    assert!(median <= MEDIAN, "half of all files have {median} lines or more");
}

#[test]
fn lines_are_narrow() {
    let mut files: Vec<PathBuf> =
        ["src", "cli", "py", "tests", "examples", "benches", "docs"].map(|f| root().join(f)).into();
    files = files.iter().flat_map(|folder| files_below(folder)).collect();
    files.extend(fs::read_dir(root()).unwrap().map(|entry| entry.unwrap().path()));
    let mut wide = Vec::new();
    for file in files {
        let ending = file.extension().and_then(|e| e.to_str()).unwrap_or_default();
        if !["rs", "wgsl", "py", "pyi", "md"].contains(&ending) {
            continue;
        }
        let text = fs::read_to_string(&file).unwrap();
        let name = name_below(root(), &file);
        let lines = wide_lines(&text, ending == "md");
        wide.extend(lines.into_iter().map(|line| format!("{name}:{line}")));
    }
    wide.sort();
    assert!(wide.is_empty(), "{wide:#?}");
}

/// The numbers of lines with more than [`WIDEST`] columns; in Markdown those that can be broken:
/// not tables, nor blocks of code, nor what is short but for the targets of links.
fn wide_lines(text: &str, markdown: bool) -> Vec<usize> {
    let mut in_code = false;
    let mut wide = Vec::new();
    for (number, line) in (1..).zip(text.lines()) {
        in_code ^= line.trim_start().starts_with("```");
        let mut columns = line.chars().count();
        if markdown {
            let targets = line.split("](").skip(1).filter_map(|rest| rest.split(')').next());
            columns -= targets.map(|target| target.chars().count()).sum::<usize>();
            let fixed = in_code || line.trim_start().starts_with('|');
            columns = if fixed { 0 } else { columns };
        }
        if columns > WIDEST {
            wide.push(number);
        }
    }
    wide
}

#[test]
fn columns_are_characters_and_targets_of_links_have_none() {
    let wide = "é".repeat(WIDEST + 1);
    let text = format!(
        "{}\n{wide}\n| {wide} |\n```\n{wide}\n```\n[text]({wide}) and more\n{wide}",
        &wide[2..]
    );
    assert_eq!(wide_lines(&text, true), [2, 8]);
    assert_eq!(wide_lines(&text, false), [2, 3, 5, 7, 8]);
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
fn the_document_names_sources_that_exist() {
    let document = fs::read_to_string(root().join("ARCHITECTURE.md")).unwrap();
    let names = document.split('`').skip(1).step_by(2).filter(|name| name.ends_with(".rs"));
    let missing: Vec<&str> = names
        .filter(|n| !root().join(n).exists() && !root().join("src").join(n).exists())
        .collect();
    assert!(missing.is_empty(), "{missing:?}");
}

#[test]
fn the_documents_point_at_files_that_exist() {
    let folders = [root().to_owned(), root().join("docs")];
    let files = folders.iter().flat_map(|folder| fs::read_dir(folder).unwrap());
    let files = files.map(|entry| entry.unwrap().path());
    let mut found = 0;
    for path in files.filter(|path| path.extension().is_some_and(|e| e == "md")) {
        let text = fs::read_to_string(&path).unwrap();
        for target in text.split("](").skip(1).filter_map(|s| s.split([')', '#']).next()) {
            let outside = target.is_empty() || target.starts_with("http");
            let exists = outside || path.with_file_name(target).exists();
            assert!(exists, "{}: {target}", path.display());
            found += usize::from(!outside);
        }
    }
    assert!(found > 10, "the documents were not understood");
}
