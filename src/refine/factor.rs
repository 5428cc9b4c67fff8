//! Adaptive subdivision by form factor: algorithm 2 of Kulyasov & Nikulin (2012).
//!
//! Begin with large patches; compute all form factors; split the patches whose form factor exceeds
//! the tolerance, and repeat. F_ij > ε splits j, the patch seen; it may be split only while its
//! area exceeds the smallest size, so the result coarsens the uniform mesh of that size.
//!
//! # Deviations
//! The paper computes everything again in each pass. Here every row is made once. A patch that is
//! split has the same centroid as its middle child, so a row made for it remains the row of that
//! child. Rows are made on the uniform mesh of the smallest size, so each says at once how far
//! everything it sees must be split. The last step adds up the finest patches: the sums are the
//! rows of the adaptive mesh, and the rule holds on them by construction.

use std::sync::Arc;

use rayon::prelude::*;
use thiserror::Error;

use crate::engines::{AssembleError, Engine};
use crate::form_factors::{FormFactors, Merger};
use crate::patches::{Cell, PatchId, Patches, SplitCells};
use crate::progress::Progress;
use crate::scene::Geometry;

/// When a patch is split.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FactorRule {
    /// Largest form factor ε allowed, 0..1, where the patch seen may be split.
    pub max_factor: f64,
    /// Patches are split only while their area exceeds this, m².
    pub min_area: f64,
    /// Patches are split beforehand until none is larger than this, m². Default: whole source
    /// triangles.
    pub start_area: Option<f64>,
    /// Also split until neighbours on a source triangle differ by at most one level, for pictures.
    pub balance: bool,
}

/// Why a rule cannot be followed.
#[derive(Debug, Error)]
pub enum RefineError {
    /// The tolerance is no form factor.
    #[error("the largest form factor allowed, {0}, is not between 0 and 1")]
    Tolerance(f64),
    /// Patches are clusters of source triangles: there is no finer mesh that they coarsen.
    #[error("clusters of source triangles cannot be split by form factor")]
    Clusters,
    /// Rows could not be made.
    #[error(transparent)]
    Assemble(#[from] AssembleError),
}

/// An adaptive mesh and its matrix.
#[derive(Debug, Clone)]
pub struct Refined {
    /// The patches.
    pub patches: Patches,
    /// Their form factors.
    pub factors: FormFactors,
    /// Rows that were made; one a patch.
    pub rows_made: usize,
}

impl FactorRule {
    /// The adaptive mesh of `geometry`; `engine` makes the rows of `finest`, the uniform mesh of
    /// the smallest size. Rows take at most `memory` bytes. Advances `progress` by one a row.
    pub fn refine(
        &self,
        geometry: &Geometry,
        finest: Arc<Patches>,
        engine: &mut dyn Engine,
        memory: u64,
        progress: &dyn Progress,
    ) -> Result<Refined, RefineError> {
        if !(self.max_factor > 0.0 && self.max_factor <= 1.0) {
            return Err(RefineError::Tolerance(self.max_factor));
        }
        if finest.has_clusters() {
            return Err(RefineError::Clusters);
        }
        let start = self.start_area;
        let mut cells = SplitCells::new(finest.clone(), |side| {
            let triangle = crate::scene::TriangleId((side / 2) as u32);
            start.map_or(0, |a| crate::patches::level_for(geometry.area(triangle), a))
        });
        let mut rows = FormFactors::new(finest.len(), memory);
        let mut wave: Vec<Cell> = cells.leaves();
        while !wave.is_empty() {
            let mut ids: Vec<PatchId> = wave.iter().map(|c| cells.middle(c)).collect();
            ids.sort_unstable();
            ids.dedup();
            ids.retain(|&i| !rows.has_row(i));
            engine.make(&ids, &mut rows, progress)?;
            let demanded: Vec<Vec<Cell>> = ids
                .par_chunks(64)
                .map_init(
                    || RowSums::new(cells.nodes()),
                    |sums, ids| {
                        ids.iter().flat_map(|&i| self.demands(&cells, &rows, i, sums)).collect()
                    },
                )
                .collect();
            wave.clear();
            for cell in demanded.into_iter().flatten() {
                split(&mut cells, cell, &mut wave);
            }
            if wave.is_empty() && self.balance {
                for cell in unbalanced(&cells) {
                    split(&mut cells, cell, &mut wave);
                }
            }
        }
        let patches = cells.patches();
        let rows_made = rows.rows();
        let patch_of = patches.finest().map_or(&[][..], |f| f.1);
        // The row of a patch is that of its middle on the finest mesh.
        let middle = |i| cells.middle(&patches.cell(i));
        let factors = rows.merged(patches.len(), patch_of, middle);
        Ok(Refined { patches, factors, rows_made })
    }

    /// The cells that must be split for row `i`: those not finest whose form factor exceeds ε.
    fn demands(
        &self,
        cells: &SplitCells,
        rows: &FormFactors,
        i: PatchId,
        sums: &mut RowSums,
    ) -> Vec<Cell> {
        let Some(row) = rows.row(i) else { return Vec::new() };
        let leaf_of = cells.leaf_of();
        let (leaves, factors) = row.merged(leaf_of, &mut sums.merger);
        let large: Vec<PatchId> = (0..)
            .zip(&leaves)
            .filter(|&(k, _)| factors.get(k) > self.max_factor)
            .map(|(_, &leaf)| leaf)
            .collect();
        let mut wanted = Vec::new();
        if large.is_empty() {
            return wanted;
        }
        large.iter().for_each(|leaf| sums.large[leaf.index()] = true);
        let finest = cells.finest();
        let seen: Vec<(Cell, f64)> = row
            .entries()
            .filter(|(j, _)| sums.large.get(leaf_of[j.index()] as usize).is_some_and(|l| *l))
            .map(|(j, f)| (finest.cell(j), f))
            .collect();
        large.iter().for_each(|leaf| sums.large[leaf.index()] = false);
        let same_side =
            |a: &(Cell, f64), b: &(Cell, f64)| (a.0.triangle, a.0.side) == (b.0.triangle, b.0.side);
        for on_side in seen.chunk_by(same_side) {
            self.demands_on_side(cells, on_side, &mut sums.of_nodes, &mut wanted);
        }
        wanted
    }

    /// The cells of all levels on one side that must be split, from the finest cells `seen` there
    /// and their form factors.
    fn demands_on_side(
        &self,
        cells: &SplitCells,
        seen: &[(Cell, f64)],
        sums: &mut [f64],
        wanted: &mut Vec<Cell>,
    ) {
        let Some(finest) = seen.first().map(|p| p.0.level) else { return };
        // Each with a finest cell within it, to know it by.
        let mut below: Vec<(usize, Cell, f64)> =
            seen.iter().map(|(cell, f)| (cells.node(cell), *cell, *f)).collect();
        let mut above = Vec::with_capacity(below.len());
        for level in (0..finest).rev() {
            above.clear();
            for (node, cell, f) in &below {
                let parent = cells.parent(*node);
                if sums[parent] == 0.0 {
                    above.push((parent, *cell, 0.0));
                }
                sums[parent] += f;
            }
            for (node, _, f) in &mut above {
                *f = std::mem::take(&mut sums[*node]);
            }
            std::mem::swap(&mut below, &mut above);
            let large = below.iter().filter(|p| p.2 > self.max_factor);
            wanted.extend(large.map(|p| p.1.ancestor(level)).filter(|c| !cells.is_split(c)));
        }
    }
}

/// What it takes to look at a row; numbers and marks a node of [`SplitCells`], all zero in between.
struct RowSums {
    merger: Merger,
    large: Vec<bool>,
    of_nodes: Vec<f64>,
}

impl RowSums {
    fn new(nodes: usize) -> Self {
        Self { merger: Merger::new(nodes), large: vec![false; nodes], of_nodes: vec![0.0; nodes] }
    }
}

/// Splits a cell, and adds its children to the `wave` of those that need a row.
fn split(cells: &mut SplitCells, cell: Cell, wave: &mut Vec<Cell>) {
    if cells.may_split(&cell) && cells.split(&cell) {
        wave.extend(cell.children());
    }
}

/// The patches with a neighbour on the same source triangle that is finer by two levels or more.
fn unbalanced(cells: &SplitCells) -> Vec<Cell> {
    let leaves = cells.leaves();
    // Corners of all leaves on the lattice of the finest level of all.
    let finest = leaves.iter().map(|c| c.level).max().unwrap_or(0);
    let lattice = |c: &Cell| c.lattice().map(|p| p.map(|x| x << (finest - c.level)));
    let corners: std::collections::HashSet<_> =
        leaves.iter().flat_map(|c| lattice(c).map(|p| (c.triangle, c.side, p))).collect();
    leaves
        .into_iter()
        .filter(|c| {
            let p = lattice(c);
            c.level + 2 <= finest
                && (0..3).any(|k| {
                    let (a, b) = (p[k], p[(k + 1) % 3]);
                    [1, 3].iter().any(|&q| {
                        let at = [0, 1, 2].map(|x| (a[x] * (4 - q) + b[x] * q) / 4);
                        corners.contains(&(c.triangle, c.side, at))
                    })
                })
        })
        .collect()
}
