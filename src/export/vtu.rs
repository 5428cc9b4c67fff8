//! Triangles with numbers on them, as ParaView reads them: an unstructured grid of VTK's XML
//! formats (`.vtu`, version 1.0; Kitware, "VTK XML Formats").
//!
//! Every array is the number of its bytes as UInt64 and its numbers, little-endian, in base64.
//! Names are field data of one number each, since not all readers know arrays of strings.

use std::io::{self, Write};
use std::path::Path;

use base64::engine::general_purpose::STANDARD;
use base64::write::EncoderWriter;
use glam::DVec3;

use super::ExportError;
use super::target::write_with;

/// A number for each triangle.
#[derive(Debug, Clone, Copy)]
pub struct CellArray<'a> {
    /// Its name, without a unit; control characters become spaces.
    pub name: &'a str,
    /// One value a triangle.
    pub values: CellValues<'a>,
}

/// The numbers of an array.
#[derive(Debug, Clone, Copy)]
pub enum CellValues<'a> {
    /// Float64; NaN where there is none.
    Numbers(&'a [f64]),
    /// Int32: numbers of things; -1 where there is none.
    Indices(&'a [i32]),
}

impl CellValues<'_> {
    fn len(&self) -> usize {
        match self {
            Self::Numbers(values) => values.len(),
            Self::Indices(values) => values.len(),
        }
    }
}

/// The shape of a cell: VTK_TRIANGLE.
const TRIANGLE: u8 = 5;

/// Writes `triangles`, indices in `points` (m), with arrays of one value each; readers show the
/// first of the arrays at first. `names` says which index stands for what, each name once: it
/// becomes field data, an array of one number a name.
///
/// # Errors
/// If an array has not one value a triangle, a triangle has a point that does not exist, or the
/// system refuses.
pub fn write_vtu(
    path: &Path,
    points: &[DVec3],
    triangles: &[[u32; 3]],
    arrays: &[CellArray<'_>],
    names: &[(&str, i32)],
) -> Result<(), ExportError> {
    let failure = |message| ExportError::Encode { path: path.to_owned(), message };
    if let Some(array) = arrays.iter().find(|a| a.values.len() != triangles.len()) {
        let (name, count, cells) = (array.name, array.values.len(), triangles.len());
        return Err(failure(format!("array {name} has {count} values for {cells} triangles")));
    }
    if let Some(wrong) = triangles.as_flattened().iter().find(|&&p| p as usize >= points.len()) {
        return Err(failure(format!("point {wrong} does not exist: there are {}", points.len())));
    }
    write_with(path, |file| write(file, points, triangles, arrays, names))
}

fn write(
    file: &mut dyn Write,
    points: &[DVec3],
    triangles: &[[u32; 3]],
    arrays: &[CellArray<'_>],
    names: &[(&str, i32)],
) -> io::Result<()> {
    let cells = triangles.len();
    writeln!(file, "<?xml version=\"1.0\" encoding=\"UTF-8\"?>")?;
    writeln!(
        file,
        "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" \
         header_type=\"UInt64\">\n<UnstructuredGrid>\n<FieldData>"
    )?;
    for (name, index) in names {
        let one = format!("{} NumberOfTuples=\"1\"", attribute("Name", name));
        data_array(file, "Int32", &one, 1, [index.to_le_bytes()])?;
    }
    writeln!(file, "</FieldData>")?;
    writeln!(file, "<Piece NumberOfPoints=\"{}\" NumberOfCells=\"{cells}\">", points.len())?;
    let shown = arrays.first().map_or(String::new(), |a| attribute("Scalars", a.name));
    writeln!(file, "<CellData{shown}>")?;
    for array in arrays {
        let name = attribute("Name", array.name);
        match array.values {
            CellValues::Numbers(values) => {
                let bytes = values.iter().map(|v| v.to_le_bytes());
                data_array(file, "Float64", &name, cells, bytes)?;
            }
            CellValues::Indices(values) => {
                let bytes = values.iter().map(|v| v.to_le_bytes());
                data_array(file, "Int32", &name, cells, bytes)?;
            }
        }
    }
    writeln!(file, "</CellData>\n<Points>")?;
    let places = points.iter().flat_map(|p| p.to_array()).map(f64::to_le_bytes);
    let three = " Name=\"Points\" NumberOfComponents=\"3\"";
    data_array(file, "Float64", three, 3 * points.len(), places)?;
    writeln!(file, "</Points>\n<Cells>")?;
    let corners = triangles.as_flattened().iter().map(|&p| i64::from(p).to_le_bytes());
    data_array(file, "Int64", " Name=\"connectivity\"", 3 * cells, corners)?;
    let ends = (1..=cells).map(|k| (3 * k as i64).to_le_bytes());
    data_array(file, "Int64", " Name=\"offsets\"", cells, ends)?;
    let shapes = std::iter::repeat_n([TRIANGLE], cells);
    data_array(file, "UInt8", " Name=\"types\"", cells, shapes)?;
    writeln!(file, "</Cells>\n</Piece>\n</UnstructuredGrid>\n</VTKFile>")
}

/// Writes `count` numbers of `N` bytes each.
fn data_array<const N: usize>(
    file: &mut dyn Write,
    kind: &str,
    attributes: &str,
    count: usize,
    numbers: impl IntoIterator<Item = [u8; N]>,
) -> io::Result<()> {
    write!(file, "<DataArray type=\"{kind}\"{attributes} format=\"binary\">")?;
    let mut encoder = EncoderWriter::new(&mut *file, &STANDARD);
    encoder.write_all(&((count * N) as u64).to_le_bytes())?;
    for number in numbers {
        encoder.write_all(&number)?;
    }
    encoder.finish()?;
    drop(encoder);
    writeln!(file, "</DataArray>")
}

/// An attribute of an element, with the space before it. What XML cannot hold becomes a space.
fn attribute(name: &str, text: &str) -> String {
    let mut value = String::new();
    for c in text.chars() {
        match c {
            '&' => value += "&amp;",
            '<' => value += "&lt;",
            '>' => value += "&gt;",
            '"' => value += "&quot;",
            '\u{fffe}' | '\u{ffff}' => value.push(' '),
            c if c.is_control() => value.push(' '),
            c => value.push(c),
        }
    }
    format!(" {name}=\"{value}\"")
}

#[cfg(test)]
mod tests {
    use base64::Engine;

    use super::*;

    const POINTS: [DVec3; 4] = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::new(0.1, -2.0, 3.0)];
    const TRIANGLES: [[u32; 3]; 2] = [[0, 1, 2], [2, 1, 3]];

    fn written(arrays: &[CellArray<'_>], names: &[(&str, i32)]) -> String {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.vtu");
        write_vtu(&path, &POINTS, &TRIANGLES, arrays, names).unwrap();
        std::fs::read_to_string(path).unwrap()
    }

    /// The kind of the array whose element has this name, and its bytes behind their number.
    fn array(text: &str, name: &str) -> (String, Vec<u8>) {
        let line = text
            .lines()
            .find(|line| {
                line.starts_with("<DataArray") && line.contains(&format!(" Name=\"{name}\""))
            })
            .unwrap();
        let data = line.split_once('>').unwrap().1.strip_suffix("</DataArray>").unwrap();
        let mut bytes = STANDARD.decode(data).unwrap();
        let numbers = bytes.split_off(8);
        assert_eq!(u64::from_le_bytes(bytes.try_into().unwrap()), numbers.len() as u64, "{name}");
        (line.split('"').nth(1).unwrap().to_owned(), numbers)
    }

    fn doubles(bytes: &[u8]) -> Vec<f64> {
        bytes.as_chunks::<8>().0.iter().map(|b| f64::from_le_bytes(*b)).collect()
    }

    fn longs(bytes: &[u8]) -> Vec<i64> {
        bytes.as_chunks::<8>().0.iter().map(|b| i64::from_le_bytes(*b)).collect()
    }

    #[test]
    fn triangles_and_numbers_are_as_given() {
        let arrays = [
            CellArray { name: "T", values: CellValues::Numbers(&[293.15, f64::NAN]) },
            CellArray { name: "row", values: CellValues::Indices(&[7, -1]) },
        ];
        let text = written(&arrays, &[("floor", 0), ("wall", 1)]);
        assert!(text.contains("<Piece NumberOfPoints=\"4\" NumberOfCells=\"2\">"), "{text}");
        assert!(text.contains("<CellData Scalars=\"T\">"), "the first is shown: {text}");
        let (kind, numbers) = array(&text, "T");
        assert_eq!((&*kind, doubles(&numbers)[0]), ("Float64", 293.15));
        assert!(doubles(&numbers)[1].is_nan());
        assert_eq!(array(&text, "row"), ("Int32".into(), [7, 0, 0, 0, 255, 255, 255, 255].into()));
        assert_eq!(array(&text, "wall"), ("Int32".into(), [1, 0, 0, 0].into()));
        let flat: Vec<f64> = POINTS.iter().flat_map(|p| p.to_array()).collect();
        assert_eq!(doubles(&array(&text, "Points").1), flat);
        assert_eq!(longs(&array(&text, "connectivity").1), [0, 1, 2, 2, 1, 3]);
        assert_eq!(longs(&array(&text, "offsets").1), [3, 6]);
        assert_eq!(array(&text, "types"), ("UInt8".into(), [5, 5].into()));
    }

    #[test]
    fn any_name_and_an_empty_model_make_a_document() {
        let name = "a<b> & \"c\"\n\u{1}\u{ffff}é";
        let text = written(&[], &[(name, 3)]);
        assert!(text.contains(" Name=\"a&lt;b&gt; &amp; &quot;c&quot;   é\""), "{text}");
        let mut bytes = Vec::new();
        write(&mut bytes, &[], &[], &[], &[]).unwrap();
        let text = String::from_utf8(bytes).unwrap();
        assert!(array(&text, "connectivity").1.is_empty());
    }

    #[test]
    fn what_does_not_fit_together_is_refused_and_nothing_written() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.vtu");
        let short = [CellArray { name: "T", values: CellValues::Numbers(&[1.0]) }];
        let error = write_vtu(&path, &POINTS, &TRIANGLES, &short, &[]).unwrap_err().to_string();
        assert!(error.contains("array T has 1 values for 2 triangles"), "{error}");
        let error = write_vtu(&path, &POINTS[..3], &TRIANGLES, &[], &[]).unwrap_err().to_string();
        assert!(error.contains("point 3 does not exist: there are 3"), "{error}");
        assert!(!path.exists());
    }
}
