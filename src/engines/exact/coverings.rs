//! Faces that lie on each other: what of a face nothing sees, because another lies on it.
//!
//! Where two faces look the same way, the smaller one is seen: a lamp in a ceiling, a rug on a
//! floor. Where they face each other, as a box and what it stands on, neither is, if behind one of
//! them there is a body. Two open faces back to back are the two sides of a sheet; both are seen.

use std::borrow::Cow;

use glam::DVec3;

use super::blockers::{Blocker, BlockerId, Blockers};
use super::pieces::Fragment;
use crate::progress::{Cancelled, Progress};
use crate::scene::clip::clip;
use crate::scene::shares::{Looked, Shared, share_out};

/// Normals of faces in one plane agree as well as this, or are as opposite.
const PARALLEL: f64 = 0.999;

/// A part of a face is left out below this fraction of what it was cut from.
const SLIVER: f64 = 1e-9;

/// A face is cut into this many parts, and no more.
const MOST_PARTS: usize = 64;

/// Faces tried for each one of the model, on the average; where most faces lie on many others, not
/// all are tried.
const MOST_TRIED: usize = 512;

/// A face that covers another counts as so many tried.
const COVER: usize = 16;

/// Of more faces than this that cover another, those near a part of it are looked up.
const MANY: usize = 32;

/// For each side of each blocker those that cover some of it.
#[derive(Debug, Default)]
pub(super) struct Coverings {
    of: Vec<[Vec<BlockerId>; 2]>,
    /// Distances (m) up to this are none.
    reach: f64,
    /// Faces that lie on so many others that not all of those were tried.
    pub unfinished: usize,
}

impl Coverings {
    /// What covers blockers that lie within `reach` (m) of each other.
    pub fn find(
        blockers: &Blockers,
        reach: f64,
        progress: &dyn Progress,
    ) -> Result<Self, Cancelled> {
        let polygons = &blockers.polygons;
        let areas: Vec<f64> = polygons.iter().map(|p| area(&p.corners)).collect();
        let around = |i: usize, most: usize| {
            progress.advance(0)?;
            let p = &polygons[i];
            let apart = |low: DVec3, high: DVec3| {
                let height = p.height(0.5 * (low + high)).abs();
                height - p.normal.abs().dot(0.5 * (high - low)) > reach
                    || beside([low, high], [p.low, p.high], reach)
            };
            let mut sides = [Vec::new(), Vec::new()];
            let mut tried = 0;
            let all = blockers.tree.near_while(apart, |k| {
                tried += 1;
                let q = &polygons[k as usize];
                let smaller = areas[k as usize].total_cmp(&areas[i]).then((k as usize).cmp(&i));
                let covered = covered(p, q, smaller.is_lt());
                let [small, large] = if smaller.is_lt() { [q, p] } else { [p, q] };
                let near = k as usize != i && !apart(q.low, q.high);
                if near && covered != [false; 2] && lies_on(small, large, reach) {
                    let covers =
                        covered.into_iter().zip(&mut sides).filter(|(covered, _)| *covered);
                    covers.for_each(|(_, side)| side.push(BlockerId(k)));
                    tried += COVER;
                }
                tried < most
            });
            sides.iter_mut().for_each(|side| side.sort_unstable());
            Ok(Looked { found: sides, tried, all })
        };
        let Shared { found, unfinished, .. } = share_out(polygons.len(), MOST_TRIED, around)?;
        Ok(Self { of: found, reach, unfinished })
    }

    /// Tells the caller of faces that may lie on others unknown.
    pub fn warn(&self, blockers: &Blockers, progress: &dyn Progress) {
        if self.unfinished > 0 {
            progress.warn(&format!(
                "{} of {} faces lie on or near so many others that not all that cover them are \
                 known; what covered parts exchange may be counted; leave out faces that lie on \
                 others",
                self.unfinished,
                blockers.polygons.len()
            ));
        }
    }

    /// The blockers that cover some of one side of a blocker, and come near a fragment of it.
    fn near<'a>(
        &self,
        covers: &'a [BlockerId],
        fragment: &Fragment,
        blockers: &Blockers,
    ) -> Cow<'a, [BlockerId]> {
        if covers.len() <= MANY {
            return Cow::Borrowed(covers);
        }
        let [a, b, c] = fragment.corners;
        let own = [a.min(b).min(c), a.max(b).max(c)];
        let mut near = Vec::new();
        let apart = |low: DVec3, high: DVec3| beside([low, high], own, self.reach);
        blockers.tree.near(apart, |k| {
            near.extend(covers.binary_search(&BlockerId(k)).is_ok().then_some(BlockerId(k)));
        });
        near.sort_unstable();
        Cow::Owned(near)
    }

    /// What of a fragment of a blocker is seen; `None` if that is all of it.
    pub fn uncovered(
        &self,
        fragment: &Fragment,
        on: BlockerId,
        blockers: &Blockers,
    ) -> Option<Vec<Fragment>> {
        let normal = fragment.normal;
        let side = usize::from(normal.dot(blockers.polygon(on).normal) < 0.0);
        let covers = self.near(&self.of[on.index()][side], fragment, blockers);
        let least = SLIVER * area(&fragment.corners);
        let mut parts = vec![fragment.corners.to_vec()];
        let mut cut = false;
        for q in covers.iter().map(|&q| blockers.polygon(q)) {
            if parts.len() > MOST_PARTS {
                break;
            }
            let mut left = Vec::new();
            for part in parts {
                if within(&part, q, self.reach, self.reach).is_empty() {
                    left.push(part);
                } else {
                    beyond(part, q, self.reach, &mut left);
                    cut = true;
                }
            }
            parts = left;
        }
        cut.then(|| {
            let fan = |p: &Vec<DVec3>| -> Vec<[DVec3; 3]> {
                (2..p.len()).map(|k| [p[0], p[k - 1], p[k]]).collect()
            };
            let triangles = parts.iter().flat_map(fan).filter(|t| area(t) > least);
            triangles.map(|corners| Fragment { corners, ..*fragment }).collect()
        })
    }
}

/// Whether two boxes (least and greatest coordinates) are farther apart than `reach` (m).
fn beside(a: [DVec3; 2], b: [DVec3; 2], reach: f64) -> bool {
    (a[0] - 2.0 * reach).cmpgt(b[1]).any() || (b[0] - 2.0 * reach).cmpgt(a[1]).any()
}

/// Whether `q` covers the front and the back of `p`, where both lie in one plane.
fn covered(p: &Blocker, q: &Blocker, q_is_smaller: bool) -> [bool; 2] {
    let cosine = p.normal.dot(q.normal);
    if cosine.abs() < PARALLEL {
        return [false; 2];
    }
    let bodies = p.surface != q.surface && (p.closed || q.closed);
    [true, false].map(|front| {
        // Whether q has a side that looks the same way.
        let alike = q.two_sided || (cosine > 0.0) == front;
        (front || p.two_sided) && if alike { q_is_smaller } else { bodies }
    })
}

/// Whether a polygon lies in the plane of a larger one, and on a part of it.
fn lies_on(small: &Blocker, large: &Blocker, reach: f64) -> bool {
    small.corners.iter().all(|&c| large.height(c).abs() <= reach)
        && !within(&small.corners, large, reach, reach).is_empty()
}

/// Height of a point over edge `k` of a polygon, in its plane, towards its inside.
fn inside(q: &Blocker, k: usize) -> impl Fn(DVec3) -> f64 {
    let (a, b) = (q.corners[k], q.corners[(k + 1) % q.corners.len()]);
    let inwards = q.normal.cross(b - a).normalize_or_zero();
    move |p| inwards.dot(p - a)
}

/// Heights up to `reach` count as none.
fn rounded(height: impl Fn(DVec3) -> f64, reach: f64) -> impl Fn(DVec3) -> f64 {
    move |p| {
        let h = height(p);
        if h.abs() <= reach { 0.0 } else { h }
    }
}

/// What of a convex polygon lies on another, farther than `margin` from its edges.
fn within(polygon: &[DVec3], q: &Blocker, margin: f64, reach: f64) -> Vec<DVec3> {
    let mut part = polygon.to_vec();
    for k in 0..q.corners.len() {
        let height = inside(q, k);
        if part.iter().all(|&p| height(p) <= margin) {
            return Vec::new();
        }
        let mut next = Vec::new();
        clip(&part, rounded(&height, reach), |p| next.push(p));
        part = next;
    }
    part
}

/// Appends what of a convex polygon lies beside another.
fn beyond(polygon: Vec<DVec3>, q: &Blocker, reach: f64, parts: &mut Vec<Vec<DVec3>>) {
    let mut rest = polygon;
    for k in 0..q.corners.len() {
        let height = rounded(inside(q, k), reach);
        let (mut out, mut next) = (Vec::new(), Vec::new());
        if rest.iter().any(|&p| height(p) < 0.0) {
            clip(&rest, |p| -height(p), |p| out.push(p));
            clip(&rest, &height, |p| next.push(p));
            parts.extend((out.len() > 2).then_some(out));
            rest = next;
        }
    }
}

fn area(corners: &[DVec3]) -> f64 {
    let [origin, ..] = *corners else { return 0.0 };
    let cross = |k: usize| (corners[k - 1] - origin).cross(corners[k] - origin);
    0.5 * (2..corners.len()).map(cross).sum::<DVec3>().length()
}

#[cfg(test)]
mod tests {
    use super::super::pieces::fragments;
    use super::*;
    use crate::patches::Patches;
    use crate::progress::Silent;
    use crate::scene::builtin::Mesh;
    use crate::scene::{Geometry, Material, SceneBuilder, Sides};
    use glam::dvec3;

    /// The share of each triangle's area that is seen, of its front and of its back if it has one.
    fn seen(meshes: &[(&Mesh, Sides)]) -> Vec<Vec<f64>> {
        let mut b = SceneBuilder::new("test");
        let m = b.material(Material::default());
        for (mesh, sides) in meshes {
            b.mesh("m", &mesh.vertices, &mesh.triangles, m, *sides);
        }
        let g: Geometry = b.finish().geometry;
        let blockers = Blockers::new(&g, 1e-7);
        let coverings = Coverings::find(&blockers, 1e-6, &Silent).unwrap();
        let patches = Patches::uniform(&g, 1e9).unwrap();
        let mut found = vec![Vec::new(); g.len()];
        for id in patches.ids() {
            let left = |f: &Fragment| {
                let on = blockers.of_triangle(f.triangle).unwrap();
                let parts = coverings.uncovered(f, on, &blockers).unwrap_or_else(|| vec![*f]);
                parts.iter().map(|p| area(&p.corners)).sum::<f64>()
            };
            let all = fragments(&g, &patches, id);
            let triangle = all[0].triangle;
            found[triangle.index()].push(all.iter().map(left).sum::<f64>() / g.area(triangle));
        }
        found
    }

    fn square(size: f64, up: bool) -> Mesh {
        let h = 0.5 * size;
        let corners = [[-h, -h], [h, -h], [h, h], [-h, h]].map(|[x, y]| dvec3(x, y, 0.0));
        let triangles = if up { [[0, 1, 2], [0, 2, 3]] } else { [[0, 2, 1], [0, 3, 2]] };
        Mesh { vertices: corners.to_vec(), triangles: triangles.to_vec() }
    }

    fn all_of(shares: &[Vec<f64>]) -> f64 {
        let all: Vec<f64> = shares.iter().flatten().copied().collect();
        all.iter().sum::<f64>() / all.len() as f64
    }

    #[test]
    fn the_smaller_of_two_faces_that_look_the_same_way_is_seen() {
        for sides in [Sides::One, Sides::Two] {
            let shares = seen(&[(&square(2.0, true), sides), (&square(1.0, true), sides)]);
            assert!((all_of(&shares[..2]) - 0.75).abs() < 1e-9, "{shares:?}");
            assert!(all_of(&shares[2..]) == 1.0, "{shares:?}");
        }
    }

    #[test]
    fn two_open_faces_back_to_back_are_both_seen() {
        let shares = seen(&[(&square(2.0, true), Sides::One), (&square(1.0, false), Sides::One)]);
        assert!(shares.iter().flatten().all(|&s| s == 1.0), "{shares:?}");
    }

    #[test]
    fn where_a_body_stands_neither_face_is_seen() {
        let floor = square(4.0, true);
        let body = Mesh::cuboid(DVec3::ONE, [1; 3]);
        for lift in [0.0, 5e-7, 1e-3] {
            let stands = body.clone().at(0.3, -0.2, 0.5 + lift);
            let shares = seen(&[(&floor, Sides::One), (&stands, Sides::One)]);
            let covered = lift < 1e-6;
            let floor = if covered { 15.0 / 16.0 } else { 1.0 };
            assert!((all_of(&shares[..2]) - floor).abs() < 1e-5, "{lift} {shares:?}");
            let hidden = shares[2..].iter().flatten().filter(|&&s| s < 1e-9).count();
            assert_eq!(hidden, if covered { 2 } else { 0 }, "{lift} {shares:?}");
        }
    }

    #[test]
    fn bodies_side_by_side_cover_what_they_share() {
        let body = Mesh::cuboid(DVec3::ONE, [1; 3]);
        let beside = body.clone().at(1.0, 0.5, 0.0);
        let shares = seen(&[(&body, Sides::One), (&beside, Sides::One)]);
        // Of each a face is half covered.
        assert!((all_of(&shares) - 11.0 / 12.0).abs() < 1e-9, "{shares:?}");
    }
}
