//! From a point of a source triangle to its patch, as engines need it: millions of times, and in
//! single precision.

use glam::DVec3;

use crate::patches::{PatchId, Patches, Split, side_index};
use crate::scene::{Side, TriangleId};

/// How the patch at a point is found, by item: twice the index of a solid triangle, plus 1 for its
/// back. Beside patches there are two more places where light ends.
#[derive(Debug)]
pub(super) struct Lookups<'a> {
    /// The uniform mesh that is looked up in.
    pub finest: &'a Patches,
    /// For each of its patches the patch that it is a part of, if that is another mesh; then the
    /// places that are no patches.
    pub patch_of: Option<Vec<u32>>,
    sides: Vec<Lookup>,
}

/// How the patch at a point of one side is found.
#[derive(Debug, Clone, Copy)]
pub(super) struct Lookup {
    /// The first place in the finest mesh on this side.
    pub first: u32,
    /// Strips of the side's grid; 0 if all of it is `first`.
    pub strips: f32,
    /// Whether something parts patches of this side.
    pub cut: bool,
}

/// The place, behind the patches, of what escapes.
pub(super) fn environment(patches: usize) -> u32 {
    patches as u32
}

/// The place, behind the patches, of what ends on backs that do not reflect.
pub(super) fn back(patches: usize) -> u32 {
    patches as u32 + 1
}

impl<'a> Lookups<'a> {
    /// For the sides of the `solid` triangles.
    pub fn new(solid: &[TriangleId], patches: &'a Patches) -> Self {
        let (finest, patch_of) = match patches.finest() {
            Some((finest, patch_of)) => {
                let places = [environment(patches.len()), back(patches.len())];
                (finest, Some([patch_of, &places].concat()))
            }
            None => (patches, None),
        };
        let lookup = |triangle: TriangleId, side: Side| match finest.split_of(triangle, side) {
            Split::Uniform { first, level } => {
                let cut = finest.has_crossed(side_index(triangle, side));
                let strips = if level == 0 && !cut { 0.0 } else { (1_u32 << level) as f32 };
                Lookup { first, strips, cut }
            }
            Split::None | Split::Adaptive { .. } => {
                Lookup { first: back(finest.len()), strips: 0.0, cut: false }
            }
        };
        let sides = solid.iter().flat_map(|&t| Side::BOTH.map(|side| lookup(t, side))).collect();
        Self { finest, patch_of, sides }
    }

    /// How it is done for one item.
    #[inline(always)]
    pub fn of(&self, item: u32) -> Lookup {
        self.sides[item as usize]
    }

    /// The patch that a place in the finest mesh is a part of.
    #[inline(always)]
    pub fn whole(&self, place: u32) -> u32 {
        self.patch_of.as_ref().map_or(place, |p| p[place as usize])
    }

    /// The patch of the finest mesh that the point with barycentric coordinates proportional to `f`
    /// in the cell of patch `id` belongs to.
    #[inline(never)]
    pub fn owner(&self, id: u32, f: [f32; 3]) -> u32 {
        let f = DVec3::from_array(f.map(f64::from));
        self.finest.owner(PatchId(id), f / (f.x + f.y + f.z)).0
    }
}

/// Index of the patch in a grid of `n` strips where barycentric coordinates are proportional to
/// `f0`, `f1`, `f2`; the twin in single precision of the look-up in [`Patches`]. Always below n².
#[inline(always)]
pub(super) fn index_in_grid(n: f32, f0: f32, f1: f32, f2: f32) -> u32 {
    let scale = n / (f0 + f1 + f2);
    let (u, v) = ((f0 * scale).max(0.0), (f1 * scale).max(0.0));
    let i = u.floor().min(n - 1.0);
    let j = v.floor().min(n - 1.0 - i);
    let inverted = ((u - i) + (v - j) > 1.0) & (i + j + 2.0 <= n);
    let (n, i, j) = (small_integer(n), small_integer(i), small_integer(j));
    i * (2 * n - i) + 2 * j + u32::from(inverted)
}

/// `x as u32` for whole x from 0 to 2^22, in a form that vectorises.
#[inline(always)]
fn small_integer(x: f32) -> u32 {
    const SHIFT: f32 = 8_388_608.0;
    (x + SHIFT).to_bits() & 0x7f_ffff
}
