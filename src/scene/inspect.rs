//! What is doubtful about a model's geometry: flaws, holes, overlaps, and its likely unit.
//!
//! All tests are near-linear in the number of triangles, by hashing of positions and grids. What
//! needs visibility (fronts that see nothing) is found elsewhere.

mod edges;
mod grid;
mod overlap;
#[cfg(test)]
mod tests;
mod units;

use std::collections::HashMap;

use glam::DVec3;

use super::geometry::{Geometry, Sides, TriangleId, TriangleState, position_key};
use super::hash::Mixed;
use super::{Finding, Scene, Severity};
use edges::Edges;

/// Doubts about a scene's geometry, each with its place, a count and a remedy.
#[must_use]
pub fn inspect(scene: &Scene) -> Vec<Finding> {
    let g = &scene.geometry;
    let mut findings = Vec::new();
    findings.extend(degenerate(g));
    findings.extend(duplicate(g));
    findings.extend(overlap::find(g).map(|found| overlapping(g, &found)));
    let edges = Edges::of(g);
    findings.extend(open_or_closed(g, &edges));
    findings.extend(winding(scene, &edges));
    findings.extend(edges.t_vertices(g).map(|found| t_vertices(g, &found)));
    findings.extend(units::doubt(g));
    findings
}

/// A doubt about the unit that a model was made in, from its size.
#[must_use]
pub fn doubtful_unit(geometry: &Geometry) -> Option<Finding> {
    units::doubt(geometry)
}

/// `surface lamp, triangle 12 at (1, 2, 0.5)`; triangles count from 0 in file order.
fn place(g: &Geometry, triangle: TriangleId, at: DVec3) -> String {
    let surface = g.surface_of.get(triangle.index()).and_then(|&s| g.surfaces.get(s as usize));
    let name = surface.map_or("?", |s| s.name.as_str());
    format!("surface {name}, triangle {} at {}", g.face(triangle), coordinate(at))
}

/// Six digits locate a flaw; more are noise of the file's `f32`.
fn coordinate(at: DVec3) -> String {
    let [x, y, z] = at.to_array().map(|v| {
        let scale = 10_f64.powi(5 - v.abs().max(1e-3).log10().floor() as i32);
        (v * scale).round() / scale + 0.0
    });
    format!("({x}, {y}, {z})")
}

fn centroid(g: &Geometry, triangle: TriangleId) -> DVec3 {
    let [a, b, c] = g.corners(triangle);
    (a + b + c) / 3.0
}

/// `1 triangle is`, `2 triangles are`.
fn count(n: usize, one: &str, many: &str) -> String {
    if n == 1 { format!("1 {one}") } else { format!("{n} {many}") }
}

fn degenerate(g: &Geometry) -> Option<Finding> {
    let mut found = g.ids().filter(|t| g.state[t.index()] == TriangleState::Degenerate);
    let first = found.next()?;
    let n = 1 + found.count();
    Some(Finding::new(
        Severity::Note,
        place(g, first, g.corners(first)[0]),
        format!(
            "{} without area: no light reaches or leaves them",
            count(n, "triangle is", "triangles are")
        ),
        "dissolve degenerate faces in the modeller",
    ))
}

/// Triangles with the same three corners, and how many of them face the other way.
fn duplicate(g: &Geometry) -> Option<Finding> {
    let key = |t: TriangleId| {
        let mut key = g.corners(t).map(position_key);
        key.sort_unstable();
        key
    };
    let duplicates: Vec<TriangleId> =
        g.ids().filter(|t| g.state[t.index()] == TriangleState::Duplicate).collect();
    let &first = duplicates.first()?;
    let mut original: HashMap<_, Option<TriangleId>, Mixed> =
        duplicates.iter().map(|&t| (key(t), None)).collect();
    for t in g.ids().filter(|&t| g.is_solid(t)) {
        if let Some(place) = original.get_mut(&key(t)) {
            place.get_or_insert(t);
        }
    }
    let of = |t: TriangleId| original.get(&key(t)).copied().flatten();
    let opposite = duplicates
        .iter()
        .filter(|&&t| of(t).is_some_and(|o| cross(g, t).dot(cross(g, o)) < 0.0))
        .count();
    let twin =
        of(first).map_or(String::new(), |o| format!("; the first coincides with triangle {}", o.0));
    let facing = if opposite > 0 {
        format!(", {opposite} of them facing the other way")
    } else {
        String::new()
    };
    Some(Finding::new(
        Severity::Warning,
        place(g, first, centroid(g, first)),
        format!(
            "{} with an earlier one, which takes the light{facing}{twin}",
            count(duplicates.len(), "triangle coincides", "triangles coincide")
        ),
        "remove doubled faces; make a thin wall double-sided instead of doubling it",
    ))
}

fn cross(g: &Geometry, t: TriangleId) -> DVec3 {
    let [a, b, c] = g.corners(t);
    (b - a).cross(c - a)
}

fn overlapping(g: &Geometry, found: &overlap::Overlaps) -> Finding {
    let (a, b) = found.first;
    let facing = if found.opposite > 0 {
        format!(", {} of them facing the other way", found.opposite)
    } else {
        String::new()
    };
    Finding::new(
        Severity::Warning,
        place(g, a, centroid(g, a)),
        format!(
            "{} another in the same plane{facing}; the first lies on triangle {}. Which of the two \
             is seen is left to rounding",
            count(found.count, "triangle overlaps", "triangles overlap"),
            b.0
        ),
        "remove one of the two, or move them apart by a millimetre",
    )
}

fn open_or_closed(g: &Geometry, edges: &Edges) -> Option<Finding> {
    if !g.ids().any(|t| g.is_solid(t)) {
        return None;
    }
    let Some(first) = edges.boundary.first() else {
        return Some(Finding::new(
            Severity::Note,
            "model",
            "closed: every edge is shared by triangles",
            "",
        ));
    };
    let n = edges.boundary.len();
    Some(Finding::new(
        Severity::Note,
        place(g, first.triangle, edges.middle(first)),
        format!("open: {}; the first is here", count(n, "boundary edge", "boundary edges")),
        "fill the holes if no light should escape through them",
    ))
}

fn winding(scene: &Scene, edges: &Edges) -> Option<Finding> {
    let g = &scene.geometry;
    let first = edges.turned.first()?;
    // Where both sides reflect and none emits, winding changes nothing.
    let matters = |t: TriangleId| {
        g.sides[t.index()] == Sides::One
            || scene.optics.emission.get(t.index()).is_some_and(|e| e.max_element() > 0.0)
    };
    let serious = edges.turned.iter().any(|e| matters(e.triangle) || matters(e.other));
    Some(Finding::new(
        if serious { Severity::Warning } else { Severity::Note },
        place(g, first.triangle, edges.middle(first)),
        format!(
            "neighbours face opposite ways across {}; the first is between triangles {} and {}",
            count(edges.turned.len(), "edge", "edges"),
            g.face(first.triangle),
            g.face(first.other)
        ),
        "recalculate normals outside (Blender: Mesh > Normals > Recalculate Outside)",
    ))
}

fn t_vertices(g: &Geometry, found: &edges::TVertices) -> Finding {
    let at_least = if found.partial { "at least " } else { "" };
    Finding::new(
        Severity::Note,
        place(g, found.first, found.at),
        format!(
            "{at_least}{} on another triangle's edge without being its corner; light may leak or \
             shade unevenly there",
            count(found.count, "vertex lies", "vertices lie")
        ),
        "split the edge at the vertex, or merge by distance in the modeller",
    )
}
