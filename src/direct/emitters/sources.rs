//! What emits, and which emitters are looked at together.

use std::ops::Range;

use glam::DVec3;

use crate::patches::Patches;
use crate::scene::{Geometry, Rgb, Side, TriangleId};

/// Most groups of emitters, of each of which the visible fraction is found.
const MOST_GROUPS: usize = 64;

/// One emitting side.
#[derive(Debug, Clone, Copy)]
pub(super) struct Source {
    pub triangle: TriangleId,
    pub side: Side,
    pub radiance: Rgb,
    pub corners: [DVec3; 3],
    pub normal: DVec3,
    pub area: f64,
}

/// Emitters that are analytic, or not, as one.
pub(super) struct Unit {
    pub centre: DVec3,
    pub normal: DVec3,
    pub radius: f64,
    pub area: f64,
}

/// The patch that a source is known by: its cluster, or itself.
pub(super) fn unit_of(g: &Geometry, patches: &Patches, s: &Source) -> Unit {
    let cluster = patches.of_side(s.triangle, s.side).next().filter(|&i| patches.is_cluster(i));
    match cluster {
        Some(id) => {
            let members = patches.members(id).iter();
            let (centre, radius) = sphere(&members.flat_map(|&t| g.corners(t)).collect::<Vec<_>>());
            Unit { centre, normal: DVec3::ZERO, radius, area: patches.area(id) }
        }
        None => {
            let (centre, radius) = sphere(&s.corners);
            Unit { centre, normal: s.normal, radius, area: s.area }
        }
    }
}

/// A sphere about points: their mean, and the distance of the farthest.
pub(super) fn sphere(points: &[DVec3]) -> (DVec3, f64) {
    let centre = points.iter().sum::<DVec3>() / points.len().max(1) as f64;
    (centre, points.iter().map(|c| (*c - centre).length()).fold(0.0, f64::max))
}

/// Sorts sources into groups of neighbours: surfaces if they are few, else halves of halves.
pub(super) fn grouped(g: &Geometry, sources: &mut [Source]) -> Vec<Range<usize>> {
    if sources.is_empty() {
        return Vec::new();
    }
    let surface = |s: &Source| g.surface_of.get(s.triangle.index()).copied().unwrap_or(0);
    sources.sort_by_key(|s| (surface(s), s.triangle, s.side as u8));
    let mut groups: Vec<Range<usize>> = Vec::new();
    for (k, s) in sources.iter().enumerate() {
        match groups.last_mut() {
            Some(last) if surface(&sources[last.start]) == surface(s) => last.end = k + 1,
            _ => groups.push(k..k + 1),
        }
    }
    if groups.len() <= MOST_GROUPS {
        return groups;
    }
    groups = std::iter::once(0..sources.len()).collect();
    while groups.len() < MOST_GROUPS {
        let largest = (0..groups.len()).max_by_key(|&i| (groups[i].len(), groups.len() - i));
        let Some(at) = largest.filter(|&i| groups[i].len() > 1) else { break };
        let range = groups[at].clone();
        let middle = halve(sources, range.clone());
        groups[at] = range.start..middle;
        groups.insert(at + 1, middle..range.end);
    }
    groups
}

/// Sorts a range of sources along the axis in which they extend farthest; yields its middle.
pub(super) fn halve(sources: &mut [Source], range: Range<usize>) -> usize {
    let centre = |s: &Source| s.corners.iter().sum::<DVec3>();
    let own = &mut sources[range.clone()];
    let (low, high) = own
        .iter()
        .map(centre)
        .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(lo, hi), c| (lo.min(c), hi.max(c)));
    let extent = high - low;
    let axis = (0..3).max_by(|&a, &b| extent[a].total_cmp(&extent[b])).unwrap_or(0);
    own.sort_by(|a, b| {
        centre(a)[axis].total_cmp(&centre(b)[axis]).then(a.triangle.cmp(&b.triangle))
    });
    range.start + range.len() / 2
}
