//! Which blockers may lie between two things: 16 of them are tested at a time, down a tree of boxes
//! 16 wide.
//!
//! Single precision only tells what certainly lies elsewhere, so what comes out does not depend on
//! its rounding where a closer look follows.

#![allow(clippy::needless_range_loop, reason = "loops over lanes, which become vectors")]

use glam::{DVec3, Vec3};

use super::blockers::{Blocker, BlockerId};
use super::tree::rectangle;
use crate::scene::box_tree::BoxTree;
use crate::simd::{LANES, multiversion};
use crate::visibility::{Bvh, Lanes};

/// Distances below this fraction of the scene's radius are none to single precision.
const NOISE: f32 = 1e-6;

/// Most corners of a blocker that are looked at; of one with more, those of a rectangle about it.
const CORNERS: usize = 4;

/// All blockers, in units of the scene's radius about its centre.
#[derive(Debug, Default)]
pub(super) struct Culling {
    ids: Vec<BlockerId>,
    /// 16 blockers each, in the order of `ids`.
    blocks: Vec<Block>,
    /// 16 boxes each, about blocks and then about groups of those before.
    levels: Vec<Vec<Boxes>>,
}

/// 16 boxes.
#[derive(Debug, Clone)]
#[repr(align(64))]
struct Boxes {
    low: [Lanes; 3],
    high: [Lanes; 3],
}

/// 16 blockers.
#[derive(Debug, Clone)]
#[repr(align(64))]
struct Block {
    boxes: Boxes,
    corners: [[Lanes; 3]; CORNERS],
    /// Unit normals and offsets of their planes.
    plane: [Lanes; 4],
}

/// A convex region between two things: a box, and planes about it, each an outward unit normal and
/// an offset; and the corners of both things.
#[derive(Debug, Default)]
pub(super) struct Region {
    low: Vec3,
    high: Vec3,
    planes: Vec<[f32; 4]>,
    ends: Vec<Vec3>,
}

/// Some of a block of blockers, one bit each.
#[derive(Debug, Clone, Copy)]
pub(super) struct Some16 {
    block: u32,
    mask: u16,
}

impl Some16 {
    pub fn len(self) -> usize {
        self.mask.count_ones() as usize
    }

    /// Leaves out the one in a lane.
    pub fn drop(&mut self, lane: usize) {
        self.mask &= !(1 << lane);
    }
}

impl Region {
    /// Sets the region to a box, to the planes about it and to the corners of the things at its
    /// ends, all in metres.
    pub fn set<'a>(
        &mut self,
        bvh: &Bvh,
        (low, high): (DVec3, DVec3),
        planes: impl Iterator<Item = (DVec3, f64)>,
        ends: impl Iterator<Item = &'a DVec3>,
    ) {
        (self.low, self.high) = (bvh.local(low) - NOISE, bvh.local(high) + NOISE);
        let (centre, inverse) = (bvh.center(), 1.0 / bvh.scale());
        self.planes.clear();
        self.planes.extend(planes.filter_map(|(normal, offset)| {
            let length = normal.length();
            let n = normal.as_vec3() / length as f32;
            let unit = 1.0 / length;
            let offset = (offset - normal.dot(centre)) * unit * inverse;
            n.is_finite().then_some([n.x, n.y, n.z, offset as f32 + NOISE])
        }));
        self.ends.clear();
        self.ends.extend(ends.map(|&p| bvh.local(p)));
    }
}

impl Culling {
    /// Arranges blockers in the order of a tree of the boxes about them.
    pub fn new(polygons: &[Blocker], tree: &BoxTree, bvh: &Bvh) -> Self {
        let ids: Vec<BlockerId> = tree.order().iter().map(|&k| BlockerId(k)).collect();
        let mut me = Self::default();
        for ids in ids.chunks(LANES) {
            let mut block = Block::EMPTY;
            for (l, id) in ids.iter().enumerate() {
                block.set(l, &polygons[id.index()], bvh);
            }
            me.blocks.push(block);
        }
        let mut boxes: Vec<[Vec3; 2]> = me.blocks.iter().map(|b| b.boxes.about()).collect();
        while !boxes.is_empty() {
            let level: Vec<Boxes> = boxes.chunks(LANES).map(Boxes::of).collect();
            boxes = level.iter().map(Boxes::about).collect();
            let last = level.len() == 1;
            me.levels.push(level);
            if last {
                break;
            }
        }
        me.ids = ids;
        me
    }

    /// About how many bytes of memory it takes.
    pub fn bytes(&self) -> usize {
        self.blocks.len() * (size_of::<Block>() + size_of::<Boxes>() / 15)
    }

    /// Hands over all blockers that may lie between the ends of a region, in a fixed order.
    pub fn between(&self, region: &Region, mut each: impl FnMut(Some16)) {
        if let Some(top) = self.levels.len().checked_sub(1) {
            self.descend(top, 0, region, &mut each);
        }
    }

    fn descend(&self, level: usize, at: usize, region: &Region, each: &mut impl FnMut(Some16)) {
        let mut mask = 0;
        meets(&self.levels[level][at], region, &mut mask);
        for l in lanes(mask) {
            let child = at * LANES + l;
            if level > 0 {
                self.descend(level - 1, child, region, each);
            } else {
                self.of_block(Some16 { block: child as u32, mask: u16::MAX }, region, each);
            }
        }
    }

    /// Hands over those of a block that may lie between the ends of a region.
    pub fn of_block(&self, some: Some16, region: &Region, each: &mut impl FnMut(Some16)) {
        let mut mask = 0;
        may_hide(&self.blocks[some.block as usize], region, &mut mask);
        let mask = mask & some.mask;
        if mask != 0 {
            each(Some16 { mask, ..some });
        }
    }

    /// Some of a block, one by one, each with its lane.
    pub fn members(&self, some: Some16) -> impl Iterator<Item = (usize, BlockerId)> + '_ {
        let first = some.block as usize * LANES;
        lanes(some.mask).map(move |l| (l, self.ids[first + l]))
    }
}

/// The numbers of the bits that are set.
fn lanes(mask: u16) -> impl Iterator<Item = usize> {
    let mut left = mask;
    std::iter::from_fn(move || {
        let next = (left != 0).then(|| left.trailing_zeros() as usize)?;
        left &= left - 1;
        Some(next)
    })
}

impl Boxes {
    /// What no box meets.
    const EMPTY: Self =
        Self { low: [[f32::INFINITY; LANES]; 3], high: [[f32::NEG_INFINITY; LANES]; 3] };

    fn of(boxes: &[[Vec3; 2]]) -> Self {
        let mut me = Self::EMPTY;
        boxes.iter().enumerate().for_each(|(l, &b)| me.set(l, b));
        me
    }

    fn set(&mut self, l: usize, [low, high]: [Vec3; 2]) {
        for axis in 0..3 {
            (self.low[axis][l], self.high[axis][l]) = (low[axis], high[axis]);
        }
    }

    /// The box about all.
    fn about(&self) -> [Vec3; 2] {
        let least = |v: &Lanes| v.iter().copied().fold(f32::INFINITY, f32::min);
        let most = |v: &Lanes| v.iter().copied().fold(f32::NEG_INFINITY, f32::max);
        [Vec3::from(self.low.each_ref().map(least)), Vec3::from(self.high.each_ref().map(most))]
    }
}

impl Block {
    const EMPTY: Self = Self {
        boxes: Boxes::EMPTY,
        corners: [[[0.0; LANES]; 3]; CORNERS],
        plane: [[0.0; LANES]; 4],
    };

    fn set(&mut self, l: usize, q: &Blocker, bvh: &Bvh) {
        self.boxes.set(l, [q.low, q.high].map(|p| bvh.local(p)));
        let corners: [DVec3; CORNERS] = match q.corners[..] {
            [a, b, c] => [a, b, c, c],
            [a, b, c, d] => [a, b, c, d],
            [a, b, ..] => rectangle(&q.corners, q.normal, b - a),
            _ => [q.low; CORNERS],
        };
        for (to, corner) in self.corners.iter_mut().zip(corners) {
            let corner = bvh.local(corner);
            (0..3).for_each(|axis| to[axis][l] = corner[axis]);
        }
        let offset = (q.offset - q.normal.dot(bvh.center())) / bvh.scale();
        let normal = q.normal.as_vec3();
        let plane = [normal.x, normal.y, normal.z, offset as f32];
        (0..4).for_each(|k| self.plane[k][l] = plane[k]);
    }
}

multiversion! {
    /// Sets the bits of the boxes that a region may meet.
    fn meets(boxes: &Boxes, region: &Region, mask: &mut u16) = meets_kernel
}

#[inline(always)]
fn meets_kernel(boxes: &Boxes, region: &Region, mask: &mut u16) {
    let mut out = beyond(boxes, region);
    let Boxes { low, high } = boxes;
    for &[x, y, z, offset] in &region.planes {
        // The corner that is farthest inside.
        let pick = |n: f32, axis: usize| if n > 0.0 { &low[axis] } else { &high[axis] };
        let (px, py, pz) = (pick(x, 0), pick(y, 1), pick(z, 2));
        for l in 0..LANES {
            let height = x * px[l] + y * py[l] + z * pz[l] - offset;
            out[l] = if height > out[l] { height } else { out[l] };
        }
    }
    *mask = not_above(&out);
}

/// How far boxes lie outside of the box of a region.
#[inline(always)]
fn beyond(boxes: &Boxes, region: &Region) -> Lanes {
    let mut out = [f32::NEG_INFINITY; LANES];
    for axis in 0..3 {
        let (low, high) = (&boxes.low[axis], &boxes.high[axis]);
        let (from, to) = (region.low[axis], region.high[axis]);
        for l in 0..LANES {
            let (above, below) = (low[l] - to, from - high[l]);
            let way = if above > below { above } else { below };
            out[l] = if way > out[l] { way } else { out[l] };
        }
    }
    out
}

/// The bits of numbers that are not above 0.
#[inline(always)]
fn not_above(out: &Lanes) -> u16 {
    let mut bits = 0_u32;
    for l in 0..LANES {
        bits |= if out[l] > 0.0 { 0 } else { 1 << l };
    }
    bits as u16
}

multiversion! {
    /// Sets the bits of the blockers that may lie between the ends of a region.
    fn may_hide(block: &Block, region: &Region, mask: &mut u16) = may_hide_kernel
}

#[inline(always)]
fn may_hide_kernel(block: &Block, region: &Region, mask: &mut u16) {
    let mut out = beyond(&block.boxes, region);
    *mask = not_above(&out);
    if *mask == 0 {
        return;
    }
    // Both ends on one side of its plane.
    let [nx, ny, nz, offset] = &block.plane;
    let (mut least, mut most) = ([f32::INFINITY; LANES], [f32::NEG_INFINITY; LANES]);
    for end in &region.ends {
        for l in 0..LANES {
            let height = nx[l] * end.x + ny[l] * end.y + nz[l] * end.z - offset[l];
            least[l] = if height < least[l] { height } else { least[l] };
            most[l] = if height > most[l] { height } else { most[l] };
        }
    }
    for l in 0..LANES {
        let way = if least[l] > -most[l] { least[l] } else { -most[l] };
        out[l] = if way - NOISE > out[l] { way - NOISE } else { out[l] };
    }
    *mask = not_above(&out);
    for &[x, y, z, offset] in &region.planes {
        if *mask == 0 {
            return;
        }
        let mut least = [f32::INFINITY; LANES];
        for [cx, cy, cz] in &block.corners {
            for l in 0..LANES {
                let height = x * cx[l] + y * cy[l] + z * cz[l] - offset;
                least[l] = if height < least[l] { height } else { least[l] };
            }
        }
        for l in 0..LANES {
            out[l] = if least[l] > out[l] { least[l] } else { out[l] };
        }
        *mask = not_above(&out);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::builtin;
    use crate::simd::{Version, WIDEST};

    /// Polygons of many sizes.
    fn scene() -> (Vec<Blocker>, Bvh) {
        let g = builtin::build("room").unwrap().geometry;
        let bvh = Bvh::new(&g);
        (super::super::blockers::Blockers::new(&g, 1e-6).polygons, bvh)
    }

    /// The segment between two points, as a region.
    fn about(region: &mut Region, bvh: &Bvh, [a, b]: [DVec3; 2]) {
        region.set(bvh, (a.min(b), a.max(b)), std::iter::empty(), [a, b].iter());
    }

    #[test]
    fn what_blocks_a_segment_is_always_handed_over_and_only_once() {
        let (polygons, bvh) = scene();
        let boxes: Vec<_> = polygons.iter().map(|p| (p.low, p.high)).collect();
        let culling = Culling::new(&polygons, &BoxTree::new(&boxes), &bvh);
        let blocks = |q: &Blocker, [a, b]: [DVec3; 2]| {
            let (ha, hb) = (q.height(a), q.height(b));
            let at = a + (b - a) * (ha / (ha - hb));
            let inside = (0..q.corners.len()).all(|k| {
                let (u, v) = (q.corners[k], q.corners[(k + 1) % q.corners.len()]);
                q.normal.cross(v - u).dot(at - u) > 0.0
            });
            ha * hb < 0.0 && inside
        };
        let (mut region, mut blocked, mut handed) = (Region::default(), 0, 0);
        for k in 0..2000_u32 {
            let random = |n: u32| {
                let x = k.wrapping_mul(747_796_405).wrapping_add(n).wrapping_mul(2_891_336_453);
                f64::from(x >> 8) / f64::from(1 << 24) * 2.0 - 1.0
            };
            let end = |n: u32| {
                bvh.center() + DVec3::new(random(n), random(n + 1), random(n + 2)) * bvh.scale()
            };
            let ends = [end(0), end(7)];
            about(&mut region, &bvh, ends);
            let mut found = [Version::Avx512, Version::Portable].map(|widest| {
                WIDEST.set(widest);
                let mut found = Vec::new();
                culling.between(&region, |some| {
                    found.extend(culling.members(some).map(|(_, q)| q));
                });
                WIDEST.set(Version::Avx512);
                found
            });
            assert_eq!(found[0], found[1]);
            found[0].sort_unstable();
            assert!(found[0].windows(2).all(|w| w[0] < w[1]));
            for (id, q) in (0..).map(BlockerId).zip(&polygons) {
                let blocks = blocks(q, ends);
                assert!(!blocks || found[0].binary_search(&id).is_ok(), "{k}: {id:?}");
                blocked += usize::from(blocks);
            }
            handed += found[0].len();
        }
        assert!(blocked > 200 && handed < polygons.len() * 2000 / 4, "{blocked} {handed}");
    }

    #[test]
    fn planes_keep_out_what_lies_beyond_them() {
        let (polygons, bvh) = scene();
        let boxes: Vec<_> = polygons.iter().map(|p| (p.low, p.high)).collect();
        let culling = Culling::new(&polygons, &BoxTree::new(&boxes), &bvh);
        let ends = [-1.0, 1.0].map(|s| bvh.center() + DVec3::splat(s) * bvh.scale());
        let mut region = Region::default();
        let beyond = |q: &Blocker, d: f64| q.corners.iter().all(|c| c.x > d);
        for step in -4..=4 {
            let d = bvh.center().x + f64::from(step) * 0.2 * bvh.scale();
            let planes = [(DVec3::X * 3.0, 3.0 * d)];
            region.set(&bvh, (ends[0], ends[1]), planes.into_iter(), ends.iter());
            let mut count = 0;
            culling.between(&region, |some| {
                for (_, q) in culling.members(some) {
                    let polygon = &polygons[q.index()];
                    assert!(!beyond(polygon, d + 1e-5 * bvh.scale()), "{step}: {q:?}");
                    count += 1;
                }
            });
            let all = polygons.iter().filter(|q| !beyond(q, d));
            let straddles = |q: &&Blocker| {
                ends.map(|e| q.height(e) > 0.0) != [true; 2]
                    && ends.map(|e| q.height(e) < 0.0) != [true; 2]
            };
            assert_eq!(count, all.filter(straddles).count(), "{step}");
        }
    }
}
