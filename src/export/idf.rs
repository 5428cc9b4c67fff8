//! View factors as EnergyPlus reads them (`.idf`): one object
//! `ZoneProperty:UserViewFactors:BySurfaceName` with the factor of each pair of named surfaces.
//!
//! Fields are those of the Input Data Dictionary of EnergyPlus: the zone, then from, to and
//! F(from, to) of each pair, zeros too. A field ends at `,` or `;`, a comment begins at `!`, a
//! factor is at most 1, and names are compared without case.

use std::collections::HashMap;
use std::io::Write;
use std::path::Path;

use thiserror::Error;

use super::ExportError;
use super::csv::push_number;
use super::npy::encode_rows;
use super::target::write_with;
use crate::matrix::{Origin, Rows};
use crate::progress::Progress;

/// Why a zone or surfaces of these names cannot be written.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum IdfNameError {
    /// A name that a field cannot hold.
    #[error("EnergyPlus reads no name like '{name}': {why}")]
    Unfit {
        /// The name.
        name: String,
        /// What is wrong with it.
        why: &'static str,
    },
    /// Two names that are one.
    #[error(
        "'{0}' and '{1}' are one name to EnergyPlus, which does not know lower from upper case"
    )]
    Same(String, String),
}

/// Longest name, in bytes; of ASCII, so many characters.
const LONGEST: usize = 100;

/// Whether a field can hold a name.
///
/// # Errors
/// What is wrong with it.
pub fn check_idf_name(name: &str) -> Result<(), IdfNameError> {
    let why = if name.trim().is_empty() {
        "it is empty"
    } else if name.contains([',', ';', '!']) {
        "it has a comma, a semicolon or an exclamation mark"
    } else if name.contains(char::is_control) {
        "it has a tab or another control character"
    } else if name.len() > LONGEST {
        "it is longer than 100 characters"
    } else {
        return Ok(());
    };
    Err(IdfNameError::Unfit { name: name.to_owned(), why })
}

/// Whether surfaces of these names can stand in one object.
///
/// # Errors
/// The first name that a field cannot hold, or that is another's.
pub fn check_idf_names<'a>(names: impl IntoIterator<Item = &'a str>) -> Result<(), IdfNameError> {
    let mut seen: HashMap<String, &str> = HashMap::new();
    for name in names {
        check_idf_name(name)?;
        if let Some(other) = seen.insert(name.trim().to_ascii_lowercase(), name) {
            return Err(IdfNameError::Same(other.to_owned(), name.to_owned()));
        }
    }
    Ok(())
}

/// Writes a matrix of named surfaces as the view factors of a zone. Advances `progress` by one a
/// row.
///
/// # Errors
/// If rows are not lumped to names, a name cannot be written, the system refuses, or the caller
/// cancelled.
pub fn write_idf<R: Rows + ?Sized>(
    path: &Path,
    rows: &R,
    zone: &str,
    origin: &Origin,
    progress: &dyn Progress,
) -> Result<(), ExportError> {
    let failure = |message| ExportError::Encode { path: path.to_owned(), message };
    if !origin.lumped {
        return Err(failure("its surfaces need names, and rows are faces of the model".into()));
    }
    let names: Vec<String> = (0..rows.len()).map(|i| rows.label(i)).collect();
    check_idf_name(zone)
        .and_then(|()| check_idf_names(names.iter().map(String::as_str)))
        .map_err(|e| failure(e.to_string()))?;
    let names: Vec<&str> = names.iter().map(|name| name.trim()).collect();
    let (last, precision) = (rows.len().saturating_sub(1), rows.precision());
    write_with(path, |file| {
        writeln!(file, "! view factors, geometry {}", origin.fingerprint)?;
        writeln!(file, "ZoneProperty:UserViewFactors:BySurfaceName,")?;
        let end = if names.is_empty() { ';' } else { ',' };
        writeln!(file, "  {}{end}  !- Zone Name", zone.trim())?;
        encode_rows(rows, file, progress, |i, columns, values, bytes| {
            let mut entries = columns.iter().zip(values).peekable();
            for (j, to) in names.iter().enumerate() {
                let factor = entries.next_if(|e| *e.0 as usize == j).map_or(0.0, |e| *e.1);
                bytes.extend(format!("  {},{to},", names[i]).into_bytes());
                // Rounding may leave a little more than 1, which is refused.
                push_number(bytes, factor.min(1.0), precision);
                bytes.extend(if (i, j) == (last, last) { b";\n" } else { b",\n" });
            }
        })
    })
}

#[cfg(test)]
mod tests {
    use std::io;

    use super::*;
    use crate::matrix::{Precision, SurfaceRow};
    use crate::progress::Silent;
    use crate::scene::Geometry;

    struct Pair([&'static str; 2]);

    impl Rows for Pair {
        fn len(&self) -> usize {
            2
        }
        fn entries(&self) -> u64 {
            3
        }
        fn precision(&self) -> Precision {
            Precision::Double
        }
        fn row(&self, i: usize, columns: &mut Vec<u32>, values: &mut Vec<f64>) -> io::Result<()> {
            (*columns, *values) = match i {
                0 => (vec![1], vec![1.0 + 1e-12]),
                _ => (vec![0, 1], vec![0.25, 3.5e-5]),
            };
            Ok(())
        }
        fn label(&self, i: usize) -> String {
            self.0[i].to_owned()
        }
        fn surfaces(&self, _: &Geometry) -> Vec<SurfaceRow> {
            Vec::new()
        }
        fn rest(&self, _: usize) -> [f64; 2] {
            [0.0; 2]
        }
    }

    fn written(names: [&'static str; 2], zone: &str, lumped: bool) -> Result<String, String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("zone.idf");
        let origin = Origin { lumped, fingerprint: "abc".into(), ..Origin::default() };
        match write_idf(&path, &Pair(names), zone, &origin, &Silent) {
            Ok(()) => Ok(std::fs::read_to_string(path).unwrap()),
            Err(e) => {
                assert!(!path.exists());
                Err(e.to_string())
            }
        }
    }

    #[test]
    fn all_pairs_have_a_factor_of_at_most_one() {
        let text = written(["floor", "West wall"], "ZONE 1", true).unwrap();
        let whole = "! view factors, geometry abc\n\
            ZoneProperty:UserViewFactors:BySurfaceName,\n  ZONE 1,  !- Zone Name\n  \
            floor,floor,0,\n  floor,West wall,1,\n  West wall,floor,0.25,\n  \
            West wall,West wall,3.5e-5;\n";
        assert_eq!(text, whole);
    }

    #[test]
    fn names_that_would_be_read_as_others_are_refused() {
        let long = "x".repeat(101);
        for (name, why) in [
            ("a,b", "comma"),
            ("a;b", "semicolon"),
            ("a!", "exclamation mark"),
            (" ", "empty"),
            ("a\tb", "tab"),
            (&*long, "longer than 100"),
        ] {
            let error = check_idf_names(["floor", name]).unwrap_err().to_string();
            assert!(error.contains(why) && error.contains(name), "{error}");
            assert!(written(["a", "b"], name, true).unwrap_err().contains(why));
        }
        assert_eq!(check_idf_name(&long[1..]), Ok(()));
        let error = written(["Wall", "wall "], "z", true).unwrap_err();
        assert!(error.contains("'Wall' and 'wall '"), "{error}");
        assert!(written(["0", "1"], "z", false).unwrap_err().contains("need names"));
    }
}
