//! What stands beyond the border of a texture.

use serde::{Deserialize, Serialize};

/// How a texture coordinate outside 0..1 is brought back.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Wrap {
    /// Repeats.
    #[default]
    Repeat,
    /// Repeats, every other time mirrored.
    Mirror,
    /// Holds the border's value.
    Clamp,
}

/// The texel that stands at place `i` along a side of `n`.
pub(super) fn wrapped(i: i64, n: u32, wrap: Wrap) -> usize {
    let n = i64::from(n);
    let i = match wrap {
        Wrap::Repeat => i.rem_euclid(n),
        Wrap::Clamp => i.clamp(0, n - 1),
        Wrap::Mirror => {
            let i = i.rem_euclid(2 * n);
            if i < n { i } else { 2 * n - 1 - i }
        }
    };
    i as usize
}
