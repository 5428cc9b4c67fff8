//! Who is split, one rule a file.

pub mod factor;
