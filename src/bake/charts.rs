//! Charts: connected, nearly coplanar pieces of surface, laid flat.

use std::collections::{HashMap, HashSet};

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::cut::{Parts, barycentric};
use crate::patches::{ContactLines, SurfacePoint, at_barycentric, side_index};
use crate::progress::{Cancelled, Progress};
use crate::scene::edges::{EdgeUse, edge_uses, shared};
use crate::scene::{Geometry, Scene, Side, TriangleId};

/// A triangle of a side, and where it lies in the atlas.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Piece {
    pub triangle: TriangleId,
    pub side: Side,
    /// Corners in the coordinates `uv` of the source triangle, counter-clockwise seen from its
    /// front.
    pub corners: [DVec2; 3],
    /// Whether something stands on the edge from each corner to the next.
    pub stood_on: [bool; 3],
    /// Whether it lies under something: its texels take the light around it.
    pub covered: bool,
    /// Number of its chart.
    pub chart: u32,
    /// Corners in the atlas, in texels.
    pub texels: [DVec2; 3],
}

impl Piece {
    /// Corner positions, m.
    pub fn positions(&self, geometry: &Geometry) -> [DVec3; 3] {
        let corners = geometry.corners(self.triangle);
        self.corners.map(|uv| at_barycentric(corners, barycentric(uv)))
    }

    /// The point of it with these barycentric coordinates.
    pub fn point(&self, l: DVec3) -> SurfacePoint {
        let [a, b, c] = self.corners;
        let uv = a * l.x + b * l.y + c * l.z;
        SurfacePoint { triangle: self.triangle, side: self.side, uv }
    }
}

/// Pieces that lie in one plane of the atlas.
#[derive(Debug, Clone, Default)]
pub(super) struct Chart {
    pub pieces: Vec<u32>,
    /// Corners of each piece in the chart's plane, m, from (0, 0) on.
    pub flat: Vec<[DVec2; 3]>,
    /// Pieces of other charts on which the surface goes on smoothly, and their corners there.
    pub apron: Vec<(u32, [DVec2; 3])>,
    /// Extent, m.
    pub size: DVec2,
}

/// Cosine between the normals of two neighbours of a chart, and of each with the first.
const TURN: f64 = 0.8;

/// The sides that count, in pieces.
pub(super) fn pieces(
    geometry: &Geometry,
    counts: impl Fn(TriangleId, Side) -> bool,
    is_covered: impl Fn(&Piece) -> bool + Sync,
    texel: f64,
    progress: &dyn Progress,
) -> Result<Vec<Piece>, Cancelled> {
    /// Parts shorter than so many texels, and those that are narrower than one, are not cut: texels
    /// could not tell their parts apart.
    const SHORT: f64 = 2.0;
    let contacts = ContactLines::find(geometry, progress)?;
    let own = |t: &TriangleId| geometry.is_solid(*t) && !geometry.is_whole(*t);
    let sides: Vec<(TriangleId, Side)> = geometry
        .ids()
        .filter(own)
        .flat_map(|t| Side::BOTH.map(|s| (t, s)))
        .filter(|&(t, s)| counts(t, s))
        .collect();
    let parts_of = |&(triangle, side): &(TriangleId, Side)| {
        let number = side_index(triangle, side);
        let edges = [0, 1, 2].map(|k| contacts.on_edge(number, k));
        let [a, b, c] = geometry.corners(triangle);
        let area = geometry.area(triangle);
        let is_small = |corners: &[DVec2]| {
            let from = corners[0];
            let way = |to: &DVec2| ((b - a) * (to.x - from.x) + (c - a) * (to.y - from.y)).length();
            let long = corners.iter().map(way).fold(0.0, f64::max);
            let turns = corners.windows(2).map(|w| (w[0] - from).perp_dot(w[1] - from));
            let own = area * turns.sum::<f64>();
            long < SHORT * texel || own < long * texel
        };
        Parts::new(contacts.on(number), edges, is_small)
    };
    let mut parts: Vec<Parts> = sides.par_iter().map(parts_of).collect();
    share_along_edges(geometry, &sides, &mut parts);
    let mut pieces = Vec::new();
    for ((triangle, side), parts) in sides.into_iter().zip(parts) {
        pieces.extend(parts.triangles().into_iter().map(|(corners, stood_on)| Piece {
            triangle,
            side,
            corners,
            stood_on,
            covered: false,
            chart: 0,
            texels: [DVec2::ZERO; 3],
        }));
    }
    let doubtful = |sides: &[Piece]| sides.len() > 1 || sides[0].stood_on.contains(&true);
    pieces
        .par_chunk_by_mut(|a, b| (a.triangle, a.side) == (b.triangle, b.side))
        .filter(|side| doubtful(side))
        .try_for_each(|side| {
            progress.advance(0)?;
            side.iter_mut().for_each(|piece| piece.covered = is_covered(piece));
            Ok(())
        })?;
    Ok(pieces)
}

/// Corners on an edge are those of all sides that have it, so that no crack opens.
fn share_along_edges(geometry: &Geometry, sides: &[(TriangleId, Side)], parts: &mut [Parts]) {
    let number: HashMap<(TriangleId, Side), usize> =
        sides.iter().enumerate().map(|(i, s)| (*s, i)).collect();
    let (uses, _) = edge_uses(geometry);
    for uses in shared(&uses) {
        // Seen from one end of the edge.
        let seen = |u: &EdgeUse, t: f64| if u.reversed { 1.0 - t } else { t };
        let each = || {
            uses.iter().flat_map(|u| {
                let of = |s| number.get(&(u.triangle, s)).copied();
                Side::BOTH.into_iter().filter_map(of).map(move |i| (u, i))
            })
        };
        let mut places: Vec<f64> = each()
            .flat_map(|(u, i)| {
                parts[i].on_edge(usize::from(u.k)).into_iter().map(move |t| seen(u, t))
            })
            .collect();
        if places.is_empty() {
            continue;
        }
        places.sort_by(f64::total_cmp);
        places.dedup_by(|a, b| *a - *b <= 1e-6);
        let each: Vec<_> = each().collect();
        for (u, i) in each {
            let mut own: Vec<f64> = places.iter().map(|t| seen(u, *t)).collect();
            own.sort_by(f64::total_cmp);
            parts[i].put_on_edge(usize::from(u.k), &own);
        }
    }
}

/// Joins pieces to charts of at most `most` metres across.
pub(super) fn charts(scene: &Scene, pieces: &mut [Piece], most: f64) -> Vec<Chart> {
    let g = &scene.geometry;
    let (beside, over) = neighbours(scene, pieces);
    let normals: Vec<DVec3> = pieces.iter().map(|p| g.normal(p.triangle, p.side)).collect();
    let area = |p: &Piece| {
        let [a, b, c] = p.positions(g);
        (b - a).cross(c - a).length()
    };
    let areas: Vec<f64> = pieces.iter().map(area).collect();
    let mut order: Vec<u32> = (0..pieces.len() as u32).collect();
    let covered: Vec<bool> = pieces.iter().map(|p| p.covered).collect();
    order.sort_by(|&a, &b| {
        let by_area = areas[b as usize].total_cmp(&areas[a as usize]);
        covered[a as usize].cmp(&covered[b as usize]).then(by_area).then(a.cmp(&b))
    });
    let mut taken = vec![false; pieces.len()];
    let mut all = Vec::new();
    for seed in order {
        if taken[seed as usize] {
            continue;
        }
        taken[seed as usize] = true;
        let normal = normals[seed as usize];
        let corners = pieces[seed as usize].positions(g);
        let mut growing = Growing::new(corners, normal, areas[seed as usize].sqrt());
        let mut pieces_of = vec![seed];
        let mut next = 0;
        while let Some(&at) = pieces_of.get(next) {
            next += 1;
            // What is covered follows what is not, and leads to nothing else.
            let hidden = over[at as usize].iter().flatten().filter(|o| covered[**o as usize]);
            for &other in beside[at as usize].iter().flatten().chain(hidden) {
                let (piece, turn) = (&pieces[other as usize], normals[other as usize]);
                let fits = turn.dot(normal) > TURN && turn.dot(normals[at as usize]) > TURN;
                let leads_out = covered[at as usize] && !covered[other as usize];
                if !taken[other as usize]
                    && fits
                    && !leads_out
                    && growing.add(piece.positions(g), piece.side, most)
                {
                    taken[other as usize] = true;
                    pieces_of.push(other);
                }
            }
        }
        let number = all.len() as u32;
        for &p in &pieces_of {
            pieces[p as usize].chart = number;
        }
        let goes_on = |a: u32, b: u32| normals[a as usize].dot(normals[b as usize]) > TURN;
        // What is covered is no way to anywhere.
        let open: Vec<u32> = pieces_of.iter().copied().filter(|p| !covered[*p as usize]).collect();
        let goes_on = |a, b: u32| goes_on(a, b) && !covered[b as usize];
        let apron = apron(&open, &beside, goes_on);
        let flat = |p: u32| growing.flat_of(pieces[p as usize].positions(g));
        let apron: Vec<_> = apron
            .into_iter()
            .map(|p| (p, flat(p)))
            .filter(|(p, f)| turned(f) * pieces[*p as usize].side.sign() > 0.0)
            .collect();
        all.push(growing.laid_out(pieces_of, apron));
    }
    all
}

/// Pieces around a chart on which the surface goes on.
fn apron(own: &[u32], beside: &[[Option<u32>; 3]], goes_on: impl Fn(u32, u32) -> bool) -> Vec<u32> {
    /// How many pieces lie between at most.
    const RINGS: usize = 3;
    let mut known: HashSet<u32> = own.iter().copied().collect();
    let mut apron = Vec::new();
    let mut rim = own.to_vec();
    for _ in 0..RINGS {
        let mut next = Vec::new();
        for &p in &rim {
            for &other in beside[p as usize].iter().flatten() {
                if goes_on(p, other) && known.insert(other) {
                    next.push(other);
                }
            }
        }
        apron.extend(&next);
        rim = next;
    }
    apron
}

/// Twice the area of a triangle that is counter-clockwise.
fn turned([a, b, c]: &[DVec2; 3]) -> f64 {
    (*b - *a).perp_dot(*c - *a)
}

/// For each edge of each piece the piece beyond it: where nothing stands on the edge, and where
/// something does.
fn neighbours(scene: &Scene, pieces: &[Piece]) -> (Beside, Beside) {
    let (g, o) = (&scene.geometry, &scene.optics);
    let [low, high] = g
        .vertices
        .iter()
        .fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |b, v| [b[0].min(*v), b[1].max(*v)]);
    // Corners nearer than this are one.
    let step = (1e-8 * (high - low).length()).max(f64::MIN_POSITIVE);
    let key = |p: DVec3| (p / step).round().to_array().map(|c| c as i64);
    let mut uses: HashMap<[[i64; 3]; 2], Vec<(u32, u8)>> = HashMap::new();
    for (i, piece) in pieces.iter().enumerate() {
        let corners = piece.positions(g).map(key);
        for k in 0..3 {
            let (a, b) = (corners[k], corners[(k + 1) % 3]);
            if a != b {
                uses.entry([a.min(b), a.max(b)]).or_default().push((i as u32, k as u8));
            }
        }
    }
    let label = |p: &Piece| {
        let t = p.triangle.index();
        (g.surface_of[t], o.material_of[t], p.side, o.tint(p.triangle).to_array().map(f64::to_bits))
    };
    let mut beside = vec![[None; 3]; pieces.len()];
    let mut over = beside.clone();
    for found in uses.values() {
        // The two sides of a sheet share its edges.
        for side in Side::BOTH {
            let mut own = found.iter().filter(|(i, _)| pieces[*i as usize].side == side);
            let (Some(a), Some(b), None) = (own.next(), own.next(), own.next()) else { continue };
            if label(&pieces[a.0 as usize]) == label(&pieces[b.0 as usize]) {
                let stood_on = |(i, k): &(u32, u8)| pieces[*i as usize].stood_on[usize::from(*k)];
                let which = if stood_on(a) || stood_on(b) { &mut over } else { &mut beside };
                which[a.0 as usize][usize::from(a.1)] = Some(b.0);
                which[b.0 as usize][usize::from(b.1)] = Some(a.0);
            }
        }
    }
    (beside, over)
}

/// For each edge of each piece a piece beyond it.
type Beside = Vec<[Option<u32>; 3]>;

/// Pieces longer than so many squares of a chart's grid have charts of their own.
const LONG: f64 = 64.0;

/// Squares of a chart's grid along the longest edge of its first piece, at most.
const SQUARES: f64 = 16.0;

/// A chart in the making.
struct Growing {
    axes: [DVec3; 2],
    flat: Vec<[DVec2; 3]>,
    low: DVec2,
    high: DVec2,
    /// The pieces of each square of a grid, so that none comes to lie over another.
    grid: HashMap<[i64; 2], Vec<u32>>,
    cell: f64,
}

impl Growing {
    fn new(corners: [DVec3; 3], normal: DVec3, cell: f64) -> Self {
        // Along the longest edge of the first.
        let edges = [0, 1, 2].map(|k| corners[(k + 1) % 3] - corners[k]);
        let longest = edges.into_iter().max_by(|a, b| a.length().total_cmp(&b.length()));
        let longest = longest.unwrap_or(DVec3::X);
        let x = longest.normalize_or(DVec3::X);
        let y = normal.cross(x);
        let mut me = Self {
            axes: [x, y],
            flat: Vec::new(),
            low: DVec2::INFINITY,
            high: DVec2::NEG_INFINITY,
            grid: HashMap::new(),
            cell: cell.max(longest.length() / SQUARES).max(f64::MIN_POSITIVE),
        };
        let flat = me.flat_of(corners);
        me.put(flat);
        me
    }

    fn flat_of(&self, corners: [DVec3; 3]) -> [DVec2; 3] {
        corners.map(|p| DVec2::new(p.dot(self.axes[0]), p.dot(self.axes[1])))
    }

    fn squares(&self, flat: &[DVec2; 3]) -> impl Iterator<Item = [i64; 2]> + use<> {
        let low = flat[0].min(flat[1]).min(flat[2]) / self.cell;
        let high = flat[0].max(flat[1]).max(flat[2]) / self.cell;
        let [x0, y0] = low.floor().to_array().map(|c| c as i64);
        let [x1, y1] = high.floor().to_array().map(|c| c as i64);
        (y0..=y1).flat_map(move |y| (x0..=x1).map(move |x| [x, y]))
    }

    fn put(&mut self, flat: [DVec2; 3]) {
        let number = self.flat.len() as u32;
        for square in self.squares(&flat) {
            self.grid.entry(square).or_default().push(number);
        }
        self.flat.push(flat);
        self.low = flat.iter().fold(self.low, |l, p| l.min(*p));
        self.high = flat.iter().fold(self.high, |h, p| h.max(*p));
    }

    /// Adds a piece if it lies over none and the chart stays small enough.
    fn add(&mut self, corners: [DVec3; 3], side: Side, most: f64) -> bool {
        let flat = self.flat_of(corners);
        let low = flat.iter().fold(self.low, |l, p| l.min(*p));
        let high = flat.iter().fold(self.high, |h, p| h.max(*p));
        // One that is far longer than the others would lie in too many squares of the grid.
        let extent = flat[0].max(flat[1]).max(flat[2]) - flat[0].min(flat[1]).min(flat[2]);
        let is_long = extent.max_element() > LONG * self.cell;
        if is_long || (high - low).max_element() > most || turned(&flat) * side.sign() <= 0.0 {
            return false;
        }
        let lies_over = self.squares(&flat).any(|square| {
            let others = self.grid.get(&square);
            others.into_iter().flatten().any(|&o| overlap(&self.flat[o as usize], &flat))
        });
        if !lies_over {
            self.put(flat);
        }
        !lies_over
    }

    /// The chart, turned so that its rectangle is small.
    fn laid_out(self, pieces: Vec<u32>, apron: Vec<(u32, [DVec2; 3])>) -> Chart {
        let edge = |t: &[DVec2; 3]| [0, 1, 2].map(|k| t[(k + 1) % 3] - t[k]);
        let mut edges: Vec<DVec2> = self.flat.iter().flat_map(edge).collect();
        edges.sort_by(|a, b| b.length_squared().total_cmp(&a.length_squared()));
        let seen_along = |x: DVec2, p: DVec2| DVec2::new(x.dot(p), x.perp_dot(p));
        let box_along = |x: DVec2| {
            let all = || self.flat.iter().flatten().map(|p| seen_along(x, *p));
            (
                x,
                all().fold(DVec2::INFINITY, DVec2::min),
                all().fold(DVec2::NEG_INFINITY, DVec2::max),
            )
        };
        let area = |b: &(DVec2, DVec2, DVec2)| (b.2 - b.1).x * (b.2 - b.1).y;
        let directions = edges.iter().map(|e| e.normalize_or(DVec2::X)).take(DIRECTIONS);
        let best = directions.map(box_along).reduce(|a, b| if area(&b) < area(&a) { b } else { a });
        let (x, low, high) = best.unwrap_or_default();
        let placed = |f: [DVec2; 3]| f.map(|p| seen_along(x, p) - low);
        Chart {
            pieces,
            flat: self.flat.iter().map(|f| placed(*f)).collect(),
            apron: apron.into_iter().map(|(p, f)| (p, placed(f))).collect(),
            size: high - low,
        }
    }
}

/// Directions that a chart's rectangle is tried in: those of its longest edges.
const DIRECTIONS: usize = 16;

/// Whether two triangles share more than an edge.
fn overlap(a: &[DVec2; 3], b: &[DVec2; 3]) -> bool {
    /// Of the extents of both along an axis.
    const SLACK: f64 = 1e-6;
    let apart = |own: &[DVec2; 3], other: &[DVec2; 3]| {
        (0..3).any(|k| {
            let axis = (own[(k + 1) % 3] - own[k]).perp();
            let span = |t: &[DVec2; 3]| {
                let d = t.map(|p| p.dot(axis));
                [d[0].min(d[1]).min(d[2]), d[0].max(d[1]).max(d[2])]
            };
            let (a, b) = (span(own), span(other));
            let slack = SLACK * (a[1] - a[0] + b[1] - b[0]);
            a[1] <= b[0] + slack || b[1] <= a[0] + slack
        })
    };
    !apart(a, b) && !apart(b, a)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triangles_overlap_by_more_than_an_edge() {
        let at = DVec2::new;
        let a = [at(0.0, 0.0), at(1.0, 0.0), at(0.0, 1.0)];
        assert!(!overlap(&a, &[at(1.0, 0.0), at(1.0, 1.0), at(0.0, 1.0)]));
        assert!(overlap(&a, &[at(0.2, 0.2), at(1.0, 1.0), at(0.0, 1.0)]));
        assert!(overlap(&a, &a));
    }
}
