//! Photometric files: the text format IES LM-63.
//!
//! A header, keywords in brackets, and from the line `TILT=` on nothing but numbers (ANSI/IESNA
//! LM-63-2002, "Standard file format for the electronic transfer of photometric data and related
//! information"; for the edition of 1991 IESNA LM-63-1991).

use std::path::Path;

use super::files::read_regular;
use super::lines::shown;
use super::optics::MOST_RADIANCE;
use super::photometry::Photometry;
use super::shortened::shortened;
use super::source::{ImportError, Place, Source};
use super::type_a::TypeA;
use super::type_b::TypeB;

/// Reads the photometry of a luminaire: an IES file of any type and any edition since 1986.
///
/// Intensities are those of the file times its multiplier and ballast factors. In relative
/// photometry they already count the flux of the lamps; nothing is scaled to it.
///
/// # Errors
/// If the file cannot be read or is broken, or if its light depends on the tilt.
pub fn read(path: &Path) -> Result<Photometry, ImportError> {
    let unreadable = |source| ImportError::Unreadable { path: path.into(), source };
    let bytes = read_regular(path).map_err(unreadable)?;
    parse(&Source::new(path, &bytes))
}

/// Headers, and whether their edition has a ballast-lamp photometric factor; later ones reserve its
/// place.
const HEADERS: [(&str, bool); 6] = [
    ("IESNA86", true),
    ("IESNA91", true),
    ("IESNA95", false),
    ("IESNA:LM-63-1995", false),
    ("IESNA:LM-63-2002", false),
    ("IES:LM-63-2019", false),
];

/// Angles that are nearer to each other, in degrees, are one: intensities between them would be
/// noise.
const LEAST_STEP: f64 = 1e-6;

/// Metres.
const FOOT: f64 = 0.3048;

/// What to do about a file whose numbers do not add up.
const FETCH_AGAIN: &str = "fetch the file from its manufacturer again";

fn parse(source: &Source<'_>) -> Result<Photometry, ImportError> {
    // Names of makers come in any encoding.
    let text = String::from_utf8_lossy(source.bytes);
    let text = text.trim_start_matches('\u{feff}');
    let mut lines = text.lines().enumerate().map(|(i, line)| (i + 1, line.trim()));
    let header = text.lines().next().unwrap_or_default().trim();
    let tilt = lines.find_map(|(n, line)| {
        let (key, value) = line.split_once('=')?;
        key.trim().eq_ignore_ascii_case("TILT").then(|| (n, value.trim()))
    });
    let edition = HEADERS.iter().find(|h| h.0.eq_ignore_ascii_case(header)).map(|h| h.1);
    // The edition of 1986 has no header: labels without a form come first.
    let first_edition = tilt.is_some() && !header.to_ascii_uppercase().starts_with("IES");
    let has_lamp_factor = edition.or(first_edition.then_some(true)).ok_or_else(|| {
        source.malformed(
            Place::Line(1),
            format!("begins with '{}', which is no header of LM-63", shortened(header)),
            format!("the first line must be one of {}", HEADERS.map(|h| h.0).join(", ")),
        )
    })?;
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
                format!("TILT={} refers to another file", shortened(tilt)),
                "write TILT=NONE if the light does not depend on the tilt",
            ));
        }
    }
    numbers.photometry(has_lamp_factor)
}

/// The numbers of a file, one after another.
struct Numbers<'a, W> {
    source: &'a Source<'a>,
    words: W,
    /// The line of the last number, counted from 1.
    line: usize,
}

impl<'a, W: Iterator<Item = (usize, &'a str)>> Numbers<'_, W> {
    fn wrong(&self, problem: impl Into<String>, remedy: impl Into<String>) -> ImportError {
        self.source.malformed(Place::Line(self.line), problem, remedy)
    }

    /// The next number if it is `valid`, which `expected` describes.
    fn next(
        &mut self,
        what: &str,
        valid: impl FnOnce(f64) -> bool,
        expected: &str,
    ) -> Result<f64, ImportError> {
        let Some((line, word)) = self.words.next() else {
            return Err(self.wrong(format!("the file ends before {what}"), FETCH_AGAIN));
        };
        self.line = line;
        match word.parse::<f64>() {
            Ok(number) if number.is_finite() && valid(number) => Ok(number),
            _ => Err(self.wrong(
                format!("{what} is '{}'", shortened(word)),
                format!("it must be {expected}; {FETCH_AGAIN}"),
            )),
        }
    }

    fn number(&mut self, what: &str) -> Result<f64, ImportError> {
        self.next(what, |_| true, "a number")
    }

    fn positive(&mut self, what: &str) -> Result<f64, ImportError> {
        self.next(what, |x| x > 0.0, "a positive number")
    }

    fn count(&mut self, what: &str) -> Result<usize, ImportError> {
        let whole = |x: f64| x >= 1.0 && x <= f64::from(u16::MAX) && x.fract() == 0.0;
        Ok(self.next(what, whole, "a whole number of at least 1")? as usize)
    }

    /// Ascending angles in degrees.
    fn angles(&mut self, count: usize, what: &str) -> Result<Vec<f64>, ImportError> {
        let mut angles: Vec<f64> = Vec::new();
        for k in 1..=count {
            let name = format!("{what} angle {k} of {count}");
            let after = angles.last().copied();
            let ascends = |x: f64| x.abs() <= 360.0 && after.is_none_or(|a| x >= a + LEAST_STEP);
            angles.push(self.next(&name, ascends, "larger than the one before it, in degrees")?);
        }
        Ok(angles)
    }

    /// Passes over how the light depends on the luminaire's tilt, provided that it does not.
    fn tilt(&mut self) -> Result<(), ImportError> {
        self.number("the geometry of lamp and luminaire")?;
        let pairs = self.count("the number of tilt angles")?;
        self.angles(pairs, "tilt")?;
        for _ in 0..pairs {
            let factor = self.number("a tilt factor")?;
            if factor != 1.0 {
                return Err(self.wrong(
                    format!(
                        "the light depends on the tilt (a factor of {}), which is not \
                         supported",
                        shown(factor)
                    ),
                    "write TILT=NONE in place of the tilt data to leave it out of account",
                ));
            }
        }
        Ok(())
    }

    fn photometry(&mut self, has_lamp_factor: bool) -> Result<Photometry, ImportError> {
        let lamps = self.next("the number of lamps", |x| x >= 0.0, "a number of lamps")?;
        let lumens = self.next(
            "the lumens per lamp",
            |x| x >= 0.0 || x == -1.0,
            "a luminous flux, or -1 for absolute photometry",
        )?;
        let multiplier = self.positive("the candela multiplier")?;
        let vertical = self.count("the number of vertical angles")?;
        let horizontal = self.count("the number of horizontal angles")?;
        let kind = self.next(
            "the photometric type",
            |x| [1.0, 2.0, 3.0].contains(&x),
            "1 (type C), 2 (B) or 3 (A)",
        )?;
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
        let (vertical, horizontal) = match kind {
            1.0 => (self.vertical(vertical)?, self.horizontal(horizontal)?),
            _ => (self.about_aim(vertical, "vertical")?, self.about_aim(horizontal, "horizontal")?),
        };
        let candela = self.candela(&vertical, &horizontal, multiplier * factors)?;
        let (vertical, horizontal, candela) = match kind {
            1.0 => (vertical, horizontal, candela),
            2.0 => TypeB { vertical, horizontal, candela }.as_type_c(),
            _ => TypeA { vertical, horizontal, candela }.as_type_c(),
        };
        Ok(Photometry {
            vertical,
            horizontal,
            candela,
            rated: (lumens > 0.0).then_some(lamps * lumens * factors),
            opening: opening * if unit == 1.0 { FOOT } else { 1.0 },
        })
    }

    /// Angles about the aim of a floodlight or headlight.
    fn about_aim(&mut self, count: usize, what: &str) -> Result<Vec<f64>, ImportError> {
        let angles = self.angles(count, what)?;
        let (from, to) = (angles[0], angles[count - 1]);
        if (-90.0..=0.0).contains(&from) && (0.0..=90.0).contains(&to) {
            return Ok(angles);
        }
        let (from, to) = (shown(from), shown(to));
        Err(self.wrong(
            format!("{what} angles go from {from} to {to}"),
            "those of type A or B must go from 0 or less to 0 or more, within 90 degrees",
        ))
    }

    fn vertical(&mut self, count: usize) -> Result<Vec<f64>, ImportError> {
        let angles = self.angles(count, "vertical")?;
        match (angles[0], angles[count - 1]) {
            (0.0, 90.0 | 180.0) | (90.0, 180.0) => Ok(angles),
            (from, to) => Err(self.wrong(
                format!("vertical angles go from {from} to {to}"),
                "they must go from 0 to 90, 90 to 180 or 0 to 180 degrees",
            )),
        }
    }

    fn horizontal(&mut self, count: usize) -> Result<Vec<f64>, ImportError> {
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
    ) -> Result<Vec<f64>, ImportError> {
        let mut candela = Vec::new();
        for c in horizontal {
            for gamma in vertical {
                let what = format!("the intensity at {c}, {gamma} degrees");
                candela.push(factor * self.next(&what, |x| x >= 0.0, "at least 0 cd")?);
            }
        }
        if candela.iter().any(|&i| i > MOST_RADIANCE) {
            return Err(self.wrong(
                format!("an intensity exceeds {MOST_RADIANCE:e} cd"),
                "check the candela multiplier",
            ));
        }
        match self.words.next() {
            None => Ok(candela),
            Some((line, word)) => {
                self.line = line;
                Err(self.wrong(
                    format!("'{}' follows after all intensities", shortened(word)),
                    "check the numbers of vertical and horizontal angles",
                ))
            }
        }
    }
}

#[cfg(test)]
mod tests;
