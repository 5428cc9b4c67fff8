//! Which patches are split, one rule a file.

pub mod factor;
