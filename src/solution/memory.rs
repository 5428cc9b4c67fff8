//! Whether the form factors of a mesh, and what solves them, fit in memory.

use super::error::LightError;
use crate::engines::{Engine, ROWS_AT_ONCE, SampleOfRows};
use crate::patches::Patches;
use crate::ranks::Ranks;
use crate::solve::{Method, direct_bytes};

/// Bytes a patch takes beside its row: cells, areas, vectors of the solver, the field; measured.
const PATCH_BYTES: f64 = 850.0;

/// Bytes of an entry of a row with one a patch.
const ENTRY_BYTES: f64 = 8.0;

/// A mesh, and what it was made from.
pub(super) struct Mesh<'a> {
    pub patches: &'a Patches,
    /// Largest area of a patch in m².
    pub patch_size: f64,
    /// How many patches another size would make; `None` where it is not free.
    pub count: Option<&'a dyn Fn(f64) -> Option<usize>>,
    /// Who shares the rows.
    pub ranks: &'a Ranks,
}

/// Bytes that lighting by the rows of a mesh will take; refuses what cannot fit.
pub(super) fn check_memory(
    engine: &mut dyn Engine,
    mesh: &Mesh<'_>,
    method: Method,
    allowed: u64,
) -> Result<u64, LightError> {
    let sample = SampleOfRows::of(engine, mesh.patches)?;
    let engine = &*engine;
    let needed = |n: usize| {
        let row = sample.bytes.min(ENTRY_BYTES * n as f64);
        let solver = match method {
            // Sides that see nothing have no row.
            Method::Direct => direct_bytes((sample.seeing * n as f64) as usize) as f64,
            // Rows, and the same by columns.
            Method::Shooting => row * n as f64,
            Method::GaussSeidel | Method::Jacobi => 0.0,
        };
        let beside = PATCH_BYTES * n as f64 + engine.bytes(n.min(ROWS_AT_ONCE)) as f64;
        row * n as f64 / mesh.ranks.size() as f64 + beside + solver
    };
    let n = mesh.patches.len();
    // All ranks go on or none, whatever the threads of each need.
    let most = mesh.ranks.every(needed(n))?.into_iter().fold(0.0, f64::max);
    if most <= allowed as f64 {
        return Ok(most as u64);
    }
    let fits = |n: usize| needed(n) <= allowed as f64;
    Err(LightError::Memory {
        patches: n,
        needed: most as u64,
        allowed,
        proposal: mesh.count.and_then(|count| proposal(mesh, count, fits)),
    })
}

/// A patch size that fits, m², if any does: from some size on, patches are whole source triangles,
/// or clusters that end where surfaces bend.
fn proposal(
    mesh: &Mesh<'_>,
    count: &dyn Fn(f64) -> Option<usize>,
    fits: impl Fn(usize) -> bool,
) -> Option<f64> {
    /// How much larger the next size to try is, and how often that may change nothing: a level of
    /// subdivision lasts for four times the area. Clusters grow all the time, and are not made for
    /// nothing.
    const STEPS: (f64, usize) = (1.2, 9);
    const STEPS_OF_CLUSTERS: (f64, usize) = (2.0, 1);
    const MOST: usize = 200;
    let patches = mesh.patches;
    let (step, enough) = if patches.has_clusters() { STEPS_OF_CLUSTERS } else { STEPS };
    let most = most_that(&fits, patches.len());
    if most == 0 {
        return None;
    }
    let source = |i| patches.area(i) * f64::from(1_u32 << (2 * u32::from(patches.cell(i).level)));
    let largest = patches.ids().map(source).fold(0.0, f64::max);
    // About where so many patches as fit would be made.
    let share = if patches.has_clusters() { patches.len() as f64 / most as f64 } else { 1.0 };
    let first = mesh.patch_size * share * STEPS.0;
    let sizes = std::iter::successors(Some(first), |size| Some(size * step));
    let (mut fewest, mut still) = (usize::MAX, 0);
    for size in sizes.take(MOST) {
        if size / step >= largest && !patches.has_clusters() || still > enough {
            return None;
        }
        let size = two_digits_up(size);
        let Some(n) = count(size) else { continue };
        if fits(n) {
            return Some(size);
        }
        still = if n < fewest { 0 } else { still + 1 };
        fewest = fewest.min(n);
    }
    None
}

/// The largest number up to `n` that fits, where all smaller ones do; 0 if none does.
fn most_that(fits: impl Fn(usize) -> bool, n: usize) -> usize {
    let (mut low, mut high) = (0, n);
    while low < high {
        let middle = high - (high - low) / 2;
        if fits(middle) { low = middle } else { high = middle - 1 }
    }
    low
}

/// The next larger number of two digits, as people type it.
fn two_digits_up(x: f64) -> f64 {
    let rounded = |x: f64| format!("{x:.1e}").parse().unwrap_or(x);
    let near = rounded(x);
    if near < x { rounded(x + 0.5 * 10_f64.powf(x.log10().floor() - 1.0)) } else { near }
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use super::{Mesh, most_that, proposal, two_digits_up};
    use crate::patches::Patches;
    use crate::ranks::Ranks;
    use crate::scene::Scene;

    #[test]
    fn a_size_that_does_not_exist_is_not_sought_for_long() {
        let scene = Scene::builtin("room").unwrap();
        let patches = Patches::clustered(&scene.geometry, 1.0, &scene.optics.material_of).unwrap();
        let calls = Cell::new(0);
        let count = |size: f64| {
            calls.set(calls.get() + 1);
            Some((100.0 / size).max(40.0) as usize)
        };
        let ranks = Ranks::default();
        let mesh = Mesh { patches: &patches, patch_size: 1.0, count: Some(&count), ranks: &ranks };
        let sought = |most: usize| {
            calls.set(0);
            (proposal(&mesh, &count, |n| n <= most), calls.get())
        };
        assert_eq!(sought(0), (None, 0));
        let (none, calls) = sought(39);
        assert!(none.is_none() && calls < 40, "{calls}");
        assert!(sought(50).0.is_some_and(|size| size >= 2.0));
        assert_eq!([0, 1, 7, 99].map(|n| most_that(|k| k <= n, 20)), [0, 1, 7, 20]);
    }

    #[test]
    fn sizes_are_rounded_up() {
        let given = [0.000_412, 0.013, 1.831, 9.99, 120.0];
        assert_eq!(given.map(two_digits_up), [0.000_42, 0.013, 1.9, 10.0, 120.0]);
    }
}
