//! Texels that no surface covers: they take what lies beside them in their chart.

use glam::{DVec2, DVec3};

use super::atlas::Atlas;
use super::charts::Piece;
use crate::scene::Geometry;

/// Fills the uncovered texels of each chart and of the gutter around it, ring by ring, with the
/// mean of those beside them. Covered ones stay as they are, and nothing passes from chart to
/// chart.
pub(super) fn fill(atlas: &Atlas, covered: &[bool], texels: &mut [&mut Vec<[f32; 3]>]) {
    let width = atlas.size[0];
    for chart in 0..atlas.charts.len() {
        let ([left, top], [across, down]) = atlas.outer(chart);
        let at = |x: usize, y: usize| (top + y) * width + left + x;
        let mut known: Vec<bool> = (0..down)
            .flat_map(|y| (0..across).map(move |x| (x, y)))
            .map(|(x, y)| covered[at(x, y)])
            .collect();
        let mut open: Vec<usize> = (0..known.len()).filter(|i| !known[*i]).collect();
        while !open.is_empty() {
            let beside = |i: usize| {
                let (x, y) = (i % across, i / across);
                let xs = x.saturating_sub(1)..(x + 2).min(across);
                let ys = y.saturating_sub(1)..(y + 2).min(down);
                ys.flat_map(move |y| xs.clone().map(move |x| (x, y)))
            };
            let is_known = |&(x, y): &(usize, usize)| known[y * across + x];
            let ring: Vec<usize> =
                open.iter().copied().filter(|&i| beside(i).any(|p| is_known(&p))).collect();
            if ring.is_empty() {
                break;
            }
            for &i in &ring {
                let from: Vec<usize> = beside(i).filter(is_known).map(|(x, y)| at(x, y)).collect();
                for texels in texels.iter_mut() {
                    let sum = |c: usize| from.iter().map(|&f| texels[f][c]).sum::<f32>();
                    texels[at(i % across, i / across)] =
                        [0, 1, 2].map(|c| sum(c) / from.len() as f32);
                }
            }
            ring.iter().for_each(|&i| known[i] = true);
            open.retain(|&i| !known[i]);
        }
    }
}

/// Charts of covered pieces alone take the light of the nearest place of their side that is not
/// covered: what shows of them at an edge is then no dark line.
pub(super) fn lend(
    atlas: &Atlas,
    geometry: &Geometry,
    covered: &[bool],
    texels: &mut [&mut Vec<[f32; 3]>],
) {
    let width = atlas.size[0];
    let middle = |p: &Piece| p.positions(geometry).iter().sum::<DVec3>() / 3.0;
    for side in atlas.pieces.chunk_by(|a, b| (a.triangle, a.side) == (b.triangle, b.side)) {
        for piece in side.iter().filter(|p| p.covered) {
            let chart = piece.chart as usize;
            let ([left, top], [across, down]) = atlas.outer(chart);
            let all = || (top..top + down).flat_map(|y| (left..left + across).map(move |x| (x, y)));
            if all().any(|(x, y)| covered[y * width + x]) {
                continue;
            }
            let here = middle(piece);
            let corners = side
                .iter()
                .filter(|p| !p.covered)
                .flat_map(|p| p.positions(geometry).into_iter().zip(p.texels));
            let distance = |c: &(DVec3, DVec2)| c.0.distance_squared(here);
            let nearest = corners.min_by(|a, b| distance(a).total_cmp(&distance(b)));
            let Some((_, at)) = nearest else { continue };
            let from = at.y as usize * width + at.x as usize;
            for texels in texels.iter_mut() {
                let light = texels[from];
                all().for_each(|(x, y)| texels[y * width + x] = light);
            }
        }
    }
}
