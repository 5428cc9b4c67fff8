//! Textures stay encoded until they are needed: one is decoded at a time.

use std::sync::Arc;

/// How a texture coordinate outside 0..1 is brought back.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Wrap {
    /// Repeats.
    #[default]
    Repeat,
    /// Repeats, every other time mirrored.
    Mirror,
    /// Holds the border's value.
    Clamp,
}

/// An image file's bytes, and how coordinates fall on it.
#[derive(Debug, Clone)]
pub struct Texture {
    /// What messages call it: a file name, or the place in the model.
    pub name: String,
    /// PNG, JPEG, ... as in the file.
    pub encoded: Arc<[u8]>,
    /// Wrapping along u and v.
    pub wrap: [Wrap; 2],
    /// Whether v = 0 is the bottom row (OBJ) rather than the top row (glTF).
    pub v_up: bool,
}
