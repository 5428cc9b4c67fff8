//! The opaque pieces of one triangle.
//!
//! Outlines are clipped to the triangle and their inside is triangulated in its barycentric
//! coordinates, as integers, where its edges are exact. A point on an edge follows from the edge
//! and the outline alone, the same for both triangles that share the edge.

use std::collections::HashMap;

use glam::{DVec2, DVec3};
use i_triangle::i_overlay::core::fill_rule::FillRule;
use i_triangle::i_overlay::core::overlay::IntOverlayOptions;
use i_triangle::i_overlay::i_float::int::point::IntPoint;
use i_triangle::int::custom::IntCustomTriangulatable;
use i_triangle::int::validation::Validation;

use super::mask::{Mask, TooMuch};
use crate::scene::geometry::position_key;

/// What is left of a triangle.
pub enum Left {
    All,
    None,
    Pieces(Pieces),
}

/// Triangles that do not overlap, wound as the one that they are pieces of.
pub struct Pieces {
    pub corners: Vec<Corner>,
    pub triangles: Vec<[usize; 3]>,
}

/// A corner of pieces.
pub struct Corner {
    pub position: DVec3,
    /// Barycentric coordinates in the whole triangle.
    pub weights: DVec3,
}

/// Barycentric coordinates as integers: so many are 1.
const WHOLE: i32 = 1 << 28;

/// Less than this share of a triangle is nothing.
const NOTHING: f64 = 1e-6;

/// Points of a line, but for rounding, have less area than this share of their distance squared.
const FLAT: f64 = 1e-7;

/// What a mask leaves of a triangle, given the places of its corners in the mask.
///
/// # Errors
/// If the triangle meets more than `most` blocks of the mask.
pub fn pieces(
    mask: &Mask,
    places: [DVec2; 3],
    positions: [DVec3; 3],
    most: usize,
) -> Result<Left, TooMuch> {
    let (mut full, mut clear) = (true, true);
    mask.visit(places, most, |block, _| {
        full &= block.full;
        clear &= block.outlines.is_empty();
    })?;
    if full || clear {
        return Ok(if clear { Left::None } else { Left::All });
    }
    let mut triangle = Triangle::new(places, positions);
    let mut contours = Vec::new();
    mask.visit(places, most, |block, offset| {
        for outline in &block.outlines {
            let clipped = triangle.clip(outline, offset);
            contours.extend((clipped.len() > 2).then_some(clipped));
        }
    })?;
    let options = IntOverlayOptions::default();
    let validation = Validation { fill_rule: FillRule::NonZero, options };
    let mesh = contours.custom_triangulate(validation).into_delaunay().into_raw();
    let mut triangles: Vec<[usize; 3]> = Vec::new();
    let mut doubled = 0.0;
    for [a, b, c] in mesh.triangle_indices::<usize>().as_chunks().0 {
        let points = [a, b, c].map(|&i| mesh.points()[i]);
        let [p, q, r] = points.map(|p| DVec2::new(f64::from(p.x), f64::from(p.y)));
        let area = (q - p).perp_dot(r - p);
        let edges = [q - p, r - q, p - r].map(DVec2::length_squared);
        if area > FLAT * edges.into_iter().fold(0.0, f64::max) {
            doubled += area;
            triangles.push(points.map(|p| triangle.known(p)));
        }
    }
    let share = doubled / f64::from(WHOLE).powi(2);
    Ok(match share {
        share if share < NOTHING => Left::None,
        share if share > 1.0 - NOTHING => Left::All,
        _ => Left::Pieces(Pieces { corners: triangle.corners, triangles }),
    })
}

/// A triangle that outlines are clipped to.
struct Triangle {
    places: [DVec2; 3],
    positions: [DVec3; 3],
    /// Edge `k` runs from corner `k` to the next one, or the other way: the same way in both
    /// triangles that share it.
    turned: [bool; 3],
    /// 1 if corners run counter-clockwise among the places, else -1.
    sign: f64,
    corners: Vec<Corner>,
    known: HashMap<IntPoint<i32>, usize>,
}

/// Where a point of a clipped outline lies.
#[derive(Clone, Copy)]
enum Spot {
    Inside(DVec2),
    /// On an edge, at a fraction of it in the order that does not depend on the triangle; beyond 0
    /// and 1 until other edges clip it off.
    Edge(usize, f64),
    Corner(usize),
}

/// What leads from a point of a clipped outline to the next.
#[derive(Clone, Copy)]
enum Side {
    Outline(DVec2, DVec2),
    Edge(usize),
}

/// A point of a clipped outline with its place and the side that follows.
#[derive(Clone, Copy)]
struct Step {
    spot: Spot,
    at: DVec2,
    side: Side,
}

impl Triangle {
    fn new(places: [DVec2; 3], positions: [DVec3; 3]) -> Self {
        let key = positions.map(position_key);
        let turned = [0, 1, 2].map(|k| key[k] > key[(k + 1) % 3]);
        let [a, b, c] = places;
        let sign = (b - a).perp_dot(c - a).signum();
        let (corners, known) = (Vec::new(), HashMap::new());
        Self { places, positions, turned, sign, corners, known }
    }

    /// The ends of an edge among the places, in the order that does not depend on the triangle.
    fn edge(&self, k: usize) -> [DVec2; 2] {
        let [a, b] = [self.places[k], self.places[(k + 1) % 3]];
        if self.turned[k] { [b, a] } else { [a, b] }
    }

    /// Positive inside an edge, zero on it.
    fn height(&self, k: usize, at: DVec2) -> f64 {
        let [a, b] = self.edge(k);
        let height = (b - a).perp_dot(at - a) * self.sign;
        if self.turned[k] { -height } else { height }
    }

    /// The part of an outline in the triangle, with pieces of the triangle's edges that may go to
    /// and fro (I.E. Sutherland & G.W. Hodgman 1974, "Reentrant polygon clipping").
    fn clip(&mut self, outline: &[DVec2], offset: DVec2) -> Vec<IntPoint<i32>> {
        let point = |i: usize| outline[i % outline.len()] + offset;
        let step = |i: usize| {
            let (at, to) = (point(i), point(i + 1));
            Step { spot: Spot::Inside(at), at, side: Side::Outline(at, to) }
        };
        let mut steps: Vec<Step> = (0..outline.len()).map(step).collect();
        for k in 0..3 {
            steps = self.clip_by(k, &steps);
        }
        steps.into_iter().map(|s| self.corner(s.spot)).collect()
    }

    fn clip_by(&self, k: usize, steps: &[Step]) -> Vec<Step> {
        let heights: Vec<f64> = steps.iter().map(|s| self.height(k, s.at)).collect();
        let mut left = Vec::with_capacity(steps.len());
        for (i, &step) in steps.iter().enumerate() {
            let (from, to) = (heights[i], heights[(i + 1) % steps.len()]);
            let crossing = |side| {
                let (spot, at) = self.cross(k, step.side);
                Step { spot, at, side }
            };
            if from > 0.0 || from == 0.0 && to >= 0.0 {
                left.push(step);
            } else if from == 0.0 {
                left.push(Step { side: Side::Edge(k), ..step });
            }
            if from > 0.0 && to < 0.0 {
                left.push(crossing(Side::Edge(k)));
            } else if from < 0.0 && to > 0.0 {
                left.push(crossing(step.side));
            }
        }
        left
    }

    /// Where a side crosses an edge.
    fn cross(&self, k: usize, side: Side) -> (Spot, DVec2) {
        match side {
            Side::Edge(j) => {
                let corner = if (k + 1) % 3 == j { j } else { k };
                (Spot::Corner(corner), self.places[corner])
            }
            Side::Outline(p, q) => {
                let (p, q) = if (p.x, p.y) <= (q.x, q.y) { (p, q) } else { (q, p) };
                let [a, b] = self.edge(k);
                let along = (p - a).perp_dot(q - p) / (b - a).perp_dot(q - p);
                (Spot::Edge(k, along), a + (b - a) * along)
            }
        }
    }

    /// The point at a fraction of an edge, in the order that does not depend on the triangle.
    fn on_edge(&self, k: usize, along: f64) -> Spot {
        match along {
            0.0 => Spot::Corner(if self.turned[k] { (k + 1) % 3 } else { k }),
            1.0 => Spot::Corner(if self.turned[k] { k } else { (k + 1) % 3 }),
            _ => Spot::Edge(k, along),
        }
    }

    /// A point that lies on an edge by chance is one of the edge, and one at its end a corner.
    fn settled(&self, spot: Spot) -> Spot {
        let (k, along) = match spot {
            Spot::Corner(_) => return spot,
            Spot::Edge(k, along) => (k, along),
            Spot::Inside(at) => {
                let Some(k) = (0..3).find(|&k| self.height(k, at) == 0.0) else { return spot };
                let [a, b] = self.edge(k);
                (k, (at - a).dot(b - a) / (b - a).length_squared())
            }
        };
        self.on_edge(k, along.clamp(0.0, 1.0))
    }

    /// Barycentric coordinates as integers of a spot, whose position is noted.
    fn corner(&mut self, spot: Spot) -> IntPoint<i32> {
        let spot = self.settled(spot);
        let mut weights = DVec3::ZERO;
        match spot {
            Spot::Corner(k) => weights[k] = 1.0,
            Spot::Edge(k, along) => {
                let (from, to) = if self.turned[k] { ((k + 1) % 3, k) } else { (k, (k + 1) % 3) };
                weights[from] = 1.0 - along;
                weights[to] = along;
            }
            Spot::Inside(at) => {
                let [a, b, c] = self.places;
                let whole = (b - a).perp_dot(c - a);
                let second = ((at - a).perp_dot(c - a) / whole).clamp(0.0, 1.0);
                let third = ((b - a).perp_dot(at - a) / whole).clamp(0.0, 1.0 - second);
                weights = DVec3::new(1.0 - second - third, second, third);
            }
        }
        let whole = f64::from(WHOLE);
        let second = (weights.y * whole).round() as i32;
        let third = (weights.z * whole).round() as i32;
        // On the edge without the first corner, exactly.
        let third = if weights.x == 0.0 { WHOLE - second } else { third.min(WHOLE - second) };
        let point = IntPoint::new(second, third);
        let position = self.position(spot, weights);
        self.note(point, Corner { position, weights });
        point
    }

    fn position(&self, spot: Spot, weights: DVec3) -> DVec3 {
        let [a, b, c] = self.positions;
        match spot {
            Spot::Corner(k) => self.positions[k],
            Spot::Edge(k, along) => {
                let (from, to) = (self.positions[k], self.positions[(k + 1) % 3]);
                let (from, to) = if self.turned[k] { (to, from) } else { (from, to) };
                from + (to - from) * along
            }
            Spot::Inside(_) => a * weights.x + b * weights.y + c * weights.z,
        }
    }

    fn note(&mut self, point: IntPoint<i32>, corner: Corner) -> usize {
        let Self { corners, known, .. } = self;
        *known.entry(point).or_insert_with(|| {
            corners.push(corner);
            corners.len() - 1
        })
    }

    /// The corner at a point; a new one where outlines cross each other.
    fn known(&mut self, point: IntPoint<i32>) -> usize {
        let whole = f64::from(WHOLE);
        let weights = DVec3::new(
            f64::from(WHOLE - point.x - point.y),
            f64::from(point.x),
            f64::from(point.y),
        ) / whole;
        let [a, b, c] = self.positions;
        let position = a * weights.x + b * weights.y + c * weights.z;
        self.note(point, Corner { position, weights })
    }
}
