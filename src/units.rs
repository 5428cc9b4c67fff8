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

#[cfg(test)]
mod tests {
    use super::Bytes;

    #[test]
    fn amounts_have_units() {
        let text = [0, 1, 100 << 20, (1 << 20) + 1, 3 << 29].map(|n| Bytes(n).to_string());
        assert_eq!(text, ["0 KiB", "1 KiB", "100 MiB", "2 MiB", "1.5 GiB"]);
    }
}
