//! Whether the form factors of a mesh fit in memory.

use super::error::LightError;
use crate::engines::{Engine, ROWS_AT_ONCE, SampleOfRows};
use crate::patches::Patches;

/// Bytes a patch takes beside its row: cells, areas, vectors of the solver, the field.
const PATCH_BYTES: f64 = 400.0;

/// Predicts what the rows will take and refuses what cannot fit. `patch_size` (m²) is what the mesh
/// was made with.
pub(super) fn check_memory(
    engine: &mut dyn Engine,
    patches: &Patches,
    patch_size: f64,
    allowed: u64,
) -> Result<(), LightError> {
    let n = patches.len();
    let sample = SampleOfRows::of(engine, patches)?;
    let beside = PATCH_BYTES * n as f64 + engine.bytes(n.min(ROWS_AT_ONCE)) as f64;
    let needed = sample.bytes * n as f64 + beside;
    if needed <= allowed as f64 {
        return Ok(());
    }
    // Entries grow at most as the square of the number of patches, and with it linearly in between.
    let larger = patch_size * (needed / allowed as f64).max(1.1);
    let source = |i| patches.area(i) * f64::from(1_u32 << (2 * u32::from(patches.cell(i).level)));
    let largest = patches.ids().map(source).fold(0.0, f64::max);
    Err(LightError::Memory {
        patches: n,
        needed: needed as u64,
        allowed,
        // Beyond whole source triangles a larger size changes nothing, unless they are joined.
        proposal: Some(larger).filter(|l| *l < largest || patches.has_clusters()),
    })
}
