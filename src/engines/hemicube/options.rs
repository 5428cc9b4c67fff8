//! How hemicubes are made, and why not.

use thiserror::Error;

/// What is projected on the faces.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Draw {
    /// Source triangles; the patch under a pixel is looked up.
    #[default]
    Sources,
    /// Every patch, as in the paper.
    Patches,
}

/// How hemicubes are made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct HemicubeOptions {
    /// Pixels along the top, even, 16 to 1,024; the sides are half as high. Default 128.
    pub resolution: usize,
    /// What is projected. Default: source triangles.
    pub draw: Draw,
}

impl Default for HemicubeOptions {
    fn default() -> Self {
        Self { resolution: 128, draw: Draw::Sources }
    }
}

impl HemicubeOptions {
    /// An error if the resolution is not one that hemicubes can have.
    pub(in crate::engines) fn check(&self) -> Result<(), HemicubeError> {
        let n = self.resolution;
        if !(16..=1024).contains(&n) || n % 2 == 1 {
            return Err(HemicubeError::Resolution(n));
        }
        Ok(())
    }
}

/// Why hemicubes cannot be made as asked.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum HemicubeError {
    /// The resolution is odd or out of range.
    #[error("the hemicube resolution {0} is not an even number from 16 to 1024")]
    Resolution(usize),
}
