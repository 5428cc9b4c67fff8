//! The sources of a crate as words: without comments and without their unit tests.

use std::fs;
use std::path::Path;

/// A file of a crate.
pub struct Source {
    /// Below the crate's `src`, with `/`.
    pub name: String,
    pub code: Vec<Token>,
}

/// A word, a literal or a mark of Rust; `::` is one mark.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Token {
    pub text: String,
    /// Where it begins, from 0.
    pub line: usize,
}

impl Token {
    pub fn is(&self, text: &str) -> bool {
        self.text == text
    }

    /// Whether it is a name or a keyword.
    pub fn is_word(&self) -> bool {
        self.text.starts_with(begins_word)
    }
}

impl Source {
    /// Reads a file without its unit tests.
    pub fn new(name: &str, text: &str) -> Self {
        Self { name: name.to_owned(), code: without_tests(tokens(text)) }
    }

    /// The module of the crate's root that it belongs to.
    pub fn module(&self) -> &str {
        self.name.split(['/', '.']).next().unwrap_or_default()
    }

    /// Whether a word, or several with marks between them (`std::env`), stands in the code.
    pub fn has(&self, words: &str) -> bool {
        let words = tokens(words);
        let alike = |part: &[Token]| part.iter().zip(&words).all(|(a, b)| a.text == b.text);
        self.code.windows(words.len()).any(alike)
    }

    /// Lines of code: not those that are blank, a comment or a unit test.
    pub fn lines(&self) -> usize {
        let mut lines = Vec::new();
        for token in &self.code {
            lines.extend(token.line..=token.line + token.text.matches('\n').count());
        }
        lines.dedup();
        lines.len()
    }
}

/// All files of a crate's `src` but those of unit tests, by name.
pub fn sources(src: &Path) -> Vec<Source> {
    let mut found: Vec<Source> = files_below(src)
        .into_iter()
        .map(|path| (name_below(src, &path), path))
        .filter(|(name, _)| name.ends_with(".rs") && !name.ends_with("tests.rs"))
        .map(|(name, path)| Source::new(&name, &fs::read_to_string(path).unwrap()))
        .collect();
    found.sort_by(|a, b| a.name.cmp(&b.name));
    assert!(found.len() > 5, "the sources were not found");
    found
}

/// All files in a folder and the folders in it, in no order; none if there is no such folder.
pub fn files_below(folder: &Path) -> Vec<std::path::PathBuf> {
    let mut folders = vec![folder.to_owned()];
    let mut files = Vec::new();
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).into_iter().flatten() {
            let path = entry.unwrap().path();
            let is_ours = !path.ends_with("node_modules");
            if !path.is_dir() {
                files.push(path);
            } else if is_ours {
                folders.push(path);
            }
        }
    }
    files
}

/// The name of a file below a folder, with `/`.
pub fn name_below(folder: &Path, file: &Path) -> String {
    let parts = file.strip_prefix(folder).unwrap().iter();
    parts.map(|part| part.to_str().unwrap()).collect::<Vec<_>>().join("/")
}

fn begins_word(c: char) -> bool {
    c.is_alphabetic() || c == '_'
}

fn in_word(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

/// The words, literals and marks of a text in Rust, without comments.
pub fn tokens(text: &str) -> Vec<Token> {
    let (mut found, mut rest, mut line) = (Vec::new(), text, 0);
    while let Some(first) = rest.chars().next() {
        let length = length_of_token(rest, first);
        let (token, after) = rest.split_at(length);
        if !first.is_whitespace() && !token.starts_with("//") && !token.starts_with("/*") {
            found.push(Token { text: token.to_owned(), line });
        }
        line += token.matches('\n').count();
        rest = after;
    }
    found
}

/// How many bytes the token is long that `text` begins with; a blank or a comment counts as one.
fn length_of_token(text: &str, first: char) -> usize {
    let until = |end: &str, from: usize| {
        text[from..].find(end).map_or(text.len(), |at| from + at + end.len())
    };
    let word = |from: usize| text[from..].find(|c| !in_word(c)).map_or(text.len(), |n| from + n);
    if text.starts_with("//") {
        return text.find('\n').unwrap_or(text.len());
    }
    if text.starts_with("/*") {
        return until("*/", 2);
    }
    if let Some(raw) = text.strip_prefix('r').or_else(|| text.strip_prefix("br")) {
        let hashes = raw.len() - raw.trim_start_matches('#').len();
        if raw[hashes..].starts_with('"') {
            let from = text.len() - raw.len() + hashes + 1;
            return until(&format!("\"{}", "#".repeat(hashes)), from);
        }
    }
    let quoted = text.strip_prefix('b').unwrap_or(text);
    let prefix = text.len() - quoted.len();
    if quoted.starts_with('"') {
        return prefix + length_of_quoted(quoted, '"');
    }
    if let Some(inside) = quoted.strip_prefix('\'') {
        // A character, or else the name of a lifetime.
        let mut inside = inside.chars();
        let escaped = inside.next() == Some('\\');
        let is_char = escaped || inside.next() == Some('\'');
        return if is_char { prefix + length_of_quoted(quoted, '\'') } else { word(prefix + 1) };
    }
    match first {
        _ if in_word(first) => word(0),
        ':' if text.starts_with("::") => 2,
        _ => first.len_utf8(),
    }
}

/// How many bytes a literal between two `quote`s is long.
fn length_of_quoted(text: &str, quote: char) -> usize {
    let mut escaped = false;
    for (at, c) in text.char_indices().skip(1) {
        match c {
            _ if escaped => escaped = false,
            '\\' => escaped = true,
            _ if c == quote => return at + 1,
            _ => {}
        }
    }
    text.len()
}

/// Leaves out each item that follows `#[cfg(test)]`.
fn without_tests(tokens: Vec<Token>) -> Vec<Token> {
    const TEST: [&str; 7] = ["#", "[", "cfg", "(", "test", ")", "]"];
    let mut kept = Vec::new();
    let mut at = 0;
    while at < tokens.len() {
        let is_test = tokens.len() >= at + TEST.len()
            && tokens[at..].iter().zip(TEST).all(|(token, test)| token.is(test));
        if is_test {
            at = end_of_item(&tokens, at + TEST.len());
        } else {
            kept.push(tokens[at].clone());
            at += 1;
        }
    }
    kept
}

/// Where the item ends that begins at `from`: after its `;` or its last `}`.
fn end_of_item(tokens: &[Token], from: usize) -> usize {
    let mut depth = 0;
    for (at, token) in tokens.iter().enumerate().skip(from) {
        match token.text.as_str() {
            "{" | "(" | "[" => depth += 1,
            "}" if depth == 1 => return at + 1,
            "}" | ")" | "]" => depth -= 1,
            ";" if depth == 0 => return at + 1,
            _ => {}
        }
    }
    tokens.len()
}

#[test]
fn sources_are_read_as_words_without_comments_and_tests() {
    let source = Source::new(
        "a/b.rs",
        "use c::d; // no e\n/* nor\nf */ let g = \"h \\\" // i\";\n\n\
         let j: &'k str = r#\"l \" m\"#; let n = ['o', '\\'', b'p'];\n\
         #[cfg(test)]\nmod tests {\n    use q;\n}\n#[cfg(test)]\nmod r;\nlet s = 1.5e3;\n",
    );
    let words = |source: &Source| {
        let words = source.code.iter().filter(|t| t.is_word());
        words.filter(|t| t.text.len() == 1).map(|t| t.text.clone()).collect::<String>()
    };
    assert_eq!(words(&source), "cdgjns");
    assert!(source.has("c::d") && source.has("c") && !source.has("c::e") && !source.has("us"));
    assert_eq!(source.lines(), 4, "{:?}", source.code);
    assert_eq!(source.module(), "a");
    assert_eq!(Source::new("a.rs", "x(\"1\n2\n3\")\n\n\n4").lines(), 4);
}
