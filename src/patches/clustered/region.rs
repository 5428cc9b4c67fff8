//! Regions of connected, smooth surface, and how they are cut into parts that fit.

use std::sync::atomic::{AtomicU32, Ordering};

use glam::{DMat3, DVec3};

use crate::patches::contact::ContactLines;
use crate::patches::point::side_index;
use crate::scene::edges::{edge_uses, shared};
use crate::scene::{Geometry, Side, TriangleId};

/// Normals of a cluster's members differ from their area-weighted mean by at most this angle
/// (radians, 15°): the point that stands for a cluster then sees what its members see, and the sum
/// of areas exceeds what is seen of it by less than 4 %. Neighbours that meet at a sharper fold are
/// not joined.
pub const MAX_ANGLE: f64 = 15.0 * std::f64::consts::PI / 180.0;

/// Centroids of members lie within a circle of this diameter about the cluster's own centroid, in
/// sides of a square of the largest area: half a square measures 1.6.
pub const MAX_DIAMETER: f64 = 2.5;

/// Fraction of the largest area that is aimed at, so that few parts must be cut once more.
pub(in crate::patches) const FILL: f64 = 0.9;

/// Either side of a cut has at least one triangle in this many, so that the depth of cuts stays
/// logarithmic.
const SMALLEST_PART: usize = 8;

/// Another direction than the axes of the scene must be better by this factor: cuts then run along
/// the axes in rooms that do.
const OBLIQUE: f64 = 1.3;

/// Length over width from which a third of a part is compact.
const SLENDER: f64 = 1.6;

/// No side, or no neighbour.
pub(in crate::patches) const NONE: u32 = u32::MAX;

/// What clustering knows of one side of a source triangle.
#[derive(Debug, Clone, Copy)]
pub(super) struct Facet {
    pub(super) centroid: DVec3,
    pub(super) normal: DVec3,
    pub(super) area: f64,
}

impl Facet {
    pub(super) fn of(geometry: &Geometry, triangle: TriangleId, side: Side) -> Self {
        let [a, b, c] = geometry.corners(triangle);
        let cross = (b - a).cross(c - a) * side.sign();
        let normal = cross.normalize_or_zero();
        Self { centroid: (a + b + c) / 3.0, normal, area: 0.5 * cross.length() }
    }
}

/// Moments of a set of facets.
#[derive(Debug, Clone, Copy)]
pub(super) struct Shape {
    pub(super) area: f64,
    pub(super) centroid: DVec3,
    /// Unit mean normal, zero if normals cancel.
    pub(super) normal: DVec3,
}

impl Shape {
    pub(super) fn of<'a>(facets: impl Iterator<Item = &'a Facet>) -> Self {
        let (mut area, mut centroid, mut normal) = (0.0, DVec3::ZERO, DVec3::ZERO);
        for f in facets {
            area += f.area;
            centroid += f.centroid * f.area;
            normal += f.normal * f.area;
        }
        Self { area, centroid: centroid / area, normal: normal.normalize_or_zero() }
    }
}

/// What keeps a set of facets from being one patch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Fit {
    Fits,
    TooCurved,
    TooLarge,
}

/// The sides that may be joined, and across which edges.
pub(super) struct Region {
    /// Index of each among all sides.
    pub(super) sides: Vec<u32>,
    pub(super) facets: Vec<Facet>,
    /// Across edge k, or [`NONE`].
    pub(super) neighbours: Vec<[u32; 3]>,
    /// Length of edge k.
    pub(super) lengths: Vec<[f32; 3]>,
    /// The part that each belongs to while parts are cut.
    pub(super) part: Vec<AtomicU32>,
    pub(super) max_area: f64,
}

/// A facet that was visited already.
const VISITED: u32 = 1 << 31;

impl Region {
    pub(super) fn new(
        geometry: &Geometry,
        contacts: &ContactLines,
        may_join: impl Fn(TriangleId) -> bool,
        max_area: f64,
        label: &[u32],
    ) -> Self {
        let mut number = vec![NONE; 2 * geometry.len()];
        let (mut sides, mut facets) = (Vec::new(), Vec::new());
        for side in Side::BOTH {
            for t in geometry.ids().filter(|&t| geometry.exchanges(t, side) && may_join(t)) {
                let s = side_index(t, side);
                if !contacts.any_on(s) {
                    number[s] = sides.len() as u32;
                    sides.push(s as u32);
                    facets.push(Facet::of(geometry, t, side));
                }
            }
        }
        let mut neighbours = vec![[NONE; 3]; sides.len()];
        let mut lengths = vec![[0.0; 3]; sides.len()];
        let (uses, positions) = edge_uses(geometry);
        for uses in shared(&uses) {
            let &[a, b] = uses else { continue };
            let [ta, tb] = [a.triangle.index(), b.triangle.index()];
            let alike = geometry.sides[ta] == geometry.sides[tb] && label.get(ta) == label.get(tb);
            if a.reversed == b.reversed || !alike {
                continue;
            }
            let position = |v: u64| positions[v as usize];
            let length = position(a.key >> 32).distance(position(a.key & 0xffff_ffff)) as f32;
            for side in Side::BOTH {
                let [s, t] = [a, b].map(|e| side_index(e.triangle, side));
                let (i, j) = (number[s], number[t]);
                if i == NONE || j == NONE || contacts.on_edge(s, a.k) || contacts.on_edge(t, b.k) {
                    continue;
                }
                let normals = [i, j].map(|i: u32| facets[i as usize].normal);
                if normals[0].dot(normals[1]) < MAX_ANGLE.cos() {
                    continue;
                }
                for (i, k, j) in [(i, a.k, j), (j, b.k, i)] {
                    neighbours[i as usize][usize::from(k)] = j;
                    lengths[i as usize][usize::from(k)] = length;
                }
            }
        }
        let part = sides.iter().map(|_| AtomicU32::new(0)).collect();
        Self { sides, facets, neighbours, lengths, part, max_area }
    }

    pub(super) fn facets_of<'a>(
        &'a self,
        part: &'a [u32],
    ) -> impl Iterator<Item = &'a Facet> + Clone {
        part.iter().map(|&i| &self.facets[i as usize])
    }

    /// Orders the facets by the clusters that they are cut into, and yields the clusters' sizes.
    /// `start` is the place of the first; all carry it as the number of their part.
    pub(super) fn divide(&self, order: &mut [u32], start: u32) -> Vec<u32> {
        let mut found = Vec::new();
        let components = self.components(order, start);
        let (mut rest, mut start) = (order, start);
        for length in components {
            let (own, others) = rest.split_at_mut(length);
            self.cut(own, start, &mut found);
            start += length as u32;
            rest = others;
        }
        found
    }

    /// Cuts a connected part until it fits.
    fn cut(&self, order: &mut [u32], start: u32, found: &mut Vec<u32>) {
        let shape = Shape::of(self.facets_of(order));
        let fit = self.fit(&shape, self.facets_of(order));
        if fit == Fit::Fits || order.len() == 1 {
            found.push(order.len() as u32);
            return;
        }
        let (direction, slender) = self.direction(order, &shape, fit);
        let mut keys: Vec<(f64, u32)> =
            order.iter().map(|&i| (self.facets[i as usize].centroid.dot(direction), i)).collect();
        keys.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        for (i, key) in order.iter_mut().zip(&keys) {
            *i = key.1;
        }
        let middle = self.middle(order, &shape, slender);
        let (a, b) = order.split_at_mut(middle);
        let second = start + middle as u32;
        for &i in &*b {
            self.part[i as usize].store(second, Ordering::Relaxed);
        }
        /// Smaller parts are not worth a task.
        const TASK: usize = 4096;
        let (a, b) = if a.len() + b.len() > TASK {
            rayon::join(|| self.divide(a, start), || self.divide(b, second))
        } else {
            (self.divide(a, start), self.divide(b, second))
        };
        found.extend(a);
        found.extend(b);
    }

    /// Where the ordered facets of a part are cut: so that whole numbers of patches fit on both
    /// sides.
    fn middle(&self, order: &[u32], shape: &Shape, slender: bool) -> usize {
        let patches = match (shape.area / (FILL * self.max_area)).ceil().max(2.0) {
            // A third of a square is no compact patch: rather four quarters.
            3.0 if !slender => 4.0,
            patches => patches,
        };
        let target = shape.area * (0.5 * patches).floor() / patches;
        let mut sum = 0.0;
        let middle = order.iter().position(|&i| {
            sum += self.facets[i as usize].area;
            sum > target
        });
        let least = (order.len() / SMALLEST_PART).max(1);
        middle.unwrap_or(order.len()).clamp(least, order.len() - least)
    }

    /// Reorders the facets of a part by its connected components, and yields their sizes. Parts of
    /// other numbers are never looked into, so tasks do not disturb each other.
    fn components(&self, order: &mut [u32], start: u32) -> Vec<usize> {
        let part = |i: u32| &self.part[i as usize];
        let mut reached: Vec<u32> = Vec::with_capacity(order.len());
        let mut sizes = Vec::new();
        for &seed in &*order {
            if part(seed).load(Ordering::Relaxed) & VISITED != 0 {
                continue;
            }
            let first = reached.len();
            let number = (start + first as u32) | VISITED;
            part(seed).store(number, Ordering::Relaxed);
            reached.push(seed);
            let mut next = first;
            while next < reached.len() {
                for j in self.neighbours[reached[next] as usize] {
                    if j != NONE && part(j).load(Ordering::Relaxed) == start {
                        part(j).store(number, Ordering::Relaxed);
                        reached.push(j);
                    }
                }
                next += 1;
            }
            sizes.push(reached.len() - first);
        }
        for &i in &reached {
            part(i).fetch_and(!VISITED, Ordering::Relaxed);
        }
        order.copy_from_slice(&reached);
        sizes
    }

    pub(super) fn fit<'a>(&self, shape: &Shape, facets: impl Iterator<Item = &'a Facet>) -> Fit {
        let (mut radius2, mut cosine) = (0.0_f64, 1.0_f64);
        for f in facets {
            radius2 = radius2.max((f.centroid - shape.centroid).length_squared());
            cosine = cosine.min(f.normal.dot(shape.normal));
        }
        let reach = 0.5 * MAX_DIAMETER;
        if shape.area > self.max_area || radius2 > reach * reach * self.max_area {
            Fit::TooLarge
        } else if cosine < MAX_ANGLE.cos() {
            Fit::TooCurved
        } else {
            Fit::Fits
        }
    }

    /// The direction that a part is cut across: that of its largest extent if it is too large, and
    /// that along which normals turn most if it is too curved. Also whether the part is slender
    /// that way.
    fn direction(&self, order: &[u32], shape: &Shape, fit: Fit) -> (DVec3, bool) {
        let mean = self.facets_of(order).map(|f| f.normal * f.area).sum::<DVec3>() / shape.area;
        let (mut spread, mut turn) = (DMat3::ZERO, DMat3::ZERO);
        for f in self.facets_of(order) {
            let (d, n) = ((f.centroid - shape.centroid) * f.area, f.normal - mean);
            let x = f.centroid - shape.centroid;
            spread += DMat3::from_cols(d * x.x, d * x.y, d * x.z);
            turn += DMat3::from_cols(n * d.x, n * d.y, n * d.z);
        }
        let longest = principal(spread);
        let along = DMat3::from_cols(longest * longest.x, longest * longest.y, longest * longest.z)
            * longest.dot(spread * longest);
        let across = principal(spread - along);
        let score = |d: DVec3| {
            let extent = d.dot(spread * d);
            match fit {
                // The variance of normals that the place along `d` explains.
                Fit::TooCurved if extent > 0.0 => (turn * d).length_squared() / extent,
                _ => extent,
            }
        };
        let candidates = [
            (DVec3::X, 1.0),
            (DVec3::Y, 1.0),
            (DVec3::Z, 1.0),
            (longest, OBLIQUE),
            (across, OBLIQUE),
        ];
        let mut best = (DVec3::X, f64::NEG_INFINITY);
        for (d, handicap) in candidates {
            // Across a flat face nothing extends, and rounding decides nothing.
            let flat = d.dot(spread * d) < 1e-6 * longest.dot(spread * longest);
            let score = score(d) / handicap;
            if !flat && score > best.1 {
                best = (d, score);
            }
        }
        let [extent, width] = [best.0, across].map(|d| d.dot(spread * d));
        (best.0, extent > SLENDER * SLENDER * width)
    }
}

/// The direction of the largest extent of a symmetric matrix, by squaring it.
fn principal(mut m: DMat3) -> DVec3 {
    for _ in 0..6 {
        let size =
            m.x_axis.length_squared() + m.y_axis.length_squared() + m.z_axis.length_squared();
        if size == 0.0 || !size.is_finite() {
            return DVec3::X;
        }
        m *= 1.0 / size.sqrt();
        m = m * m;
    }
    let columns = [m.x_axis, m.y_axis, m.z_axis];
    let longest =
        columns.into_iter().max_by(|a, b| a.length_squared().total_cmp(&b.length_squared()));
    longest.map_or(DVec3::X, DVec3::normalize_or_zero)
}
