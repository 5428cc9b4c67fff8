//! What belongs to patches where something stands on the surface or passes through it.
//!
//! What lies beyond a contact line belongs to a neighbour ([`Patches::at`]). A cell is first cut
//! along all contact lines within it, so that each fragment lies on one side of them. A line may
//! end within a fragment, which then has several owners: it is split further, and the smallest
//! fragments go to the owner of their centroid. A cell that ever more lines cross is cut into as
//! many parts as its lines allow ([`most_parts`]), and no more.

use glam::DVec2;
use rayon::prelude::*;

use super::cell::Cell;
use super::fragments::{Fragment, Fragments};
use super::line::Line;
use super::mesh::Patches;
use super::point::{PatchId, SurfacePoint, side_index};
use crate::progress::{Cancelled, Progress, Silent};
use crate::scene::clip::crossing;
use crate::scene::hash::mix;

/// A fragment of several owners is split at most this many times.
const SPLITS: u32 = 4;

/// Cells that are divided before their fragments are put in order.
const AT_ONCE: usize = 4096;

/// What is thinner than this fraction of a cell is not cut off.
const THIN: f64 = 1e-6;

impl Patches {
    /// The triangles that belong to a patch, in the coordinates of the source triangle of its cell
    /// and in its winding; `None` if these are all of its cell, or of its members, and nothing
    /// else.
    pub(crate) fn fragments(
        &self,
        id: PatchId,
    ) -> Option<impl ExactSizeIterator<Item = [DVec2; 3]> + '_> {
        self.fragments_of(id).map(|all| all.iter().map(|f| f.uv))
    }

    /// Area in m² of what belongs to a patch: all of its cell that is not beyond a contact line,
    /// and what lies beyond one in its neighbours' cells.
    #[must_use]
    pub fn own_area(&self, id: PatchId) -> f64 {
        let Some([.., last]) = self.fragments_of(id) else { return self.area(id) };
        let cells = f64::from(self.cell(id).strips()).powi(2);
        2.0 * last.up_to * cells * self.area(id)
    }

    /// The point of what belongs to a patch with coordinates `u` in the unit square, uniform in
    /// area.
    #[must_use]
    pub fn sample_own(&self, id: PatchId, u: DVec2) -> SurfacePoint {
        let Some(all @ [.., last]) = self.fragments_of(id) else { return self.sample(id, u) };
        let at = u.x * last.up_to;
        let k = all.partition_point(|f| f.up_to <= at).min(all.len() - 1);
        let before = if k > 0 { all[k - 1].up_to } else { 0.0 };
        let Fragment { uv: [a, b, c], up_to } = all[k];
        let s = ((at - before) / (up_to - before)).clamp(0.0, 1.0).sqrt();
        let uv = a * (1.0 - s) + b * (s * (1.0 - u.y)) + c * (s * u.y);
        let cell = self.cell(id);
        SurfacePoint { triangle: cell.triangle, side: cell.side, uv }
    }

    /// Whether what belongs to a patch differs from its cell, because of a contact line.
    pub(crate) fn is_fragmented(&self, id: PatchId) -> bool {
        self.fragments_of(id).is_some()
    }

    fn fragments_of(&self, id: PatchId) -> Option<&[Fragment]> {
        self.all_fragments().0.get(&id).map(|p| &p[..])
    }

    /// Finds what belongs to patches, if that is not known; else all that ask for it do so alone.
    pub(crate) fn find_fragments(&self, progress: &dyn Progress) -> Result<(), Cancelled> {
        // Not within the lock: a thread that waits for others there may be given work that asks.
        if self.fragments.get().is_none() {
            let found = find(self, progress)?;
            self.fragments.get_or_init(|| found);
        }
        Ok(())
    }

    fn all_fragments(&self) -> &Fragments {
        match self.fragments.get() {
            Some(found) => found,
            None => {
                // Nobody stops it.
                let found = find(self, &Silent).unwrap_or_default();
                self.fragments.get_or_init(|| found)
            }
        }
    }

    /// Whether some points in the cell of a patch may belong to others.
    fn may_be_divided(&self, id: PatchId) -> bool {
        let cell = self.cell(id);
        match &self.finest {
            Some(finest) => {
                finest.patches.crossed.enters_side(side_index(cell.triangle, cell.side))
            }
            None => self.crossed.enters(id),
        }
    }

    /// The lines along which something stands on, or passes through, a cell.
    fn contacts_in(&self, cell: &Cell) -> Vec<Line> {
        let corners @ [a, b, c] = outline(cell);
        let within = [a.min(b).min(c), a.max(b).max(c)];
        let side = side_index(cell.triangle, cell.side);
        self.contacts.all(side, within, |l| l.enters(corners))
    }
}

/// The fragments of all patches that contact lines divide.
fn find(patches: &Patches, progress: &dyn Progress) -> Result<Fragments, Cancelled> {
    let mut me = Fragments::default();
    let mut add = |owner: PatchId, uv: [DVec2; 3]| {
        let fragments = me.0.entry(owner).or_default();
        let [a, b, c] = uv;
        let before = fragments.last().map_or(0.0, |f| f.up_to);
        let area = 0.5 * (b - a).perp_dot(c - a);
        if area > 0.0 {
            fragments.push(Fragment { uv, up_to: before + area });
        }
    };
    let divided: Vec<PatchId> = patches.ids().filter(|&id| patches.may_be_divided(id)).collect();
    let mut others = Vec::new();
    let parts = |&id: &PatchId| {
        progress.advance(0)?;
        let mut found = Vec::new();
        divide(patches, &patches.cell(id), |owner, uv| found.push((owner, uv)));
        Ok(found)
    };
    for found in divided.chunks(AT_ONCE) {
        let found: Result<Vec<_>, Cancelled> = found.par_iter().map(parts).collect();
        for (owner, uv) in found?.into_iter().flatten() {
            if !patches.may_be_divided(owner) {
                others.push(owner);
            }
            add(owner, uv);
        }
    }
    others.sort_unstable();
    others.dedup();
    others.into_iter().for_each(|id| add(id, outline(&patches.cell(id))));
    Ok(me)
}

fn outline(cell: &Cell) -> [DVec2; 3] {
    cell.barycentric().map(|l| DVec2::new(l.y, l.z))
}

/// Calls `each` with all fragments of a cell and their owners.
fn divide(patches: &Patches, cell: &Cell, mut each: impl FnMut(PatchId, [DVec2; 3])) {
    let thin = THIN / f64::from(cell.strips());
    cut_all(outline(cell).to_vec(), patches.contacts_in(cell), thin, |polygon| {
        for k in 2..polygon.len() {
            let triangle = [polygon[0], polygon[k - 1], polygon[k]];
            assign(patches, cell, triangle, SPLITS, &mut each);
        }
    });
}

/// Parts that a cell with so many lines is cut into at most.
fn most_parts(lines: usize) -> usize {
    64 + 3 * lines
}

/// Calls `each` with the parts of a convex polygon that lines cut it into.
fn cut_all(polygon: Vec<DVec2>, mut lines: Vec<Line>, thin: f64, mut each: impl FnMut(Vec<DVec2>)) {
    /// More lines than this are cut along in a random order, which makes parts of about one size:
    /// those of walls in a row, one after the other, would cut off one sliver each.
    const MANY: usize = 64;
    if lines.len() > MANY {
        let key = |l: &Line| mix([l.from.x, l.from.y, l.to.x, l.to.y].map(f64::to_bits));
        lines.sort_by_cached_key(key);
    }
    let mut left = most_parts(lines.len());
    let knives: Vec<Knife> = lines.iter().map(|l| Knife::new([l.from, l.to])).collect();
    let mut stack = vec![(polygon, (0..lines.len() as u32).collect::<Vec<u32>>())];
    while let Some((mut polygon, lines)) = stack.pop() {
        let mut next = lines.iter();
        while left > 0
            && let Some(&k) = next.next()
        {
            match knives[k as usize].cut(polygon, thin) {
                [Some(one), Some(other)] => {
                    left -= 1;
                    for part in [other, one] {
                        let lines = passing(&knives, next.as_slice(), &part, thin);
                        stack.push((part, lines));
                    }
                    polygon = Vec::new();
                    break;
                }
                [one, other] => polygon = one.or(other).unwrap_or_default(),
            }
        }
        if !polygon.is_empty() {
            each(polygon);
        }
    }
}

/// Those of some lines that may pass through a convex polygon.
fn passing(knives: &[Knife], lines: &[u32], polygon: &[DVec2], thin: f64) -> Vec<u32> {
    let low = polygon.iter().copied().fold(DVec2::INFINITY, DVec2::min);
    let high = polygon.iter().copied().fold(DVec2::NEG_INFINITY, DVec2::max);
    let passes = |&&k: &&u32| {
        let knife = &knives[k as usize];
        let meets = knife.low.cmple(high).all() && low.cmple(knife.high).all();
        meets && knife.parts(polygon, thin)
    };
    lines.iter().filter(passes).copied().collect()
}

/// A segment that cuts polygons.
struct Knife {
    from: DVec2,
    along: DVec2,
    length: f64,
    low: DVec2,
    high: DVec2,
}

impl Knife {
    fn new([from, to]: [DVec2; 2]) -> Self {
        let length = from.distance(to);
        Self { from, along: (to - from) / length, length, low: from.min(to), high: from.max(to) }
    }

    fn height(&self, p: DVec2) -> f64 {
        self.along.perp_dot(p - self.from)
    }

    /// Whether a polygon lies on both sides of the line that the segment is a part of.
    fn parts(&self, polygon: &[DVec2], thin: f64) -> bool {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for &p in polygon {
            let h = self.height(p);
            (low, high) = (low.min(h), high.max(h));
        }
        high > thin && low < -thin
    }

    /// A convex polygon on either side of the segment if that passes through its inside; else all
    /// of it.
    fn cut(&self, polygon: Vec<DVec2>, thin: f64) -> [Option<Vec<DVec2>>; 2] {
        if !self.parts(&polygon, thin) {
            return [Some(polygon), None];
        }
        let mut sides = [Vec::new(), Vec::new()];
        let mut crossed = [f64::INFINITY, f64::NEG_INFINITY];
        for (k, &p) in polygon.iter().enumerate() {
            let q = polygon[(k + 1) % polygon.len()];
            let (h, g) = (self.height(p), self.height(q));
            if h >= 0.0 {
                sides[0].push(p);
            }
            if h <= 0.0 {
                sides[1].push(p);
            }
            let crossing = crossing((p, h), (q, g));
            if let Some(on) = crossing {
                sides.iter_mut().for_each(|side| side.push(on));
            }
            if let Some(on) = crossing.or((h == 0.0).then_some(p)) {
                let at = self.along.dot(on - self.from);
                crossed = [crossed[0].min(at), crossed[1].max(at)];
            }
        }
        // The segment may end before it comes here.
        if crossed[1].min(self.length) - crossed[0].max(0.0) <= thin {
            return [Some(polygon), None];
        }
        sides.map(Some)
    }
}

/// Calls `each` with a triangle, or with the fragments of its several owners.
fn assign(
    patches: &Patches,
    cell: &Cell,
    [a, b, c]: [DVec2; 3],
    splits: u32,
    each: &mut impl FnMut(PatchId, [DVec2; 3]),
) {
    // Drawn in a little, as a corner on a line has no owner.
    const CORNERS: [[f64; 3]; 3] = [[0.98, 0.01, 0.01], [0.01, 0.98, 0.01], [0.01, 0.01, 0.98]];
    let at = |[r, s, t]: [f64; 3]| {
        let uv = a * r + b * s + c * t;
        patches.at(SurfacePoint { triangle: cell.triangle, side: cell.side, uv })
    };
    let middle = at([1.0 / 3.0; 3]);
    if splits == 0 || CORNERS.iter().all(|&l| at(l) == middle) {
        if let Some(owner) = middle {
            each(owner, [a, b, c]);
        }
        return;
    }
    let (ab, bc, ca) = (0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a));
    for t in [[a, ab, ca], [ab, b, bc], [ca, bc, c], [bc, ca, ab]] {
        assign(patches, cell, t, splits - 1, each);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::builtin;

    #[test]
    fn a_segment_cuts_what_it_passes_through() {
        let square = || [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(DVec2::from).to_vec();
        let area = |p: &Vec<DVec2>| {
            (2..p.len()).map(|k| 0.5 * (p[k - 1] - p[0]).perp_dot(p[k] - p[0])).sum::<f64>()
        };
        let cut = |from: [f64; 2], to: [f64; 2]| {
            let sides = Knife::new([from.into(), to.into()]).cut(square(), 1e-6);
            sides.each_ref().map(|p| p.as_ref().map(area))
        };
        assert_eq!(cut([0.25, -1.0], [0.25, 0.5]), [Some(0.25), Some(0.75)]);
        assert_eq!(cut([0.0, 0.0], [1.0, 1.0]), [Some(0.5), Some(0.5)]);
        assert_eq!(cut([0.25, -1.0], [0.25, -0.5]), [Some(1.0), None], "ends before it");
        assert_eq!(cut([-1.0, 1.0], [2.0, 1.0]), [Some(1.0), None], "runs along an edge");
        assert_eq!(cut([2.0, 0.0], [2.0, 1.0]), [Some(1.0), None], "passes by");
    }

    #[test]
    fn what_belongs_to_patches_makes_up_the_surface() {
        let mut fragmented = 0;
        for (name, size) in [("cornell-box", 0.1), ("paper-3", 3.2), ("room", 1.0)] {
            let g = builtin::build(name).unwrap().geometry;
            let patches = Patches::uniform(&g, size).unwrap();
            let [own, all] = [Patches::own_area, Patches::area]
                .map(|area| patches.ids().map(|id| area(&patches, id)).sum::<f64>());
            assert!((own / all - 1.0).abs() < 1e-9, "{name} {own} {all}");
            for id in patches.ids().filter(|&id| patches.is_fragmented(id)) {
                fragmented += 1;
                // Samples meet each fragment in proportion to its area: their mean is the centroid.
                let (mut mean, mut area) = (DVec2::ZERO, 0.0);
                for [a, b, c] in patches.fragments(id).unwrap() {
                    let weight = (b - a).perp_dot(c - a);
                    assert!(weight > 0.0);
                    (mean, area) = (mean + weight * (a + b + c) / 3.0, area + weight);
                }
                let n = 128;
                let mut sampled = DVec2::ZERO;
                for k in 0..n * n {
                    let u = DVec2::new(f64::from(k % n) + 0.5, f64::from(k / n) + 0.5);
                    let p = patches.sample_own(id, u / f64::from(n));
                    sampled += p.uv;
                }
                let off = (sampled / f64::from(n * n)).distance(mean / area);
                assert!(off * f64::from(patches.cell(id).strips()) < 0.02, "{name} {id:?} {off}");
            }
        }
        assert!(fragmented > 100);
    }
}
