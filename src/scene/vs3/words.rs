//! Lines and words of a View3D file.

use crate::scene::lines::number;
use crate::scene::shortened::shortened;
use crate::scene::source::{ImportError, Place, Source};

/// Blanks, tabs and commas part words; a carriage return is left from the end of a line.
fn parts(c: char) -> bool {
    c.is_ascii_whitespace() || c == ',' || c == '\0'
}

/// The rest of a line, which is taken word by word.
#[derive(Debug, Clone, Copy)]
pub struct Words<'a> {
    /// Number of the line, from 1.
    pub line: usize,
    rest: &'a str,
}

impl<'a> Words<'a> {
    /// The next word.
    pub fn next(&mut self) -> Option<&'a str> {
        let text = self.rest.trim_start_matches(parts);
        let end = text.find(parts).unwrap_or(text.len());
        let word;
        (word, self.rest) = text.split_at(end);
        (!word.is_empty()).then_some(word)
    }

    /// All that is left, without what parts words at its ends.
    pub fn rest(self) -> &'a str {
        self.rest.trim_matches(parts)
    }

    /// An error in this line.
    pub fn wrong(&self, source: &Source<'_>, problem: String, remedy: &str) -> ImportError {
        source.malformed(Place::Line(self.line), problem, remedy)
    }

    /// The next word as a finite number; `what` says what it stands for.
    pub fn number(
        &mut self,
        source: &Source<'_>,
        what: &str,
        remedy: &str,
    ) -> Result<f64, ImportError> {
        match self.next() {
            Some(word) => number(source, self.line, word),
            None => Err(self.wrong(source, format!("{what} is missing"), remedy)),
        }
    }

    /// The next word as a whole number from 0.
    pub fn whole(
        &mut self,
        source: &Source<'_>,
        what: &str,
        remedy: &str,
    ) -> Result<usize, ImportError> {
        let Some(word) = self.next() else {
            return Err(self.wrong(source, format!("{what} is missing"), remedy));
        };
        word.parse::<u32>().map(|n| n as usize).map_err(|_| {
            let problem = format!("{what} is to be a whole number, not `{}`", shortened(word));
            self.wrong(source, problem, remedy)
        })
    }
}

/// The lines that are neither blank nor all comment. A `!` that begins a word begins a comment.
pub fn lines(text: &str) -> impl Iterator<Item = Words<'_>> {
    (1..).zip(text.split('\n')).filter_map(|(line, text)| {
        let begins = |&(i, _): &(usize, &str)| text[..i].chars().next_back().is_none_or(parts);
        let end = text.match_indices('!').find(begins).map_or(text.len(), |(i, _)| i);
        let rest = text[..end].trim_matches(parts);
        (!rest.is_empty()).then_some(Words { line, rest })
    })
}
