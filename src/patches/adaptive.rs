//! Meshes of several levels: coarsenings of a uniform mesh.

use std::sync::{Arc, OnceLock};

use super::cell::Cell;
use super::crossed::CrossedPatches;
use super::members::Members;
use super::mesh::{Finest, Patches};
use super::point::{PatchId, side_index};
use super::split::Split;

/// A set of cells of all levels of a uniform mesh: those that are split.
#[derive(Debug, Clone)]
pub struct SplitCells {
    finest: Arc<Patches>,
    /// First node of each side; the nodes of a level follow those of the level above.
    base: Vec<u32>,
    split: Vec<bool>,
    /// The node that each node is a part of; whole sides are their own.
    parent: Vec<u32>,
    /// The node of the cell that might be split in which each patch of the uniform mesh lies, or
    /// [`NONE`].
    leaf: Vec<u32>,
}

/// No patch or node.
const NONE: u32 = u32::MAX;

impl SplitCells {
    /// Splits every cell below level `start(side)` of a uniform mesh.
    #[must_use]
    pub fn new(finest: Arc<Patches>, start: impl Fn(usize) -> u8) -> Self {
        let mut base = Vec::with_capacity(finest.splits.len());
        let (mut split, mut parent) = (Vec::new(), Vec::new());
        for (side, s) in finest.splits.iter().enumerate() {
            base.push(split.len() as u32);
            if let Some(level) = s.level() {
                split.resize(split.len() + nodes_below(level + 1) as usize, false);
                let first = split.len() - nodes_below(level + 1) as usize;
                let given = nodes_below(start(side).min(level)) as usize;
                split[first..first + given].fill(true);
                let cell = finest.side_cell(side);
                parent.push(first as u32);
                for l in 1..=level {
                    let above = first as u32 + nodes_below(l - 1);
                    let cells = Cell::grid(cell.triangle, cell.side, l);
                    parent.extend(cells.map(|c| above + c.ancestor(l - 1).index()));
                }
            }
        }
        let leaf = vec![NONE; finest.len()];
        let mut me = Self { finest, base, split, parent, leaf };
        for cell in me.leaves() {
            me.mark_leaf(&cell);
        }
        me
    }

    /// The node of the cell that might be split in which each patch of the uniform mesh lies;
    /// `u32::MAX` if that patch is a cell of its own.
    #[must_use]
    pub fn leaf_of(&self) -> &[u32] {
        &self.leaf
    }

    fn mark_leaf(&mut self, cell: &Cell) {
        let node = if self.may_split(cell) { self.node(cell) as u32 } else { NONE };
        if let Split::Uniform { first, level } = self.finest.split_of(cell.triangle, cell.side) {
            let leaf = &mut self.leaf;
            mark(cell, level, &mut |part| leaf[(first + part.index()) as usize] = node);
        }
    }

    /// The uniform mesh.
    #[must_use]
    pub fn finest(&self) -> &Patches {
        &self.finest
    }

    /// Number of cells of all levels.
    #[must_use]
    pub fn nodes(&self) -> usize {
        self.split.len()
    }

    /// Number of a cell among those of all levels.
    #[must_use]
    pub fn node(&self, cell: &Cell) -> usize {
        let side = side_index(cell.triangle, cell.side);
        (self.base[side] + nodes_below(cell.level) + cell.index()) as usize
    }

    /// The node that a node is a part of.
    #[must_use]
    pub fn parent(&self, node: usize) -> usize {
        self.parent[node] as usize
    }

    /// Whether a cell is split.
    #[must_use]
    pub fn is_split(&self, cell: &Cell) -> bool {
        self.split[self.node(cell)]
    }

    /// Whether a cell may be split: it is not one of the finest.
    #[must_use]
    pub fn may_split(&self, cell: &Cell) -> bool {
        self.finest.split_of(cell.triangle, cell.side).level() > Some(cell.level)
    }

    /// Splits a cell, all of whose ancestors are split; `false` if it was split before.
    pub fn split(&mut self, cell: &Cell) -> bool {
        let node = self.node(cell);
        let new = !std::mem::replace(&mut self.split[node], true);
        if new {
            cell.children().iter().for_each(|c| self.mark_leaf(c));
        }
        new
    }

    /// The finest patch whose centroid is a cell's.
    #[must_use]
    pub fn middle(&self, cell: &Cell) -> PatchId {
        match self.finest.split_of(cell.triangle, cell.side) {
            Split::Uniform { first, level } => PatchId(first + cell.middle(level).index()),
            Split::None | Split::Adaptive { .. } => PatchId(0),
        }
    }

    /// The cells that are not split, side by side: the patches of the adaptive mesh in order.
    #[must_use]
    pub fn leaves(&self) -> Vec<Cell> {
        let mut leaves = Vec::new();
        // Fronts come first, as in a uniform mesh.
        for parity in 0..2 {
            for side in (parity..self.finest.splits.len()).step_by(2) {
                if self.finest.splits[side] != Split::None {
                    self.descend(self.finest.side_cell(side), &mut leaves);
                }
            }
        }
        leaves
    }

    fn descend(&self, cell: Cell, leaves: &mut Vec<Cell>) {
        if self.is_split(&cell) && self.may_split(&cell) {
            cell.children().into_iter().for_each(|c| self.descend(c, leaves));
        } else {
            leaves.push(cell);
        }
    }

    /// The adaptive mesh whose patches are of those levels, in order; `None` if there is none.
    pub(crate) fn of_levels(finest: Arc<Patches>, levels: &[u8]) -> Option<Patches> {
        let mut me = Self::new(finest, |_| 0);
        let mut levels = levels.iter().copied();
        for whole in me.leaves() {
            me.split_down(whole, levels.next()?, &mut levels)?;
        }
        levels.next().is_none().then(|| me.patches())
    }

    /// Splits a cell until the first of its leaves is of level `first`, and the others of the next
    /// `levels`.
    fn split_down(
        &mut self,
        cell: Cell,
        first: u8,
        levels: &mut impl Iterator<Item = u8>,
    ) -> Option<()> {
        if cell.level == first {
            return Some(());
        }
        if cell.level > first || !self.may_split(&cell) {
            return None;
        }
        let node = self.node(&cell);
        self.split[node] = true;
        let mut first = Some(first);
        for child in cell.children() {
            let level = first.take().or_else(|| levels.next())?;
            self.split_down(child, level, levels)?;
        }
        Some(())
    }

    /// The adaptive mesh.
    #[must_use]
    pub fn patches(&self) -> Patches {
        let finest = &self.finest;
        let cells = self.leaves();
        let mut splits = vec![Split::None; finest.splits.len()];
        let mut patch_of = vec![0; finest.len()];
        let mut areas = Vec::with_capacity(cells.len());
        for (id, cell) in cells.iter().enumerate() {
            let side = side_index(cell.triangle, cell.side);
            let Split::Uniform { first: finest_first, level } = finest.splits[side] else {
                continue;
            };
            splits[side] = match splits[side] {
                Split::Adaptive { first, count, .. } => {
                    Split::Adaptive { first, count: count + 1, level }
                }
                _ => Split::Adaptive { first: id as u32, count: 1, level },
            };
            let parts = 1_u32 << (2 * u32::from(level - cell.level));
            areas.push(finest.areas[finest_first as usize] * f64::from(parts));
            mark(cell, level, &mut |part| {
                patch_of[(finest_first + part.index()) as usize] = id as u32;
            });
        }
        Patches {
            splits,
            cells,
            areas,
            members: Members::default(),
            contacts: finest.contacts.clone(),
            crossed: CrossedPatches::default(),
            fragments: OnceLock::new(),
            origins: std::collections::HashMap::new(),
            finest: Some(Finest { patches: finest.clone(), patch_of }),
        }
    }
}

impl Patches {
    /// The level of each patch of an adaptive mesh, in order: all that tells it from the uniform
    /// mesh that it coarsens.
    pub(crate) fn levels(&self) -> Option<Vec<u8>> {
        self.finest.as_ref().map(|_| self.cells.iter().map(|c| c.level).collect())
    }

    /// The whole of a side that has patches, as a cell.
    fn side_cell(&self, side: usize) -> Cell {
        let first = match self.splits[side] {
            Split::Uniform { first, .. } | Split::Adaptive { first, .. } => first,
            Split::None => 0,
        };
        self.cells[first as usize].ancestor(0)
    }
}

/// Calls `visit` with all cells of level `level` within a cell.
fn mark(cell: &Cell, level: u8, visit: &mut impl FnMut(&Cell)) {
    if cell.level == level {
        visit(cell);
    } else {
        cell.children().iter().for_each(|c| mark(c, level, visit));
    }
}

/// Number of cells of one side at all levels below `level`.
fn nodes_below(level: u8) -> u32 {
    ((1_u64 << (2 * u64::from(level))) / 3) as u32
}
