//! What lies between the patches of two tiles.
//!
//! From the pair of tiles down to pairs of leaves, blockers that hide nothing are dropped on the
//! way; where none is left, or one hides everything, no pair is looked at on its own.

use std::ops::Range;

use super::blockers::BlockerId;
use super::culling::{Region, Some16};
use super::effort::{CROWD, Effort};
use super::model::Model;
use super::places::{NodeId, Place, Places, Wanted};
use super::shaft::{Look, Occlusion, Shaft, face_away, occlusion};
use super::tree::{Node, TILE};

/// What is known of the blockers between two patches.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Sight(u16);

impl Sight {
    /// They do not see each other.
    pub const HIDDEN: Self = Self(0);
    /// Nothing lies between them.
    pub const CLEAR: Self = Self(1);
    /// So many blockers may lie between them that rays are to tell.
    const CROWDED: Self = Self(2);
    /// From here on: the number of a list of blockers.
    const LISTS: u16 = 3;
}

/// What is known between all patches of two tiles; reused.
#[derive(Default)]
pub(super) struct Sights {
    /// [`TILE`] a row.
    of_pairs: Vec<Sight>,
    /// Blockers of each pair of leaves that is partly hidden.
    lists: Vec<BlockerId>,
    /// Where each list begins, and where the last ends.
    starts: Vec<usize>,
    /// Blockers on the way down.
    pending: Vec<Some16>,
    shaft: Shaft,
    region: Region,
}

/// Between what blockers are sorted out, and how thoroughly.
pub(super) struct Sorting<'a> {
    pub model: &'a Model<'a>,
    pub effort: Effort,
    pub wanted: Wanted<'a>,
    /// The patches of both tiles.
    pub tiles: [Places; 2],
}

impl Sights {
    /// Sorts out what lies between two tiles, given by their nodes.
    pub fn find(&mut self, sorting: &Sorting<'_>, nodes: [NodeId; 2]) {
        self.of_pairs.clear();
        self.of_pairs.resize(TILE * TILE, Sight::HIDDEN);
        self.lists.clear();
        self.starts.clear();
        self.starts.push(0);
        self.pending.clear();
        let model = sorting.model;
        let [a, b] = nodes.map(|n| model.tree.node(n));
        self.shaft.between(a, b);
        let Self { shaft, pending, region, .. } = self;
        shaft.set(region, [a, b], model.bvh);
        model.culling.between(region, |some| pending.push(some));
        self.descend(sorting, nodes, 0..self.pending.len());
    }

    /// What is known between the patch `row` places after the first of one tile, and those of the
    /// other.
    pub fn row(&self, row: usize) -> &[Sight] {
        &self.of_pairs[row * TILE..][..TILE]
    }

    /// Possible blockers between two patches; `None` for a crowd of them.
    pub fn blockers(&self, sight: Sight) -> Option<&[BlockerId]> {
        match sight {
            Sight::HIDDEN | Sight::CLEAR => Some(&[]),
            Sight::CROWDED => None,
            Sight(list) => {
                let k = usize::from(list - Sight::LISTS);
                Some(&self.lists[self.starts[k]..self.starts[k + 1]])
            }
        }
    }

    /// Sorts out the blockers `given` (a range of the pending ones) between two nodes.
    fn descend(&mut self, sorting: &Sorting<'_>, nodes: [NodeId; 2], given: Range<usize>) {
        let model = sorting.model;
        let [a, b] = nodes.map(|n| model.tree.node(n));
        if !sorting.wanted.has(a.places, b.places) {
            return;
        }
        let same = nodes[0] == nodes[1];
        if same && a.plane.is_some() || face_away(a, b, model.coplanar) {
            return;
        }
        self.shaft.between(a, b);
        self.shaft.set(&mut self.region, [a, b], model.bvh);
        let from = self.pending.len();
        for k in given {
            let Self { pending, region, .. } = self;
            let some = pending[k];
            model.culling.of_block(some, region, &mut |some| pending.push(some));
        }
        let (leaves, count) = (a.is_leaf() && b.is_leaf(), self.count(from));
        let look = match leaves {
            true if count <= CROWD / 2 => Look::Closely,
            false if count > CROWD => Look::Large,
            _ => Look::All,
        };
        if self.drop_what_hides_nothing(model, [a, b], look, from) {
            self.pending.truncate(from);
            return;
        }
        let left = from..self.pending.len();
        let crowded = || {
            let factor = a.factor(b) / model.rms_factor;
            let pairs = a.places.len() * b.places.len();
            sorting.effort.is_crowd(self.count(from), pairs, factor)
        };
        let places = [a.places, b.places];
        if left.is_empty() {
            self.mark(sorting, places, Sight::CLEAR);
        } else if crowded() {
            self.mark(sorting, places, Sight::CROWDED);
        } else if leaves {
            let list = Sight::LISTS + (self.starts.len() - 1) as u16;
            let ids = |&some| model.culling.members(some).map(|(_, q)| q);
            self.lists.extend(self.pending[left].iter().flat_map(ids));
            self.starts.push(self.lists.len());
            self.mark(sorting, places, Sight(list));
        } else if let (true, Some([x, y])) = (same, a.children) {
            for pair in [[x, x], [x, y], [y, y]] {
                self.descend(sorting, pair, left.clone());
            }
        } else if let (true, Some(children)) = (a.split_before(b), a.children) {
            for child in children {
                self.descend(sorting, [child, nodes[1]], left.clone());
            }
        } else {
            for child in b.children.into_iter().flatten() {
                self.descend(sorting, [nodes[0], child], left.clone());
            }
        }
        self.pending.truncate(from);
    }

    /// How many blockers are pending, from a place in the list on.
    fn count(&self, from: usize) -> usize {
        self.pending[from..].iter().map(|some| some.len()).sum()
    }

    /// Drops from the pending blockers what hides nothing between two nodes; returns whether one of
    /// them hides all.
    fn drop_what_hides_nothing(
        &mut self,
        model: &Model<'_>,
        nodes: [&Node; 2],
        look: Look,
        from: usize,
    ) -> bool {
        let mut kept = from;
        for k in from..self.pending.len() {
            let mut some = self.pending[k];
            for (lane, q) in model.culling.members(some) {
                let blocker = model.blockers.polygon(q);
                match occlusion(blocker, &self.shaft, nodes, look, model.touching) {
                    Occlusion::None => some.drop(lane),
                    Occlusion::Partial => {}
                    Occlusion::Complete => return true,
                }
            }
            if some.len() > 0 {
                self.pending[kept] = some;
                kept += 1;
            }
        }
        self.pending.truncate(kept);
        false
    }

    fn mark(&mut self, sorting: &Sorting<'_>, [rows, columns]: [Places; 2], sight: Sight) {
        let offset = |tile: usize, at: Place| sorting.tiles[tile].offset(at);
        let first = offset(1, columns.first());
        for row in rows.iter() {
            let row = &mut self.of_pairs[offset(0, row) * TILE..];
            row[first..first + columns.len()].fill(sight);
        }
    }
}
