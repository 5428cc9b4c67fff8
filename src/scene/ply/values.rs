//! The numbers of a PLY file, one after the other.

use super::header::{Element, Form, Header, Kind};
use crate::scene::lines::shown;
use crate::scene::shortened::shortened;
use crate::scene::source::{EXPORT_AGAIN, ImportError, Place, Source};

/// Reads numbers and knows where it stands.
pub struct Values<'a> {
    source: &'a Source<'a>,
    form: Form,
    rest: &'a [u8],
    /// Of text: the line being read, and its number.
    line: &'a [u8],
    number: usize,
    item: String,
}

impl<'a> Values<'a> {
    /// At the first number after the header.
    pub fn new(source: &'a Source<'a>, header: &Header) -> Self {
        let rest = &source.bytes[header.end..];
        Self {
            source,
            form: header.form,
            rest,
            line: &[],
            number: header.lines,
            item: String::new(),
        }
    }

    /// The next item begins: in text, on a line of its own.
    pub fn begin(&mut self, element: &Element, item: u64) {
        if self.form != Form::Ascii {
            self.item.clear();
            self.item.push_str(&element.name);
            self.item.push_str(&format!(" {item}"));
            return;
        }
        while self.line.trim_ascii().is_empty() && !self.rest.is_empty() {
            let end =
                self.rest.iter().position(|&b| b == b'\n').map_or(self.rest.len(), |at| at + 1);
            (self.line, self.rest) = self.rest.split_at(end);
            self.number += 1;
        }
    }

    /// The item ends: in text, with its line.
    pub fn end(&mut self) -> Result<(), ImportError> {
        if !self.line.trim_ascii().is_empty() {
            return Err(self.wrong("there are more numbers than the header says"));
        }
        Ok(())
    }

    /// The item being read.
    pub fn place(&self) -> Place {
        match self.form {
            Form::Ascii => Place::Line(self.number),
            _ => Place::Element(self.item.clone()),
        }
    }

    /// Something is wrong with the item being read.
    pub fn wrong(&self, problem: impl Into<String>) -> ImportError {
        self.source.malformed(self.place(), problem, EXPORT_AGAIN)
    }

    /// The length of a list.
    pub fn count(&mut self, kind: Kind) -> Result<u64, ImportError> {
        let count = self.number(kind)?;
        if count < 0.0 || count.fract() != 0.0 {
            return Err(self.wrong(format!("{} is not the length of a list", shown(count))));
        }
        Ok(count as u64)
    }

    /// The next number.
    pub fn number(&mut self, kind: Kind) -> Result<f64, ImportError> {
        match self.form {
            Form::Ascii => self.word(),
            Form::LittleEndian | Form::BigEndian => Ok(match kind {
                Kind::I8 => i8::from_le_bytes(self.bytes()?).into(),
                Kind::U8 => u8::from_le_bytes(self.bytes()?).into(),
                Kind::I16 => i16::from_le_bytes(self.bytes()?).into(),
                Kind::U16 => u16::from_le_bytes(self.bytes()?).into(),
                Kind::I32 => i32::from_le_bytes(self.bytes()?).into(),
                Kind::U32 => u32::from_le_bytes(self.bytes()?).into(),
                Kind::F32 => f32::from_le_bytes(self.bytes()?).into(),
                Kind::F64 => f64::from_le_bytes(self.bytes()?),
            }),
        }
    }

    /// The next word of the line as a number.
    fn word(&mut self) -> Result<f64, ImportError> {
        let line = self.line.trim_ascii_start();
        if line.is_empty() {
            let cut = if self.rest.is_empty() { ": the file is cut off" } else { "" };
            return Err(self.wrong(format!("there are fewer numbers than the header says{cut}")));
        }
        let end = line.iter().position(u8::is_ascii_whitespace).unwrap_or(line.len());
        let (word, rest) = line.split_at(end);
        self.line = rest;
        let word = String::from_utf8_lossy(word);
        word.parse().map_err(|_| self.wrong(format!("`{}` is not a number", shortened(&word))))
    }

    /// The next bytes, little end first.
    fn bytes<const N: usize>(&mut self) -> Result<[u8; N], ImportError> {
        let Some((bytes, rest)) = self.rest.split_first_chunk::<N>() else {
            return Err(self.wrong("the file ends here: it is cut off"));
        };
        self.rest = rest;
        let mut bytes = *bytes;
        if self.form == Form::BigEndian {
            bytes.reverse();
        }
        Ok(bytes)
    }
}
