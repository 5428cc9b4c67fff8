//! One node of the hierarchy.

/// A box, and what is in it: lowest x, y, z, highest x, y, z, and the bits of two integers. Eight
/// numbers alike need no check of an index below eight.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(align(32))]
pub(super) struct Node(pub(super) [f32; 8]);

impl Node {
    /// The first of two children in a row, or the first triangle of a leaf.
    #[inline(always)]
    pub(super) fn first(&self) -> u32 {
        self.0[6].to_bits()
    }

    /// Number of triangles of a leaf, or [`INNER`] plus the axis along which the children lie.
    #[inline(always)]
    pub(super) fn kind(&self) -> u32 {
        self.0[7].to_bits()
    }

    /// The same box, with other contents.
    pub(super) fn with(mut self, first: u32, kind: u32) -> Self {
        (self.0[6], self.0[7]) = (f32::from_bits(first), f32::from_bits(kind));
        self
    }
}

/// Marks a [`Node`] with children.
pub(super) const INNER: u32 = 0x8000_0000;

/// Deepest level of the hierarchy below its root.
pub(super) const DEEPEST: usize = 80;
