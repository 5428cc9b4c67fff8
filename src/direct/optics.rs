//! Reflectance and emission of patches: those of their source triangles.

use crate::patches::{PatchId, Patches};
use crate::scene::{Optics, Rgb, Side, TriangleId};

/// Reflectance ρ of each patch, 0..1: its source triangle's; of a cluster the mean by area.
#[must_use]
pub fn reflectance(optics: &Optics, patches: &Patches) -> Vec<Rgb> {
    mean(patches, |t, _| optics.reflectance[t.index()])
}

/// Emission E (self-emitted exitance, W/m² or lm/m²) of each patch: its source triangle side's; of
/// a cluster the mean by area.
#[must_use]
pub fn emission(optics: &Optics, patches: &Patches) -> Vec<Rgb> {
    mean(patches, |t, side| optics.emission(t, side))
}

/// The mean over each patch of what its source triangles' sides have.
fn mean(patches: &Patches, value: impl Fn(TriangleId, Side) -> Rgb) -> Vec<Rgb> {
    let of = |id: PatchId| {
        let cell = patches.cell(id);
        let first = value(cell.triangle, cell.side);
        // Exact where all are alike, as nearly always.
        if patches.members(id).iter().all(|&t| value(t, cell.side) == first) {
            return first;
        }
        patches.area_fractions(id).map(|(t, fraction)| value(t, cell.side) * fraction).sum()
    };
    patches.ids().map(of).collect()
}
