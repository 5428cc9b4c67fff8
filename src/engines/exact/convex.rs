//! Solid triangles joined to convex polygons where they lie in one plane: a wall of a thousand
//! triangles is one rectangle, and a single test tells that it hides all that is behind it.

use std::collections::{BTreeMap, HashMap};

use glam::{DVec2, DVec3};

use crate::scene::disjoint_sets::DisjointSets;
use crate::scene::edges::{EdgeUse, shared};
use crate::scene::{Geometry, Side, TriangleId};

/// Triangles are not joined to polygons with more corners: kernels have no room for them.
pub(super) const MOST_CORNERS: usize = 12;

/// A union is convex if its hull is larger by at most this fraction of its area.
const AREA: f64 = 1e-7;

/// The two uses of an edge by neighbours on one surface: they run opposite ways, and no third
/// triangle is there.
pub(super) fn joined(uses: &[EdgeUse]) -> Option<[&EdgeUse; 2]> {
    match uses {
        [a, b] if a.reversed != b.reversed && a.triangle != b.triangle => Some([a, b]),
        _ => None,
    }
}

/// The convex polygons that the solid triangles of a scene make up, each with its triangles. `uses`
/// are those of all edges; planes closer than `coplanar` are one.
pub(super) fn convex_polygons(
    geometry: &Geometry,
    uses: &[EdgeUse],
    coplanar: f64,
) -> Vec<(Vec<TriangleId>, Vec<DVec3>)> {
    let regions = flat_regions(geometry, uses, coplanar);
    let mut triangles: BTreeMap<TriangleId, Vec<TriangleId>> = BTreeMap::new();
    for t in geometry.ids().filter(|&t| geometry.is_solid(t)) {
        if let Some(region) = regions[t.index()] {
            triangles.entry(region).or_default().push(t);
        }
    }
    let mut inner: HashMap<TriangleId, Vec<(f64, [TriangleId; 2])>> = HashMap::new();
    for [a, b] in shared(uses).filter_map(joined) {
        let [p, q] = [a, b].map(|u| regions[u.triangle.index()]);
        if let Some(region) = p.filter(|_| p == q) {
            let c = geometry.corners(a.triangle);
            let length = c[usize::from(a.k)].distance(c[usize::from(a.k + 1) % 3]);
            inner.entry(region).or_default().push((length, [a.triangle, b.triangle]));
        }
    }
    let mut polygons = Vec::new();
    for (region, triangles) in triangles {
        let edges = inner.remove(&region).unwrap_or_default();
        polygons.extend(convex_unions(geometry, &triangles, edges));
    }
    polygons
}

/// For each solid triangle the first one of its region: connected triangles of one plane.
fn flat_regions(geometry: &Geometry, uses: &[EdgeUse], coplanar: f64) -> Vec<Option<TriangleId>> {
    let mut next_to: Vec<Vec<TriangleId>> = vec![Vec::new(); geometry.len()];
    for [a, b] in shared(uses).filter_map(joined) {
        next_to[a.triangle.index()].push(b.triangle);
        next_to[b.triangle.index()].push(a.triangle);
    }
    let mut region = vec![None; geometry.len()];
    let front = |t| geometry.normal(t, Side::Front);
    for seed in geometry.ids().filter(|&t| geometry.is_solid(t)) {
        if region[seed.index()].is_some() {
            continue;
        }
        let (normal, [origin, ..]) = (front(seed), geometry.corners(seed));
        let mut stack = vec![seed];
        region[seed.index()] = Some(seed);
        while let Some(t) = stack.pop() {
            for &n in &next_to[t.index()] {
                let flat = region[n.index()].is_none()
                    && front(n).dot(normal) > 0.999
                    && geometry
                        .corners(n)
                        .iter()
                        .all(|&v| normal.dot(v - origin).abs() <= coplanar);
                if flat {
                    region[n.index()] = Some(seed);
                    stack.push(n);
                }
            }
        }
    }
    region
}

/// Joins the triangles of a flat region to convex polygons, across the longest edges first.
fn convex_unions(
    geometry: &Geometry,
    triangles: &[TriangleId],
    mut edges: Vec<(f64, [TriangleId; 2])>,
) -> Vec<(Vec<TriangleId>, Vec<DVec3>)> {
    let normal = geometry.normal(triangles[0], Side::Front);
    let u = normal.any_orthonormal_vector();
    let v = normal.cross(u);
    let flat = |p: DVec3| DVec2::new(u.dot(p), v.dot(p));
    let mut regions: Vec<Region> = triangles
        .iter()
        .map(|&t| {
            let corners = geometry.corners(t);
            let hull = corners.map(|p| (flat(p), p)).to_vec();
            Region { area: geometry.area(t), hull: convex_hull(hull) }
        })
        .collect();
    let whole = Region {
        area: regions.iter().map(|p| p.area).sum(),
        hull: convex_hull(regions.iter().flat_map(|p| p.hull.iter().copied()).collect()),
    };
    if whole.is_convex() {
        return vec![(triangles.to_vec(), whole.corners())];
    }
    let index: HashMap<TriangleId, u32> =
        triangles.iter().enumerate().map(|(k, &t)| (t, k as u32)).collect();
    edges.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let mut sets = DisjointSets::new(regions.len());
    loop {
        let before = edges.len();
        edges.retain(|(_, [a, b])| {
            let (a, b) = (sets.find(index[a]), sets.find(index[b]));
            if a == b {
                return false;
            }
            let (p, q) = (&regions[a as usize], &regions[b as usize]);
            let hull = convex_hull(p.hull.iter().chain(&q.hull).copied().collect());
            let union = Region { area: p.area + q.area, hull };
            let convex = union.is_convex();
            if convex {
                sets.join(a, b);
                regions[a.min(b) as usize] = union;
            }
            !convex
        });
        if edges.len() == before {
            break;
        }
    }
    let mut members: Vec<Vec<TriangleId>> = vec![Vec::new(); regions.len()];
    for (k, &t) in (0..).zip(triangles) {
        members[sets.find(k) as usize].push(t);
    }
    let unions = members.into_iter().zip(&regions).filter(|(m, _)| !m.is_empty());
    unions.map(|(m, p)| (m, p.corners())).collect()
}

/// A region of a plane: its area in m², and the convex hull of its corners.
struct Region {
    area: f64,
    hull: Vec<(DVec2, DVec3)>,
}

impl Region {
    fn is_convex(&self) -> bool {
        let h = &self.hull;
        let o = h[0].0;
        let twice: f64 = (2..h.len()).map(|k| (h[k - 1].0 - o).perp_dot(h[k].0 - o)).sum();
        h.len() <= MOST_CORNERS && (0.5 * twice - self.area).abs() <= AREA * self.area
    }

    fn corners(&self) -> Vec<DVec3> {
        self.hull.iter().map(|h| h.1).collect()
    }
}

/// The convex hull, counter-clockwise (Andrew 1979, "Another efficient algorithm for convex hulls
/// in two dimensions"); corners that stand out only by rounding are left out.
pub(super) fn convex_hull(mut points: Vec<(DVec2, DVec3)>) -> Vec<(DVec2, DVec3)> {
    points.sort_by(|a, b| a.0.x.total_cmp(&b.0.x).then(a.0.y.total_cmp(&b.0.y)));
    points.dedup_by(|a, b| a.0 == b.0);
    let turns = |hull: &[(DVec2, DVec3)], p: DVec2| {
        let [.., a, b] = hull else { return true };
        let (along, on) = (b.0 - a.0, p - b.0);
        along.perp_dot(on) > 1e-10 * along.length() * on.length()
    };
    let mut hull: Vec<(DVec2, DVec3)> = Vec::new();
    for half in 0..2 {
        let start = hull.len();
        for &p in &points {
            while hull.len() >= start + 2 && !turns(&hull[start..], p.0) {
                hull.pop();
            }
            hull.push(p);
        }
        hull.pop();
        if half == 0 {
            points.reverse();
        }
    }
    hull
}
