//! The hierarchy of boxes: a binary tree that splits by the surface area heuristic (MacDonald &
//! Booth 1990), with centroids sorted into bins (Wald 2007, "On fast construction of SAH-based
//! bounding volume hierarchies").

use glam::Vec3;
use rayon::prelude::*;

use super::node::{DEEPEST, INNER, Node};
use crate::visibility::ROUNDING;

/// Boxes are wider by this on all sides.
const MARGIN: f32 = 2.0 * ROUNDING as f32;

/// A leaf has at most this many triangles.
const LARGEST_LEAF: usize = 8;

/// Cost of testing a triangle in units of that of a box.
const TRIANGLE_COST: f32 = 0.7;

/// Bins along each axis.
const BINS: usize = 16;

/// Below this level the triangles are halved by number, so that the tree ends before [`DEEPEST`]:
/// 2³² triangles are 32 levels.
const HALVED_FROM: usize = DEEPEST - 33;

/// Subtrees of at least this many triangles are built in parallel.
const PARALLEL: usize = 4096;

/// A triangle's box and number.
#[derive(Debug, Clone, Copy)]
struct Item {
    low: Vec3,
    high: Vec3,
    index: u32,
}

#[derive(Debug, Clone, Copy)]
struct Bounds {
    low: Vec3,
    high: Vec3,
}

impl Bounds {
    const EMPTY: Self = Self { low: Vec3::INFINITY, high: Vec3::NEG_INFINITY };

    #[inline(always)]
    fn with(self, other: Self) -> Self {
        Self { low: self.low.min(other.low), high: self.high.max(other.high) }
    }

    /// Half the surface.
    #[inline(always)]
    fn area(self) -> f32 {
        let e = self.high - self.low;
        e.x * e.y + e.y * e.z + e.z * e.x
    }
}

impl Item {
    #[inline(always)]
    fn bounds(&self) -> Bounds {
        Bounds { low: self.low, high: self.high }
    }

    /// Twice the centroid of the box.
    #[inline(always)]
    fn middle(&self) -> Vec3 {
        self.low + self.high
    }
}

/// Nodes, the root first (none without triangles), and the numbers of the finite triangles in the
/// order of the leaves.
pub(super) fn hierarchy(
    len: usize,
    corners: impl Fn(usize) -> [Vec3; 3] + Sync,
) -> (Vec<Node>, Vec<u32>) {
    let mut items: Vec<Item> = (0..len)
        .into_par_iter()
        .filter_map(|i| {
            let [a, b, c] = corners(i);
            let item = Item { low: a.min(b).min(c), high: a.max(b).max(c), index: i as u32 };
            // A sum is finite only if all of its terms are.
            ((a + b + c).is_finite()).then_some(item)
        })
        .collect();
    if items.is_empty() {
        return (Vec::new(), Vec::new());
    }
    let mut nodes = vec![Node([0.0; 8]); 2 * items.len() - 1];
    if let Some((root, below)) = nodes.split_first_mut() {
        subtree(&mut items, root, below, Place { node: 1, item: 0, depth: 0 });
    }
    (compact(&nodes), items.iter().map(|i| i.index).collect())
}

/// Where a subtree is.
#[derive(Clone, Copy)]
struct Place {
    /// Index of the first node below its root.
    node: usize,
    /// Index of its first item.
    item: usize,
    depth: usize,
}

/// Builds the subtree of `items`: its root, and the nodes `below` it.
fn subtree(items: &mut [Item], root: &mut Node, below: &mut [Node], at: Place) {
    let (bounds, middles) = extent(items);
    let (low, high) = (bounds.low - MARGIN, bounds.high + MARGIN);
    *root = Node([low.x, low.y, low.z, high.x, high.y, high.z, 0.0, 0.0]);
    let leaf = root.with(at.item as u32, items.len() as u32);
    let split = if at.depth < HALVED_FROM { best_split(items, bounds, middles) } else { None };
    let (axis, left) = match split {
        Some(Choice::Leaf) => {
            *root = leaf;
            return;
        }
        Some(Choice::Split(split)) => (split.axis, partition(items, middles, split)),
        None if items.len() <= LARGEST_LEAF => {
            *root = leaf;
            return;
        }
        None => (halve(items, middles), items.len() / 2),
    };
    *root = root.with(at.node as u32, INNER + axis as u32);
    let (left_items, right_items) = items.split_at_mut(left);
    let [left_root, right_root, below @ ..] = below else { return };
    let (left_below, right_below) = below.split_at_mut(2 * left - 2);
    let depth = at.depth + 1;
    let left_at = Place { node: at.node + 2, item: at.item, depth };
    let right_at = Place { node: at.node + 2 * left, item: at.item + left, depth };
    let parallel = left_items.len() + right_items.len() >= PARALLEL;
    let mut build_left = || subtree(left_items, left_root, left_below, left_at);
    let mut build_right = || subtree(right_items, right_root, right_below, right_at);
    if parallel {
        rayon::join(build_left, build_right);
    } else {
        build_left();
        build_right();
    }
}

/// The box of all items, and that of their middles.
fn extent(items: &[Item]) -> (Bounds, Bounds) {
    let of = |items: &[Item]| {
        items.iter().fold((Bounds::EMPTY, Bounds::EMPTY), |(all, middles), item| {
            let m = item.middle();
            (all.with(item.bounds()), middles.with(Bounds { low: m, high: m }))
        })
    };
    if items.len() < PARALLEL {
        return of(items);
    }
    items
        .par_chunks(PARALLEL)
        .map(of)
        .reduce(|| (Bounds::EMPTY, Bounds::EMPTY), |a, b| (a.0.with(b.0), a.1.with(b.1)))
}

/// Items whose bin along an axis is below `bin` go to the left.
#[derive(Debug, Clone, Copy)]
struct Split {
    axis: usize,
    bin: usize,
}

enum Choice {
    Leaf,
    Split(Split),
}

/// Bins along all axes: boxes and numbers of the items in them.
type Bins = [[(Bounds, u32); BINS]; 3];

/// Bins per length along each axis; 0 along an axis without any.
#[inline(always)]
fn density(middles: Bounds) -> Vec3 {
    let extent = middles.high - middles.low;
    let d = (BINS as f32 * (1.0 - 1e-6)) / extent;
    Vec3::select(d.cmplt(Vec3::MAX), d, Vec3::ZERO)
}

#[inline(always)]
fn bins_of(item: &Item, low: Vec3, density: Vec3) -> [usize; 3] {
    let at = (item.middle() - low) * density;
    [at.x, at.y, at.z].map(|b| (b as usize).min(BINS - 1))
}

/// The cheapest split; `None` if no plane parts the items.
fn best_split(items: &[Item], bounds: Bounds, middles: Bounds) -> Option<Choice> {
    let density = density(middles);
    let count = |items: &[Item]| {
        let mut bins: Bins = [[(Bounds::EMPTY, 0); BINS]; 3];
        for item in items {
            for (bins, b) in bins.iter_mut().zip(bins_of(item, middles.low, density)) {
                bins[b].0 = bins[b].0.with(item.bounds());
                bins[b].1 += 1;
            }
        }
        bins
    };
    let join = |mut a: Bins, b: Bins| {
        for (a, b) in a.as_flattened_mut().iter_mut().zip(b.as_flattened()) {
            *a = (a.0.with(b.0), a.1 + b.1);
        }
        a
    };
    let bins = if items.len() < PARALLEL {
        count(items)
    } else {
        let empty = || [[(Bounds::EMPTY, 0); BINS]; 3];
        items.par_chunks(PARALLEL).map(count).reduce(empty, join)
    };
    let mut best = None;
    let mut least = f32::INFINITY;
    for axis in (0..3).filter(|&a| density[a] > 0.0) {
        let mut right = [0.0; BINS];
        let (mut b, mut n) = (Bounds::EMPTY, 0);
        for k in (1..BINS).rev() {
            b = b.with(bins[axis][k].0);
            n += bins[axis][k].1;
            right[k] = if n == 0 { f32::NAN } else { n as f32 * b.area() };
        }
        (b, n) = (Bounds::EMPTY, 0);
        for k in 1..BINS {
            b = b.with(bins[axis][k - 1].0);
            n += bins[axis][k - 1].1;
            let cost = if n == 0 { f32::NAN } else { n as f32 * b.area() + right[k] };
            if cost < least {
                least = cost;
                best = Some(Split { axis, bin: k });
            }
        }
    }
    let best = best?;
    let leaf = TRIANGLE_COST * items.len() as f32 * bounds.area();
    let split = 2.0 * bounds.area() + TRIANGLE_COST * least;
    let is_leaf = items.len() <= LARGEST_LEAF && leaf <= split;
    Some(if is_leaf { Choice::Leaf } else { Choice::Split(best) })
}

/// Brings the items of the left to the front; returns their number.
fn partition(items: &mut [Item], middles: Bounds, split: Split) -> usize {
    let density = density(middles);
    let mut left = 0;
    for i in 0..items.len() {
        if bins_of(&items[i], middles.low, density)[split.axis] < split.bin {
            items.swap(left, i);
            left += 1;
        }
    }
    left
}

/// Sorts the items into two halves along the longest axis, which it returns.
fn halve(items: &mut [Item], middles: Bounds) -> usize {
    let axis = (middles.high - middles.low).max_position();
    let half = items.len() / 2;
    items.select_nth_unstable_by(half, |a, b| {
        a.middle()[axis].total_cmp(&b.middle()[axis]).then(a.index.cmp(&b.index))
    });
    axis
}

/// The nodes that are used, each pair of children before the pairs below it.
fn compact(nodes: &[Node]) -> Vec<Node> {
    let mut kept = Vec::with_capacity(nodes.len() / 2 + 1);
    kept.push(nodes[0]);
    // Nodes of `kept` whose children are not.
    let mut open = vec![0];
    while let Some(at) = open.pop() {
        let node: Node = kept[at];
        if node.kind() >= INNER {
            let first = kept.len();
            kept[at] = node.with(first as u32, node.kind());
            kept.extend_from_slice(&nodes[node.first() as usize..][..2]);
            open.extend([first + 1, first]);
        }
    }
    kept.shrink_to_fit();
    kept
}
