//! A file as a module: what it defines and imports, and the paths in its code.

use std::collections::{BTreeMap, BTreeSet};

use crate::sources::{Source, Token};

/// A file as a module: what can be found in it.
#[derive(Default)]
pub struct Module {
    pub name: String,
    pub parent: Option<usize>,
    pub children: BTreeMap<String, usize>,
    pub defined: BTreeSet<String>,
    pub imports: Vec<Import>,
    /// Paths in code, a single name being one too.
    pub paths: Vec<Vec<String>>,
}

/// One name of a `use`.
pub struct Import {
    pub path: Vec<String>,
    /// By which it is known here; `*` for all names.
    pub alias: String,
    pub public: bool,
}

impl Module {
    pub fn read(source: &Source) -> Self {
        const ITEMS: &[&str] =
            &["struct", "enum", "fn", "trait", "type", "const", "static", "union"];
        let mut module = Self { name: source.name.clone(), ..Self::default() };
        let code = &source.code;
        let text = |at: usize| code.get(at).map_or("", |t| t.text.as_str());
        // For each open brace, whether items within it belong to the file.
        let mut braces: Vec<bool> = Vec::new();
        let mut at = 0;
        while at < code.len() {
            let outside = braces.iter().all(|&open| open);
            let next_is_word = code.get(at + 1).is_some_and(Token::is_word);
            match text(at) {
                // What a macro is called with may hold items.
                "{" => braces.push(outside && at > 0 && code[at - 1].is("!")),
                "}" => drop(braces.pop()),
                "use" if text(at + 1) != "<" => {
                    let public = at > 0 && (code[at - 1].is("pub") || code[at - 1].is(")"));
                    let mut names = Vec::new();
                    at = read_use(code, at + 1, &[], &mut names);
                    let imports = names.into_iter().map(|(path, alias)| (path, alias, public));
                    module.imports.extend(imports.map(|(path, alias, public)| Import {
                        path,
                        alias,
                        public,
                    }));
                    continue;
                }
                "mod" if outside => {
                    assert!(text(at + 2) == ";", "{}: a module within a file", module.name);
                    at += 2;
                }
                "macro_rules" => {
                    module.defined.insert(text(at + 2).to_owned());
                    at += 2;
                }
                item if outside && ITEMS.contains(&item) && next_is_word => {
                    module.defined.insert(text(at + 1).to_owned());
                }
                _ if code[at].is_word() => {
                    at = module.read_path(code, at);
                    continue;
                }
                _ => {}
            }
            at += 1;
        }
        // A name alone is a path only if it is re-exported here: all others are imported anyway.
        let public: BTreeSet<&String> =
            module.imports.iter().filter(|i| i.public).map(|i| &i.alias).collect();
        module.paths.retain(|p| p.len() > 1 || public.contains(&p[0]));
        module
    }

    /// Reads the path that begins with the word at `from`; yields where it ends.
    fn read_path(&mut self, code: &[Token], from: usize) -> usize {
        let is = |at: usize, text: &str| code.get(at).is_some_and(|t| t.is(text));
        let before = |text: &str| from > 0 && code[from - 1].is(text);
        let mut path = vec![code[from].text.clone()];
        let mut end = from + 1;
        while is(end, "::") && code.get(end + 1).is_some_and(Token::is_word) {
            path.push(code[end + 1].text.clone());
            end += 2;
        }
        // A name alone may be that of a value or a field, unless it is a type or called.
        let called = ["(", "!", "::"].iter().any(|mark| is(end, mark));
        let named = called || path[0].starts_with(char::is_uppercase);
        if !before(".") && !before("::") && !before("fn") && (path.len() > 1 || named) {
            self.paths.push(path);
        }
        end
    }
}

/// Reads a tree of a `use` after `prefix`; yields where it ends, a `;` included.
fn read_use(
    code: &[Token],
    mut at: usize,
    prefix: &[String],
    names: &mut Vec<(Vec<String>, String)>,
) -> usize {
    let mut path = prefix.to_vec();
    // A path of another crate.
    if code[at].is("::") {
        path.push(String::new());
        at += 1;
    }
    loop {
        match code[at].text.as_str() {
            "{" => {
                at += 1;
                while !code[at].is("}") {
                    at = read_use(code, at, &path, names);
                    at += usize::from(code[at].is(","));
                }
                at += 1;
                break;
            }
            "*" => {
                names.push((path, "*".to_owned()));
                at += 1;
                break;
            }
            name => {
                if name != "self" || path.is_empty() {
                    path.push(name.to_owned());
                }
                at += 1;
                if code[at].is("::") {
                    at += 1;
                    continue;
                }
                let mut alias = path.last().cloned().unwrap_or_default();
                if code[at].is("as") {
                    alias = code[at + 1].text.clone();
                    at += 2;
                }
                names.push((path, alias));
                break;
            }
        }
    }
    at + usize::from(prefix.is_empty() && code[at].is(";"))
}
