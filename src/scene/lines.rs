//! Statements of a text file, such as OBJ, MTL and STL: logical lines without comments.

use std::borrow::Cow;

use glam::DVec3;

use super::shortened::shortened;
use super::source::{ImportError, Place, Source};

/// A statement: a keyword and what follows it on the same logical line.
pub struct Statement<'a> {
    /// Line on which it begins, counted from 1.
    pub line: usize,
    /// The first word.
    pub keyword: &'a str,
    /// Everything after it, without surrounding blanks.
    pub rest: &'a str,
}

impl<'a> Statement<'a> {
    /// The words after the keyword.
    pub fn words(&self) -> impl Iterator<Item = &'a str> + use<'a> {
        self.rest.split_ascii_whitespace()
    }
}

/// Calls `each` for every statement. Bytes that are not UTF-8 are replaced.
pub fn statements(
    bytes: &[u8],
    mut each: impl FnMut(Statement<'_>) -> Result<(), ImportError>,
) -> Result<(), ImportError> {
    let bytes = &*utf8(bytes);
    let mut joined = Vec::new();
    let mut first = 1;
    for (i, line) in bytes.split(|&b| b == b'\n').enumerate() {
        let line = line.strip_suffix(b"\r").unwrap_or(line);
        // A comment's backslash continues nothing.
        let code = &line[..comment(line)];
        if joined.is_empty() {
            first = i + 1;
        }
        if let Some(part) = code.strip_suffix(b"\\").filter(|_| code.len() == line.len()) {
            joined.extend_from_slice(part);
            joined.push(b' ');
            continue;
        }
        if joined.is_empty() {
            statement(first, code, &mut each)?;
        } else {
            joined.extend_from_slice(code);
            statement(first, &joined, &mut each)?;
            joined.clear();
        }
    }
    statement(first, &joined, &mut each)
}

/// A text without its byte order mark, which may say that it is in UTF-16.
pub fn utf8(bytes: &[u8]) -> Cow<'_, [u8]> {
    let wide = |bytes: &[u8], unit: fn([u8; 2]) -> u16| {
        let units = bytes.as_chunks().0.iter().map(|&pair| unit(pair));
        let text: String =
            char::decode_utf16(units).map(|c| c.unwrap_or(char::REPLACEMENT_CHARACTER)).collect();
        Cow::Owned(text.into_bytes())
    };
    match bytes {
        [0xef, 0xbb, 0xbf, rest @ ..] => Cow::Borrowed(rest),
        [0xff, 0xfe, rest @ ..] => wide(rest, u16::from_le_bytes),
        [0xfe, 0xff, rest @ ..] => wide(rest, u16::from_be_bytes),
        _ => Cow::Borrowed(bytes),
    }
}

/// Where a line's comment begins: a `#` inside a word belongs to a name.
fn comment(line: &[u8]) -> usize {
    let begins = |i: usize| line[i] == b'#' && (i == 0 || line[i - 1].is_ascii_whitespace());
    (0..line.len()).find(|&i| begins(i)).unwrap_or(line.len())
}

fn statement(
    line: usize,
    code: &[u8],
    each: &mut impl FnMut(Statement<'_>) -> Result<(), ImportError>,
) -> Result<(), ImportError> {
    let text = String::from_utf8_lossy(code);
    let text = text.trim();
    if text.is_empty() {
        return Ok(());
    }
    let (keyword, rest) = text.split_once(char::is_whitespace).unwrap_or((text, ""));
    each(Statement { line, keyword, rest: rest.trim() })
}

/// A finite number, or an error that names the line.
pub fn number(source: &Source<'_>, line: usize, word: &str) -> Result<f64, ImportError> {
    match word.parse::<f64>() {
        Ok(x) if x.is_finite() => Ok(x),
        _ => Err(source.malformed(
            Place::Line(line),
            format!("`{}` is not a finite number", shortened(word)),
            "correct the line, or export the model again",
        )),
    }
}

/// The first three words as numbers.
pub fn vector(source: &Source<'_>, s: &Statement<'_>) -> Result<DVec3, ImportError> {
    let mut words = s.words();
    let mut xyz = [0.0; 3];
    for x in &mut xyz {
        let Some(word) = words.next() else {
            return Err(source.malformed(
                Place::Line(s.line),
                format!("`{}` needs three numbers", s.keyword),
                "correct the line, or export the model again",
            ));
        };
        *x = number(source, s.line, word)?;
    }
    Ok(xyz.into())
}

/// A number for a message: some have 300 digits.
pub fn shown(x: f64) -> String {
    if x == 0.0 || (1e-6..1e15).contains(&x.abs()) { format!("{x}") } else { format!("{x:e}") }
}
