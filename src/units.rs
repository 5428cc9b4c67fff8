//! Quantities as messages say them: a number with its unit.

use std::fmt;

/// Bytes that work may take where nothing else is said: 4 GiB.
pub const DEFAULT_MEMORY: u64 = 4 << 30;

/// An amount of memory, or of room on a disk.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Bytes(pub u64);

impl fmt::Display for Bytes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        const KIB: u64 = 1 << 10;
        const MIB: u64 = 1 << 20;
        const GIB: u64 = 1 << 30;
        match self.0 {
            0..MIB => write!(f, "{} KiB", self.0.div_ceil(KIB)),
            MIB..GIB => write!(f, "{} MiB", self.0.div_ceil(MIB)),
            _ => write!(f, "{:.1} GiB", self.0 as f64 / GIB as f64),
        }
    }
}

/// An area in m², said in m², cm² or mm² with three significant digits.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
pub struct Area(pub f64);

impl fmt::Display for Area {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (value, unit) = match self.0 {
            a if a >= 0.01 => (a, "m²"),
            a if a >= 1e-5 => (1e4 * a, "cm²"),
            a => (1e6 * a, "mm²"),
        };
        write!(f, "{} {unit}", significant(value))
    }
}

/// A number with three significant digits, and no zeros behind.
#[must_use]
pub fn significant(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value}");
    }
    let digits = 2 - value.abs().log10().floor() as i32;
    let text = format!("{value:.*}", digits.clamp(0, 40) as usize);
    if !text.contains('.') {
        return text;
    }
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

#[cfg(test)]
mod tests {
    use super::{Area, Bytes};

    #[test]
    fn amounts_have_units() {
        let text = [0, 1, 100 << 20, (1 << 20) + 1, 3 << 29].map(|n| Bytes(n).to_string());
        assert_eq!(text, ["0 KiB", "1 KiB", "100 MiB", "2 MiB", "1.5 GiB"]);
    }

    #[test]
    fn areas_of_any_size_have_digits() {
        let text = [123.4, 0.0155, 0.001_234, 2.0e-5, 3.2e-9].map(|a| Area(a).to_string());
        assert_eq!(text, ["123 m²", "0.0155 m²", "12.3 cm²", "0.2 cm²", "0.0032 mm²"]);
    }
}
