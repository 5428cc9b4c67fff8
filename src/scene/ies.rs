//! Photometric files: the text format IES LM-63.
//!
//! A header, keywords in brackets, and from the line `TILT=` on nothing but numbers (ANSI/IESNA
//! LM-63-2002, "Standard file format for the electronic transfer of photometric data and related
//! information"; for the edition of 1991 IESNA LM-63-1991).

use std::fs;
use std::path::Path;

use super::import::{Place, SceneError, Source};
use super::photometry::Photometry;

/// Reads the photometry of a luminaire: an IES file of type C with a header of 1991 or later.
///
/// Intensities are those of the file times its multiplier and ballast factors. In relative
/// photometry they already count the flux of the lamps; nothing is scaled to it.
///
/// # Errors
/// If the file cannot be read or is broken, if it is of type A or B, or if its light depends on the
/// tilt.
pub fn read(path: &Path) -> Result<Photometry, SceneError> {
    let unreadable = |source| SceneError::Unreadable { path: path.into(), source };
    let bytes = fs::read(path).map_err(unreadable)?;
    parse(&Source { path, bytes: &bytes })
}

/// Headers, and whether their edition has a ballast-lamp photometric factor; later ones reserve its
/// place.
const HEADERS: [(&str, bool); 4] = [
    ("IESNA91", true),
    ("IESNA:LM-63-1995", false),
    ("IESNA:LM-63-2002", false),
    ("IES:LM-63-2019", false),
];

/// Intensities beyond this overflow when irradiances are squared for a residual.
const MOST_INTENSITY: f64 = 1e30;

/// Metres.
const FOOT: f64 = 0.3048;

/// What to do about a file whose numbers do not add up.
const FETCH_AGAIN: &str = "fetch the file from its manufacturer again";

fn parse(source: &Source<'_>) -> Result<Photometry, SceneError> {
    // Names of makers come in any encoding.
    let text = String::from_utf8_lossy(source.bytes);
    let mut lines = text.lines().enumerate().map(|(i, line)| (i + 1, line.trim()));
    let header = lines.next().map_or("", |(_, line)| line).trim_start_matches('\u{feff}');
    let edition = HEADERS.iter().find(|h| h.0.eq_ignore_ascii_case(header));
    let &(_, has_lamp_factor) = edition.ok_or_else(|| {
        source.malformed(
            Place::Line(1),
            format!("begins with '{}', which is no header of LM-63 since 1991", short(header)),
            format!("the first line must be one of {}", HEADERS.map(|h| h.0).join(", ")),
        )
    })?;
    let tilt = lines.find_map(|(n, line)| {
        let (key, value) = line.split_once('=')?;
        key.trim().eq_ignore_ascii_case("TILT").then(|| (n, value.trim()))
    });
    let (line, tilt) = tilt.ok_or_else(|| {
        let place = Place::Element("keywords".into());
        source.malformed(place, "are not followed by a line TILT=", FETCH_AGAIN)
    })?;
    let numbers = lines.flat_map(|(n, line)| {
        // Old systems end a file with the character 26.
        let separator = |c: char| c.is_whitespace() || c == ',' || c == '\u{1a}';
        line.split(separator).filter(|word| !word.is_empty()).map(move |word| (n, word))
    });
    let mut numbers = Numbers { source, words: numbers, line };
    match tilt.to_ascii_uppercase().as_str() {
        "NONE" => {}
        "INCLUDE" => numbers.tilt()?,
        _ => {
            return Err(numbers.wrong(
                format!("TILT={} refers to another file", short(tilt)),
                "write TILT=NONE if the light does not depend on the tilt",
            ));
        }
    }
    numbers.photometry(has_lamp_factor)
}

/// The beginning of a text of the file, for a message.
fn short(text: &str) -> String {
    const SHOWN: usize = 40;
    text.chars().take(SHOWN).collect()
}

/// The numbers of a file, one after another.
struct Numbers<'a, W> {
    source: &'a Source<'a>,
    words: W,
    /// The line of the last number, counted from 1.
    line: usize,
}

impl<'a, W: Iterator<Item = (usize, &'a str)>> Numbers<'_, W> {
    fn wrong(&self, problem: impl Into<String>, remedy: impl Into<String>) -> SceneError {
        self.source.malformed(Place::Line(self.line), problem, remedy)
    }

    /// The next number if it is `valid`, which `expected` describes.
    fn next(
        &mut self,
        what: &str,
        valid: impl FnOnce(f64) -> bool,
        expected: &str,
    ) -> Result<f64, SceneError> {
        let Some((line, word)) = self.words.next() else {
            return Err(self.wrong(format!("the file ends before {what}"), FETCH_AGAIN));
        };
        self.line = line;
        match word.parse::<f64>() {
            Ok(number) if number.is_finite() && valid(number) => Ok(number),
            _ => Err(self.wrong(
                format!("{what} is '{}'", short(word)),
                format!("it must be {expected}; {FETCH_AGAIN}"),
            )),
        }
    }

    fn number(&mut self, what: &str) -> Result<f64, SceneError> {
        self.next(what, |_| true, "a number")
    }

    fn positive(&mut self, what: &str) -> Result<f64, SceneError> {
        self.next(what, |x| x > 0.0, "a positive number")
    }

    fn count(&mut self, what: &str) -> Result<usize, SceneError> {
        let whole = |x: f64| x >= 1.0 && x <= f64::from(u16::MAX) && x.fract() == 0.0;
        Ok(self.next(what, whole, "a whole number of at least 1")? as usize)
    }

    /// Ascending angles in degrees.
    fn angles(&mut self, count: usize, what: &str) -> Result<Vec<f64>, SceneError> {
        let mut angles: Vec<f64> = Vec::new();
        for k in 1..=count {
            let name = format!("{what} angle {k} of {count}");
            let after = angles.last().copied();
            let ascends = |x| after.is_none_or(|a| x > a);
            angles.push(self.next(&name, ascends, "larger than the one before it")?);
        }
        Ok(angles)
    }

    /// Passes over how the light depends on the luminaire's tilt, provided that it does not.
    fn tilt(&mut self) -> Result<(), SceneError> {
        self.number("the geometry of lamp and luminaire")?;
        let pairs = self.count("the number of tilt angles")?;
        self.angles(pairs, "tilt")?;
        for _ in 0..pairs {
            let factor = self.number("a tilt factor")?;
            if factor != 1.0 {
                return Err(self.wrong(
                    format!("the light depends on the tilt (a factor of {factor}), which is not supported"),
                    "write TILT=NONE in place of the tilt data to leave it out of account",
                ));
            }
        }
        Ok(())
    }

    fn photometry(&mut self, has_lamp_factor: bool) -> Result<Photometry, SceneError> {
        let lamps = self.next("the number of lamps", |x| x >= 0.0, "a number of lamps")?;
        let lumens = self.next(
            "the lumens per lamp",
            |x| x >= 0.0 || x == -1.0,
            "a luminous flux, or -1 for absolute photometry",
        )?;
        let multiplier = self.positive("the candela multiplier")?;
        let vertical = self.count("the number of vertical angles")?;
        let horizontal = self.count("the number of horizontal angles")?;
        self.type_c()?;
        let unit = self.next("the unit", |x| x == 1.0 || x == 2.0, "1 (feet) or 2 (metres)")?;
        let mut opening = 0.0_f64;
        for what in ["width", "length", "height"] {
            // Negative numbers say that it is round.
            opening = opening.max(self.number(&format!("the opening's {what}"))?.abs());
        }
        let ballast = self.positive("the ballast factor")?;
        let lamp = self.number("the ballast-lamp photometric factor")?;
        if has_lamp_factor && lamp <= 0.0 {
            let problem = format!("the ballast-lamp photometric factor is {lamp}");
            return Err(self.wrong(problem, "it must be positive; 1 says nothing"));
        }
        self.number("the input power")?;
        let factors = ballast * if has_lamp_factor { lamp } else { 1.0 };
        let (vertical, horizontal) = (self.vertical(vertical)?, self.horizontal(horizontal)?);
        let candela = self.candela(&vertical, &horizontal, multiplier * factors)?;
        Ok(Photometry {
            vertical,
            horizontal,
            candela,
            rated: (lumens > 0.0).then_some(lamps * lumens * factors),
            opening: opening * if unit == 1.0 { FOOT } else { 1.0 },
        })
    }

    fn type_c(&mut self) -> Result<(), SceneError> {
        let kind = self.next(
            "the photometric type",
            |x| [1.0, 2.0, 3.0].contains(&x),
            "1 (type C), 2 (B) or 3 (A)",
        )?;
        if kind == 1.0 {
            return Ok(());
        }
        Err(self.wrong(
            format!("is photometry of type {}", if kind == 2.0 { "B" } else { "A" }),
            "only type C is read: ask the manufacturer for it, or convert the file",
        ))
    }

    fn vertical(&mut self, count: usize) -> Result<Vec<f64>, SceneError> {
        let angles = self.angles(count, "vertical")?;
        match (angles[0], angles[count - 1]) {
            (0.0, 90.0 | 180.0) | (90.0, 180.0) => Ok(angles),
            (from, to) => Err(self.wrong(
                format!("vertical angles go from {from} to {to}"),
                "they must go from 0 to 90, 90 to 180 or 0 to 180 degrees",
            )),
        }
    }

    fn horizontal(&mut self, count: usize) -> Result<Vec<f64>, SceneError> {
        let angles = self.angles(count, "horizontal")?;
        match (angles[0], angles[count - 1]) {
            (0.0, 0.0 | 90.0 | 180.0 | 360.0) | (90.0, 270.0) => Ok(angles),
            (from, to) => Err(self.wrong(
                format!("horizontal angles go from {from} to {to}"),
                "they must be 0 alone, or go from 0 to 90, 180 or 360, or from 90 to 270 degrees",
            )),
        }
    }

    fn candela(
        &mut self,
        vertical: &[f64],
        horizontal: &[f64],
        factor: f64,
    ) -> Result<Vec<f64>, SceneError> {
        let mut candela = Vec::new();
        for c in horizontal {
            for gamma in vertical {
                let what = format!("the intensity at {c}, {gamma} degrees");
                candela.push(factor * self.next(&what, |x| x >= 0.0, "at least 0 cd")?);
            }
        }
        if candela.iter().any(|&i| i > MOST_INTENSITY) {
            return Err(self.wrong(
                format!("an intensity exceeds {MOST_INTENSITY:e} cd"),
                "check the candela multiplier",
            ));
        }
        match self.words.next() {
            None => Ok(candela),
            Some((line, word)) => {
                self.line = line;
                Err(self.wrong(
                    format!("'{}' follows after all intensities", short(word)),
                    "check the numbers of vertical and horizontal angles",
                ))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(text: &str) -> Result<Photometry, SceneError> {
        parse(&Source { path: Path::new("lamp.ies"), bytes: text.as_bytes() })
    }

    /// A file of 1 lamp of 1000 lm, whose numbers from the multiplier on are given.
    fn file(numbers: &str) -> String {
        format!("IESNA:LM-63-2002\n[TEST] 1\n[MANUFAC] A = B, C\nTILT=NONE\n1 1000 {numbers}\n")
    }

    const PLAIN: &str = "1 3 1 1 2 0 0 0\n1 1 50\n0 90 180\n0\n30 20 10";

    #[test]
    fn a_plain_file_is_read() {
        let p = parsed(&file(PLAIN)).unwrap();
        assert_eq!((&p.vertical[..], &p.horizontal[..]), (&[0.0, 90.0, 180.0][..], &[0.0][..]));
        assert_eq!(p.candela, [30.0, 20.0, 10.0]);
        assert_eq!((p.rated_flux(), p.opening()), (Some(1000.0), 0.0));
        assert_eq!(p.intensity(123.0, 45.0), 25.0);
    }

    #[test]
    fn separators_ends_of_lines_and_encodings_vary() {
        let text = file(PLAIN).replace('\n', "\r\n").replace(' ', ",  ") + "\u{1a}";
        assert_eq!(parsed(&text).unwrap(), parsed(&file(PLAIN)).unwrap());
        let mut bytes =
            b"\xef\xbb\xbfiesna:lm-63-2002\n[MANUFAC] Fr\xe8res\nTilt = None\n".to_vec();
        bytes.extend(format!("1 1000 {PLAIN}").bytes());
        let latin = parse(&Source { path: Path::new("lamp.ies"), bytes: &bytes }).unwrap();
        assert_eq!(latin, parsed(&file(PLAIN)).unwrap());
    }

    #[test]
    fn multipliers_and_units_apply() {
        let numbers = "2 2 1 1 1 -1 2 0\n.9 .5 50\n0 90\n0\n10 0";
        let later = parsed(&file(numbers)).unwrap();
        assert_eq!(later.candela, [18.0, 0.0]);
        assert_eq!(later.rated_flux(), Some(900.0));
        assert!((later.opening() - 0.6096).abs() < 1e-12);
        let first = parsed(&file(numbers).replace("IESNA:LM-63-2002", "IESNA91")).unwrap();
        assert_eq!((first.candela[0], first.rated_flux()), (9.0, Some(450.0)));
        let absolute = parsed(&file(numbers).replace("1 1000", "1 -1")).unwrap();
        assert_eq!((absolute.candela[0], absolute.rated_flux()), (18.0, None));
    }

    /// A lamp of π × 1000 lm in a lossless diffuse luminaire: I = 1000 cd cos γ.
    #[test]
    fn a_diffuse_luminaire_sends_out_the_lumens_of_its_lamp() {
        use std::f64::consts::PI;
        let angles: Vec<f64> = (0..=45).map(|k| 2.0 * f64::from(k)).collect();
        let words = |f: &dyn Fn(f64) -> f64| -> String {
            angles.iter().map(|&a| format!("{:.3} ", f(a))).collect()
        };
        let text = format!(
            "IESNA:LM-63-1995\nTILT=NONE\n2 {} 2 46 1 1 2 0 0 0 1 1 50\n{}\n0\n{}",
            500.0 * PI,
            words(&|a| a),
            words(&|a| 500.0 * a.to_radians().cos())
        );
        let p = parsed(&text).unwrap();
        let rated = p.rated_flux().unwrap();
        assert!((rated / (1000.0 * PI) - 1.0).abs() < 1e-12);
        assert!((p.flux() / rated - 1.0).abs() < 3e-4, "{} {rated}", p.flux());
    }

    #[test]
    fn tilt_is_passed_over_only_if_it_changes_nothing() {
        let with = |tilt: &str| parsed(&file(PLAIN).replace("TILT=NONE", tilt));
        let same = with("TILT=INCLUDE\n1\n3\n0 45 90\n1 1.0 1").unwrap();
        assert_eq!(same, parsed(&file(PLAIN)).unwrap());
        let message = |tilt: &str| with(tilt).unwrap_err().to_string();
        let differs = message("TILT=INCLUDE\n1\n3\n0 45 90\n1 .9 .8");
        assert!(
            differs.contains("line 8: the light depends on the tilt (a factor of 0.9)"),
            "{differs}"
        );
        let other = message("TILT=LAMP.TLT");
        assert!(other.contains("line 4: TILT=LAMP.TLT refers to another file"), "{other}");
        let none = message("");
        assert!(none.contains("keywords: are not followed by a line TILT="), "{none}");
    }

    #[test]
    fn what_is_wrong_is_said_with_its_line_and_a_remedy() {
        let header = parsed("LUMINAIRE 7\n").unwrap_err().to_string();
        assert!(header.starts_with("lamp.ies: line 1: begins with 'LUMINAIRE 7'"), "{header}");
        assert!(header.contains("IESNA91, IESNA:LM-63-1995"), "{header}");
        assert!(parsed("").unwrap_err().to_string().contains("line 1: begins with ''"));
        for (numbers, expected) in [
            ("0 3 1 1 2", "line 5: the candela multiplier is '0'; it must be a positive number"),
            ("1 2.5 1 1 2", "line 5: the number of vertical angles is '2.5'"),
            ("1 3 -1 1 2", "line 5: the number of horizontal angles is '-1'"),
            ("1 3 1 2 2", "line 5: is photometry of type B; only type C is read"),
            ("1 3 1 3 2", "photometry of type A"),
            ("1 3 1 4 2", "the photometric type is '4'; it must be 1 (type C), 2 (B) or 3 (A)"),
            ("1 3 1 1 3", "the unit is '3'; it must be 1 (feet) or 2 (metres)"),
            ("1 3 1 1 2 0 wide", "the opening's length is 'wide'; it must be a number"),
            ("1 3 1 1 2 0 0 0 0", "the ballast factor is '0'"),
            ("1 3 1 1 2 0 0 0 1 1 9\n0 90 45", "line 6: vertical angle 3 of 3 is '45'"),
            ("1 3 1 1 2 0 0 0 1 1 9\n0 40 85", "line 6: vertical angles go from 0 to 85"),
            ("1 1 1 1 2 0 0 0 1 1 9\n90", "vertical angles go from 90 to 90"),
            ("1 2 2 1 2 0 0 0 1 1 9\n0 90\n0 45", "line 7: horizontal angles go from 0 to 45"),
            ("1 2 1 1 2 0 0 0 1 1 9\n0 90\n0\n5 -2", "the intensity at 0, 90 degrees is '-2'"),
            ("1 2 1 1 2 0 0 0 1 1 9\n0 90\n0\n5", "the file ends before the intensity at 0, 90"),
            ("1 2 1 1 2 0 0 0 1 1 9\n0 90\n0\n5 nan", "the intensity at 0, 90 degrees is 'nan'"),
            ("1 2 1 1 2 0 0 0 1 1 9\n0 90\n0\n5 4\n3", "line 9: '3' follows after all intensities"),
            ("1e300 2 1 1 2 0 0 0 1 1 9\n0 90\n0\n1e300 4", "an intensity exceeds 1e30 cd"),
        ] {
            let message = parsed(&file(numbers)).unwrap_err().to_string();
            assert!(message.contains(expected), "{message}\n{expected}");
        }
        let dark = parsed(&file(PLAIN).replace("1 1000", "1 -2")).unwrap_err().to_string();
        assert!(dark.contains("the lumens per lamp is '-2'"), "{dark}");
        let gone = read(Path::new("no-such.ies")).unwrap_err().to_string();
        assert!(gone.contains("no-such.ies: cannot be read"), "{gone}");
    }
}
