//! What belongs to patches where something stands on the surface or passes through it.
//!
//! What lies beyond a contact line belongs to a neighbour ([`Patches::at`]). A cell is cut along
//! all contact lines within it first, so that each part lies on one side of them; parts of several
//! owners (the end of a line lies within them) are split further, and the smallest go to whom their
//! middle belongs.

use glam::DVec2;

use super::cell::Cell;
use super::fragments::{Fragment, Fragments};
use super::mesh::Patches;
use super::point::{PatchId, SurfacePoint, side_index};
use crate::scene::clip::crossing;

/// Parts of several owners are split so often.
const SPLITS: u32 = 4;

/// What is thinner than this share of a cell is not cut off.
const THIN: f64 = 1e-6;

impl Patches {
    /// The triangles that belong to a patch, in the coordinates of the source triangle of its cell
    /// and in its winding; `None` if these are all of its cell, or of its members, and nothing
    /// else.
    pub(crate) fn parts(
        &self,
        id: PatchId,
    ) -> Option<impl ExactSizeIterator<Item = [DVec2; 3]> + '_> {
        self.parts_of(id).map(|parts| parts.iter().map(|p| p.uv))
    }

    /// Area in m² of what belongs to a patch: all of it that is not beyond a contact line, and the
    /// parts of its neighbours that are.
    #[must_use]
    pub fn own_area(&self, id: PatchId) -> f64 {
        let Some([.., last]) = self.parts_of(id) else { return self.area(id) };
        let cells = f64::from(self.cell(id).strips()).powi(2);
        2.0 * last.up_to * cells * self.area(id)
    }

    /// The point of what belongs to a patch with coordinates `u` in the unit square, uniform in
    /// area.
    #[must_use]
    pub fn sample_own(&self, id: PatchId, u: DVec2) -> SurfacePoint {
        let Some(parts @ [.., last]) = self.parts_of(id) else { return self.sample(id, u) };
        let at = u.x * last.up_to;
        let k = parts.partition_point(|p| p.up_to <= at).min(parts.len() - 1);
        let before = if k > 0 { parts[k - 1].up_to } else { 0.0 };
        let Fragment { uv: [a, b, c], up_to } = parts[k];
        let s = ((at - before) / (up_to - before)).clamp(0.0, 1.0).sqrt();
        let uv = a * (1.0 - s) + b * (s * (1.0 - u.y)) + c * (s * u.y);
        let cell = self.cell(id);
        SurfacePoint { triangle: cell.triangle, side: cell.side, uv }
    }

    /// Whether other than the cell of a patch belongs to it.
    pub(crate) fn is_parted(&self, id: PatchId) -> bool {
        self.parts_of(id).is_some()
    }

    fn parts_of(&self, id: PatchId) -> Option<&[Fragment]> {
        self.fragments.get_or_init(|| find(self)).0.get(&id).map(|p| &p[..])
    }

    /// Whether some points in the cell of a patch may belong to others.
    fn may_share(&self, id: PatchId) -> bool {
        let cell = self.cell(id);
        match &self.finest {
            Some(finest) => finest.patches.has_crossed(side_index(cell.triangle, cell.side)),
            None => self.is_crossed(id),
        }
    }

    /// Both ends of each line along which something stands on, or passes through, a cell.
    fn contacts_in(&self, cell: &Cell) -> impl Iterator<Item = [DVec2; 2]> + '_ {
        let corners = outline(cell);
        let lines = self.contacts.of(side_index(cell.triangle, cell.side));
        lines.iter().filter(move |l| l.enters(corners)).map(|l| [l.from, l.to])
    }
}

/// The fragments of all patches that contact lines part.
fn find(patches: &Patches) -> Fragments {
    let mut me = Fragments::default();
    let mut add = |owner: PatchId, uv: [DVec2; 3]| {
        let parts = me.0.entry(owner).or_default();
        let [a, b, c] = uv;
        let before = parts.last().map_or(0.0, |p| p.up_to);
        let area = 0.5 * (b - a).perp_dot(c - a);
        if area > 0.0 {
            parts.push(Fragment { uv, up_to: before + area });
        }
    };
    let shared: Vec<PatchId> = patches.ids().filter(|&id| patches.may_share(id)).collect();
    let mut others = Vec::new();
    for id in shared {
        share_out(patches, &patches.cell(id), |owner, uv| {
            if !patches.may_share(owner) {
                others.push(owner);
            }
            add(owner, uv);
        });
    }
    others.sort_unstable();
    others.dedup();
    others.into_iter().for_each(|id| add(id, outline(&patches.cell(id))));
    me
}

fn outline(cell: &Cell) -> [DVec2; 3] {
    cell.barycentric().map(|l| DVec2::new(l.y, l.z))
}

/// Hands over all parts of a cell with whom they belong to.
fn share_out(patches: &Patches, cell: &Cell, mut each: impl FnMut(PatchId, [DVec2; 3])) {
    let thin = THIN / f64::from(cell.strips());
    let mut convex = vec![outline(cell).to_vec()];
    for line in patches.contacts_in(cell) {
        convex = convex.into_iter().flat_map(|p| cut(p, line, thin)).flatten().collect();
    }
    for polygon in convex {
        for k in 2..polygon.len() {
            let triangle = [polygon[0], polygon[k - 1], polygon[k]];
            give(patches, cell, triangle, SPLITS, &mut each);
        }
    }
}

/// Both parts of a convex polygon, if a segment passes through its inside.
fn cut(polygon: Vec<DVec2>, [from, to]: [DVec2; 2], thin: f64) -> [Option<Vec<DVec2>>; 2] {
    let length = from.distance(to);
    let along = (to - from) / length;
    let height = |p: DVec2| along.perp_dot(p - from);
    let high = polygon.iter().map(|&p| height(p)).fold(f64::NEG_INFINITY, f64::max);
    let low = polygon.iter().map(|&p| height(p)).fold(f64::INFINITY, f64::min);
    if high.is_nan() || high <= thin || low >= -thin {
        return [Some(polygon), None];
    }
    let mut parts = [Vec::new(), Vec::new()];
    let mut crossed = [f64::INFINITY, f64::NEG_INFINITY];
    for (k, &p) in polygon.iter().enumerate() {
        let q = polygon[(k + 1) % polygon.len()];
        let (h, g) = (height(p), height(q));
        if h >= 0.0 {
            parts[0].push(p);
        }
        if h <= 0.0 {
            parts[1].push(p);
        }
        let crossing = crossing((p, h), (q, g));
        if let Some(on) = crossing {
            parts.iter_mut().for_each(|part| part.push(on));
        }
        if let Some(on) = crossing.or((h == 0.0).then_some(p)) {
            let at = along.dot(on - from);
            crossed = [crossed[0].min(at), crossed[1].max(at)];
        }
    }
    // The segment may end before it comes here.
    if crossed[1].min(length) - crossed[0].max(0.0) <= thin {
        return [Some(polygon), None];
    }
    parts.map(Some)
}

/// Hands over a triangle, or parts of it, with the owner of each.
fn give(
    patches: &Patches,
    cell: &Cell,
    [a, b, c]: [DVec2; 3],
    splits: u32,
    each: &mut impl FnMut(PatchId, [DVec2; 3]),
) {
    // Drawn in a little: corners on a line are nobody's.
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
        give(patches, cell, t, splits - 1, each);
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
            let parts = cut(square(), [from.into(), to.into()], 1e-6);
            parts.each_ref().map(|p| p.as_ref().map(area))
        };
        assert_eq!(cut([0.25, -1.0], [0.25, 0.5]), [Some(0.25), Some(0.75)]);
        assert_eq!(cut([0.0, 0.0], [1.0, 1.0]), [Some(0.5), Some(0.5)]);
        assert_eq!(cut([0.25, -1.0], [0.25, -0.5]), [Some(1.0), None], "ends before it");
        assert_eq!(cut([-1.0, 1.0], [2.0, 1.0]), [Some(1.0), None], "runs along an edge");
        assert_eq!(cut([2.0, 0.0], [2.0, 1.0]), [Some(1.0), None], "passes by");
    }

    #[test]
    fn what_belongs_to_patches_makes_up_the_surface() {
        let mut parted = 0;
        for (name, size) in [("cornell-box", 0.1), ("paper-3", 3.2), ("room", 1.0)] {
            let g = builtin::build(name).unwrap().geometry;
            let patches = Patches::uniform(&g, size).unwrap();
            let [own, all] = [Patches::own_area, Patches::area]
                .map(|area| patches.ids().map(|id| area(&patches, id)).sum::<f64>());
            assert!((own / all - 1.0).abs() < 1e-9, "{name} {own} {all}");
            for id in patches.ids().filter(|&id| patches.is_parted(id)) {
                parted += 1;
                // Each part is as often met as it is large: the mean of samples is the centroid.
                let (mut mean, mut area) = (DVec2::ZERO, 0.0);
                for [a, b, c] in patches.parts(id).unwrap() {
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
        assert!(parted > 100);
    }
}
