//! The header of a PLY file: what follows, and in which form.

use crate::scene::shortened::shortened;
use crate::scene::source::{EXPORT_AGAIN, ImportError, Place, Source};

/// Form of the numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Form {
    Ascii,
    LittleEndian,
    BigEndian,
}

/// Type of a number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Kind {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Kind {
    fn parse(word: &str) -> Option<Self> {
        Some(match word {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return None,
        })
    }
}

/// One number of each item, or a list of them.
pub struct Property {
    pub name: String,
    /// Type of the list's length, if it is a list.
    pub count: Option<Kind>,
    pub kind: Kind,
}

/// Items of one kind.
pub struct Element {
    pub name: String,
    pub count: u64,
    pub properties: Vec<Property>,
}

impl Element {
    pub fn place(&self) -> Place {
        Place::Element(format!("element {}", self.name))
    }
}

/// What the header says.
pub struct Header {
    pub form: Form,
    pub elements: Vec<Element>,
    /// Bytes up to the first number, and lines.
    pub end: usize,
    pub lines: usize,
}

impl Header {
    /// Reads the lines up to `end_header`.
    pub fn read(source: &Source<'_>) -> Result<Self, ImportError> {
        let (mut form, mut elements, mut end) = (None, Vec::<Element>::new(), 0);
        let lines = source.bytes.split_inclusive(|&b| b == b'\n');
        for (i, line) in lines.enumerate() {
            end += line.len();
            let text = String::from_utf8_lossy(line);
            let wrong = |problem: &str| {
                let problem = format!("`{}` {problem}", shortened(text.trim()));
                source.malformed(Place::Line(i + 1), problem, EXPORT_AGAIN)
            };
            let words: Vec<&str> = text.split_ascii_whitespace().collect();
            match words[..] {
                ["ply"] if i == 0 => {}
                _ if i == 0 => return Err(wrong("is not how a PLY file begins")),
                ["format", name, "1.0"] => {
                    form = Some(match name {
                        "ascii" => Form::Ascii,
                        "binary_little_endian" => Form::LittleEndian,
                        "binary_big_endian" => Form::BigEndian,
                        _ => return Err(wrong("is a format that is not known")),
                    });
                }
                ["element", name, count] => {
                    let count = count.parse().map_err(|_| wrong("has no count"))?;
                    elements.push(Element { name: name.into(), count, properties: Vec::new() });
                }
                ["property", ref rest @ ..] => {
                    let (Some(element), Some(property)) = (elements.last_mut(), property(rest))
                    else {
                        return Err(wrong("is no property of an element"));
                    };
                    element.properties.push(property);
                }
                ["comment" | "obj_info", ..] | [] => {}
                ["end_header"] => {
                    let form = form.ok_or_else(|| wrong("comes before any format"))?;
                    return Ok(Self { form, elements, end, lines: i + 1 });
                }
                _ => return Err(wrong("is not understood")),
            }
        }
        let problem = "the file ends before `end_header`: it is cut off, or no PLY file";
        Err(source.malformed(Place::Element("header".into()), problem, EXPORT_AGAIN))
    }
}

fn property(words: &[&str]) -> Option<Property> {
    let (count, kind, name) = match *words {
        ["list", count, kind, name] => (Some(Kind::parse(count)?), kind, name),
        [kind, name] => (None, kind, name),
        _ => return None,
    };
    Some(Property { name: name.into(), count, kind: Kind::parse(kind)? })
}
