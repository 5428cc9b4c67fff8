//! The exchange of all pairs between two tiles.
//!
//! From the pair of tiles down to pairs of leaves, blockers that do nothing are dropped on the way;
//! where none is left, or one hides all, no pair is looked at on its own.

use std::ops::Range;

use super::far::{CLOSELY, exchange_with};
use super::model::Model;
use super::probes::{Asked, Probes, group_of};
use super::samples::MOST_RAYS;
use super::shaft::{Between, Shaft, face_away, relation};
use super::tree::{Node, TILE};
use super::unoccluded::{exchange, facing};
use super::visible::{Pair, Room, Visible};
use crate::visibility::{LANES, Lanes};

/// Spreads the bits of a seed over those of pairs.
const SEED: u64 = 0xd134_2543_de82_ef95;

/// What is known of the blockers between two patches of the tiles.
const HIDDEN: u16 = 0;
const SEEN: u16 = 1;
/// So much may lie between that rays are to tell.
const CROWDED: u16 = 2;
/// From here on: the number of a list of blockers.
const LISTS: u16 = 3;

/// More blockers are a crowd.
const CROWD: usize = 64;

/// Crowds are not sorted out any more between so many pairs of patches.
const FEW_PAIRS: usize = 64;

/// To sort out a blocker once takes as long as so many shadow rays; that is worth it up to the rays of
/// pairs of this factor, over what factors are like.
const SORTING: f64 = 64.0;
const WORTH_SORTING: f64 = 0.1;

/// A pair is left to rays if their number is not more than its blockers and this: clipping is exact.
const CLIPPING: u32 = 4;

/// Shadow rays of a pair of the root-mean-square factor at the error 1e-3. Rays are stratified: their
/// error falls faster than the root of their number.
const RAYS: f64 = 640.0;
const RAYS_BY_ERROR: f64 = 1.5;

/// Patches that straddle each other's plane are clipped if their factor is larger than this share of
/// the root-mean-square factor, times the error asked for: the far rule errs by some percent of it.
const STRADDLING: f64 = 100.0;

/// Work on a pair of tiles; reused.
pub(super) struct Work {
    /// [`TILE`] a row.
    class: Vec<u16>,
    /// Blockers of each pair of leaves in part hidden.
    lists: Vec<u32>,
    /// Where each list begins, and where the last ends.
    starts: Vec<u32>,
    /// Blockers on the way down.
    pending: Vec<u32>,
    shaft: Shaft,
    row: [Lanes; TILE / LANES],
    probes: Probes,
    room: Room,
    pub counts: Counts,
}

/// What was done.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Counts {
    /// Pairs that exchange anything.
    pub pairs: u64,
    /// Pairs with possible blockers.
    pub partly: u64,
    /// Shadow rays.
    pub rays: u64,
    /// Sum of the squares of the factors both ways, and of their errors, over the square of what
    /// factors are like, in units of 2⁻³²: sums of integers do not depend on their order.
    pub squares: u128,
    pub errors: u128,
    /// Of the latter that of rays which neighbouring pairs share.
    pub ray_errors: u128,
}

/// A sum of squares as [`Counts`] keep it.
fn fixed(sum: f64) -> u128 {
    (sum * 4_294_967_296.0) as u128
}

/// The sum that [`Counts`] keep, over the square of what factors are like.
pub(super) fn unfixed(sum: u128) -> f64 {
    sum as f64 / 4_294_967_296.0
}

impl Counts {
    pub fn and(self, other: Self) -> Self {
        Self {
            pairs: self.pairs + other.pairs,
            partly: self.partly + other.partly,
            rays: self.rays + other.rays,
            squares: self.squares.saturating_add(other.squares),
            errors: self.errors.saturating_add(other.errors),
            ray_errors: self.ray_errors.saturating_add(other.ray_errors),
        }
    }
}

impl Default for Work {
    fn default() -> Self {
        Self {
            class: Vec::new(),
            lists: Vec::new(),
            starts: Vec::new(),
            pending: Vec::new(),
            shaft: Shaft::default(),
            row: [[0.0; LANES]; TILE / LANES],
            probes: Probes::default(),
            room: Room::default(),
            counts: Counts::default(),
        }
    }
}

/// What adds up over the pairs of two tiles.
struct Sums<'a> {
    model: &'a Model<'a>,
    pairs: u64,
    partly: u64,
    square: f64,
    error: f64,
    ray_error: f64,
}

impl Sums<'_> {
    /// Takes in a pair that exchanges `s` m², with the square of the error of that if it is hidden in
    /// part, and hands it on.
    #[inline]
    fn add(
        &mut self,
        i: usize,
        j: usize,
        s: f64,
        error: Option<f64>,
        each: &mut impl FnMut(usize, usize, f32),
    ) {
        let [a, b] = [i, j].map(|k| self.model.areas[k]);
        let kept = down(s.min(a).min(b).max(0.0));
        let both = 1.0 / (a * a) + 1.0 / (b * b);
        self.square += both * f64::from(kept) * f64::from(kept);
        self.error += both * error.unwrap_or(0.0);
        if kept > 0.0 {
            self.pairs += 1;
            self.partly += u64::from(error.is_some());
            each(i, j, kept);
        }
    }

    fn counts(&self) -> Counts {
        let unit = self.model.typical * self.model.typical;
        Counts {
            pairs: self.pairs,
            partly: self.partly,
            squares: fixed(self.square / unit),
            errors: fixed(self.error / unit),
            ray_errors: fixed(self.ray_error / unit),
            ..Counts::default()
        }
    }
}

/// How pairs are evaluated.
pub(super) struct Task<'a> {
    pub model: &'a Model<'a>,
    pub error: f64,
    /// How many times more rays than usual pairs get.
    pub scale: f64,
    pub seed: u32,
    /// Patches whose pairs alone are asked for, by their places in the order of the tree.
    pub wanted: Option<&'a [bool]>,
}

impl Task<'_> {
    /// Whether pairs between two runs of patches, or others traced together with them, are wanted.
    fn wants(&self, rows: Range<u32>, columns: Range<u32>) -> bool {
        let Some(wanted) = self.wanted else { return true };
        let any = |from: usize, to: usize| wanted[from..to.min(wanted.len())].iter().any(|&w| w);
        let last = columns.end.max(columns.start + 1) - 1;
        any(rows.start as usize, rows.end as usize)
            || any(group_of(columns.start as usize).start, group_of(last as usize).end)
    }

    /// Number of pairs that are wanted, with those that are traced together with them.
    pub fn pairs(&self) -> u64 {
        let n = self.model.len() as u32;
        let (mut after, mut sum) = (0, 0);
        for at in (0..n).rev() {
            let all = self.wanted.is_none_or(|w| w[at as usize]);
            sum += u64::from(if all { n - 1 - at } else { after });
            after += u32::from(self.wants(at..at, at..at + 1));
        }
        sum
    }

    /// Hands over `(i, j, S)` of all pairs i < j (places in the order of the tree) of tiles `a` and `b`
    /// (nodes, a not after b), by rows, S > 0 in m².
    pub fn tile(&self, a: u32, b: u32, work: &mut Work, mut each: impl FnMut(usize, usize, f32)) {
        let [rows, columns] = [a, b].map(|n| &self.model.tree.nodes[n as usize]);
        work.class.clear();
        work.class.resize(TILE * TILE, HIDDEN);
        work.lists.clear();
        work.starts.clear();
        work.starts.push(0);
        work.pending.clear();
        work.shaft.between(rows, columns);
        let Work { shaft, pending, .. } = work;
        self.model.blocker_tree.near(shaft, |q| pending.push(q));
        let count = work.pending.len();
        self.descend([a, b], [rows.from, columns.from], 0..count, work);
        let scale2 = self.model.bvh.scale().powi(2);
        let mut sums = Sums {
            model: self.model,
            pairs: 0,
            partly: 0,
            square: 0.0,
            error: 0.0,
            ray_error: 0.0,
        };
        for r in rows.from as usize..rows.to as usize {
            let class = &work.class[(r - rows.from as usize) * TILE..][..TILE];
            let first = if a == b { r + 1 } else { columns.from as usize };
            let end = columns.to as usize;
            if first >= end || class[first - columns.from as usize..].iter().all(|&c| c == HIDDEN) {
                continue;
            }
            if !self.wants(r as u32..r as u32 + 1, first as u32..end as u32) {
                continue;
            }
            let blocks = (end - first).div_ceil(LANES);
            exchange_with(&self.model.columns, r, first, &mut work.row[..blocks]);
            work.probes.asked.clear();
            let class =
                &work.class[(r - rows.from as usize) * TILE + first - columns.from as usize..];
            for ((c, &s), &class) in (first..end).zip(work.row.as_flattened()).zip(class) {
                let pair = (r as u32..r as u32 + 1, c as u32..c as u32 + 1);
                if s == 0.0 || class == HIDDEN || !self.wants(pair.0, pair.1) {
                    continue;
                }
                let rough = f64::from(s.abs()) * scale2;
                if s > 0.0 && class == SEEN {
                    sums.add(r, c, rough, None, &mut each);
                    continue;
                }
                let between = match class {
                    SEEN => Some(&[][..]),
                    CROWDED => None,
                    list => {
                        let k = usize::from(list - LISTS);
                        Some(&work.lists[work.starts[k] as usize..work.starts[k + 1] as usize])
                    }
                };
                let factor = self.factor(r, c, rough);
                let known = s > 0.0 || s != CLOSELY && factor <= STRADDLING * self.error;
                if known && class == SEEN {
                    sums.add(r, c, rough, None, &mut each);
                    continue;
                }
                let rays = self.rays(factor);
                let simple = self.model.is_simple(r) && self.model.is_simple(c);
                if s != CLOSELY && (left_to_rays(between, rays) || known && !simple) {
                    let rays = (self.scale * f64::from(rays)).clamp(1.0, MOST_RAYS as f64);
                    work.probes.asked.push(Asked::new(c, rough, rays as u32));
                    continue;
                }
                let known = (s > 0.0 && simple).then_some(rough);
                let (s, error) = self.closely(r, c, known, between, &mut work.room);
                sums.add(r, c, s, (class != SEEN).then_some(error), &mut each);
            }
            work.probes.trace(self.model, r, self.seed);
            let before = sums.error;
            for (asked, share, error) in work.probes.shares() {
                let s = asked.exchange;
                sums.add(r, asked.column as usize, s * share, Some(s * s * error), &mut each);
            }
            sums.ray_error += sums.error - before;
        }
        work.counts = work.counts.and(sums.counts());
        work.counts.rays += std::mem::take(&mut work.room.rays);
        work.counts.rays += std::mem::take(&mut work.probes.count);
    }

    /// The larger factor of a pair that exchanges S m², over what factors are like.
    fn factor(&self, i: usize, j: usize, s: f64) -> f64 {
        s / self.model.areas[i].min(self.model.areas[j]) / self.model.typical
    }

    /// Shadow rays that a pair usually deserves, at least one.
    fn rays(&self, factor: f64) -> u32 {
        let rays = RAYS * factor * (1e-3 / self.error).powf(RAYS_BY_ERROR);
        rays.clamp(1.0, MOST_RAYS as f64) as u32
    }

    /// S of one pair, 0 if it exchanges nothing, and the square of its error; `known` unoccluded, if it
    /// is. Without a list of blockers rays tell.
    fn closely(
        &self,
        i: usize,
        j: usize,
        known: Option<f64>,
        blockers: Option<&[u32]>,
        room: &mut Room,
    ) -> (f64, f64) {
        let model = self.model;
        let (mut sum, mut error) = (0.0, 0.0);
        for p in model.pieces(i) {
            for q in model.pieces(j) {
                let polygons = match known {
                    Some(_) => (p.polygon, q.polygon),
                    None => match facing(&p.polygon, &q.polygon, model.coplanar) {
                        Some(parts) => parts,
                        None => continue,
                    },
                };
                let s = known.unwrap_or_else(|| exchange(&polygons.0, &polygons.1));
                if s <= 0.0 {
                    continue;
                }
                let v = if blockers.is_some_and(<[u32]>::is_empty) {
                    Visible::ALL
                } else {
                    let factor = self.factor(i, j, s);
                    let pair = Pair {
                        pieces: [p, q],
                        polygons: polygons.into(),
                        blockers,
                        effort: 0.5 * factor * (1e-3 / self.error),
                        exchange: s,
                        seed: u64::from(self.seed).wrapping_mul(SEED) ^ (i as u64) << 32 ^ j as u64,
                    };
                    pair.visible(model, room)
                };
                sum += s * v.share;
                error += s * s * v.error;
            }
        }
        (sum, error)
    }

    /// Sorts out the blockers `given` (a range of the pending ones) between two nodes; `origin` is
    /// where their tiles begin.
    fn descend(&self, nodes: [u32; 2], origin: [u32; 2], given: Range<usize>, work: &mut Work) {
        let tree = &self.model.tree;
        let [a, b] = nodes.map(|n| &tree.nodes[n as usize]);
        if !self.wants(a.from..a.to, b.from..b.to) {
            return;
        }
        let flat = nodes[0] == nodes[1] && a.plane.is_some();
        if flat || face_away(a, b, self.model.coplanar) {
            return;
        }
        work.shaft.between(a, b);
        let from = work.pending.len();
        let closely = a.is_leaf() && b.is_leaf() && given.len() <= CROWD / 2;
        for k in given {
            let q = work.pending[k];
            let blocker = &self.model.blockers.polygons[q as usize];
            match relation(blocker, &work.shaft, [a, b], closely, self.model.touching) {
                Between::Nothing => {}
                Between::Something => work.pending.push(q),
                Between::Everything => {
                    work.pending.truncate(from);
                    return;
                }
            }
        }
        let to = work.pending.len();
        if from == to {
            self.mark(nodes, origin, SEEN, work);
        } else if self.is_crowd(to - from, a, b) {
            self.mark(nodes, origin, CROWDED, work);
        } else if a.is_leaf() && b.is_leaf() {
            let list = usize::from(LISTS) + work.starts.len() - 1;
            work.lists.extend_from_slice(&work.pending[from..to]);
            work.starts.push(work.lists.len() as u32);
            self.mark(nodes, origin, list as u16, work);
        } else if nodes[0] == nodes[1] {
            for (x, y) in [(0, 0), (0, 1), (1, 1)] {
                self.descend([a.child + x, a.child + y], origin, from..to, work);
            }
        } else if a.split_before(b) {
            for k in 0..2 {
                self.descend([a.child + k, nodes[1]], origin, from..to, work);
            }
        } else {
            for k in 0..2 {
                self.descend([nodes[0], b.child + k], origin, from..to, work);
            }
        }
        work.pending.truncate(from);
    }

    /// Whether rays tell sooner than sorting out so many blockers.
    fn is_crowd(&self, blockers: usize, a: &Node, b: &Node) -> bool {
        let rays = self.rays((a.factor(b) / self.model.typical).min(WORTH_SORTING));
        let pairs = (a.len() * b.len()) as f64;
        let never_clipped = blockers > CROWD && a.len() * b.len() <= FEW_PAIRS;
        never_clipped || blockers as f64 * SORTING > f64::from(rays) * pairs
    }

    fn mark(&self, nodes: [u32; 2], origin: [u32; 2], class: u16, work: &mut Work) {
        let [a, b] = nodes.map(|n| &self.model.tree.nodes[n as usize]);
        for r in a.from - origin[0]..a.to - origin[0] {
            let row = &mut work.class[r as usize * TILE..];
            row[(b.from - origin[1]) as usize..(b.to - origin[1]) as usize].fill(class);
        }
    }
}

/// Whether rays tell sooner than clipping what lies between.
fn left_to_rays(between: Option<&[u32]>, rays: u32) -> bool {
    between.is_none_or(|list| !list.is_empty() && rays <= CLIPPING + list.len() as u32)
}

/// Single precision of what is not negative, rounded towards zero.
pub(super) fn down(x: f64) -> f32 {
    let y = x as f32;
    // The number before a positive one has the bits before its own.
    f32::from_bits(y.to_bits() - u32::from(f64::from(y) > x))
}
