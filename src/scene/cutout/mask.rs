//! What of a texture is opaque, as outlines in small blocks.

use glam::DVec2;
use rayon::prelude::*;

use super::outline::{Outline, outlines};
use crate::scene::texture::{Alphas, Wrap};

/// Cells along the side of a block: a triangle meets few outlines that are not its own, and a
/// straight line is not cut too often.
const SIDE: usize = 32;

/// What is opaque of a texture that repeats, mirrors or ends as it does.
pub struct Mask {
    /// Nodes of the grid for each texel of the texture, along x and y.
    scale: DVec2,
    axes: [Axis; 2],
    /// Row by row.
    blocks: Vec<Block>,
}

/// What is opaque between some nodes.
pub struct Block {
    /// Least and greatest coordinates.
    pub bounds: [DVec2; 2],
    pub outlines: Vec<Outline>,
    /// Whether all of it is opaque.
    pub full: bool,
    /// Number of points of all outlines.
    pub points: usize,
}

/// Nodes along x or y, with their texels.
struct Axis {
    nodes: Vec<(f64, usize)>,
    /// After so many nodes all repeats, if ever.
    period: Option<f64>,
}

impl Axis {
    /// The nodes are the centres of texels. Beyond the last of a texture that ends there is another
    /// one at the end of `reach`.
    fn new(count: usize, wrap: Wrap, reach: [f64; 2]) -> Self {
        let at = |k: usize| (k as f64, if k < count { k } else { (2 * count - 1 - k) % count });
        match wrap {
            Wrap::Repeat => {
                let nodes = (0..=count).map(|k| (k as f64, k % count)).collect();
                Self { nodes, period: Some(count as f64) }
            }
            Wrap::Mirror => {
                let end = (2.0 * count as f64, 0);
                let nodes = (0..2 * count).map(at).chain([end]).collect();
                Self { nodes, period: Some(2.0 * count as f64) }
            }
            Wrap::Clamp => {
                let low = (reach[0].min(0.0) - 1.0, 0);
                let high = (reach[1].max(count as f64) + 1.0, count - 1);
                let nodes = [low].into_iter().chain((0..count).map(at)).chain([high]).collect();
                Self { nodes, period: None }
            }
        }
    }

    fn blocks(&self) -> usize {
        (self.nodes.len() - 1).div_ceil(SIDE)
    }

    /// The nodes of a block, those on its border included.
    fn of_block(&self, block: usize) -> &[(f64, usize)] {
        &self.nodes[block * SIDE..self.nodes.len().min((block + 1) * SIDE + 1)]
    }

    /// The blocks that a range of coordinates meets, each with the offset of its repeat; `None` if
    /// there are more than `most`.
    fn met(&self, [low, high]: [f64; 2], most: usize) -> Option<Vec<(f64, usize)>> {
        let period = self.period.unwrap_or(f64::INFINITY);
        let repeat = |x: f64| if self.period.is_some() { (x / period).floor() } else { 0.0 };
        let (first, last) = (repeat(low), repeat(high));
        if last - first > most as f64 {
            return None;
        }
        let mut met = Vec::new();
        for k in 0..=(last - first) as usize {
            let offset = if self.period.is_some() { (first + k as f64) * period } else { 0.0 };
            let meets = |b: &usize| {
                let nodes = self.of_block(*b);
                nodes[0].0 + offset <= high && low <= nodes[nodes.len() - 1].0 + offset
            };
            met.extend((0..self.blocks()).filter(meets).map(|b| (offset, b)));
            if met.len() > most {
                return None;
            }
        }
        Some(met)
    }
}

/// A triangle of texture coordinates meets too much of a mask.
#[derive(Debug, PartialEq, Eq)]
pub struct TooMuch;

impl Mask {
    /// The mask of what reaches `cutoff` in these alphas, which may be averages of several texels
    /// of a texture of `size`, for coordinates within `reach` (in its texels). `None` if that has
    /// more than `most` edges of the grid between opaque and clear.
    pub fn new(
        alphas: &Alphas,
        cutoff: f32,
        size: DVec2,
        reach: [DVec2; 2],
        most: usize,
    ) -> Option<Self> {
        let Alphas { width, height, .. } = *alphas;
        let scale = DVec2::new(width as f64, height as f64) / size;
        let reach = reach.map(|at| at * scale);
        let axis = |k: usize| {
            let count = [width, height][k];
            Axis::new(count, alphas.wrap[k], reach.map(|at| at[k]))
        };
        let axes = [axis(0), axis(1)];
        if alphas.edges(cutoff) > most {
            return None;
        }
        let columns = axes[0].blocks();
        let blocks = (0..columns * axes[1].blocks())
            .into_par_iter()
            .map(|b| {
                let [x, y] = [axes[0].of_block(b % columns), axes[1].of_block(b / columns)];
                let [xs, ys] = [x, y].map(|n| n.iter().map(|n| n.0).collect::<Vec<_>>());
                let height = |i: usize, j: usize| f64::from(alphas.at(x[i].1, y[j].1) - cutoff);
                Block::new(&xs, &ys, height)
            })
            .collect();
        Some(Self { scale, axes, blocks })
    }

    /// A position among the nodes, from one in texels of the texture.
    pub fn place(&self, texel: DVec2) -> DVec2 {
        texel * self.scale - 0.5
    }

    /// Calls `visit` for each block that a triangle of places meets, with the offset of its repeat.
    ///
    /// # Errors
    /// If there are more than `most`.
    pub fn visit(
        &self,
        corners: [DVec2; 3],
        most: usize,
        mut visit: impl FnMut(&Block, DVec2),
    ) -> Result<(), TooMuch> {
        let low = corners[0].min(corners[1]).min(corners[2]);
        let high = corners[0].max(corners[1]).max(corners[2]);
        let met = |k: usize| self.axes[k].met([low[k], high[k]], most).ok_or(TooMuch);
        let (columns, rows) = (met(0)?, met(1)?);
        if columns.len().saturating_mul(rows.len()) > most {
            return Err(TooMuch);
        }
        for &(y, row) in &rows {
            for &(x, column) in &columns {
                let block = &self.blocks[row * self.axes[0].blocks() + column];
                let offset = DVec2::new(x, y);
                if !is_beside(corners, block.bounds.map(|b| b + offset)) {
                    visit(block, offset);
                }
            }
        }
        Ok(())
    }
}

impl Block {
    fn new(xs: &[f64], ys: &[f64], height: impl Fn(usize, usize) -> f64) -> Self {
        let full = (0..ys.len()).all(|j| (0..xs.len()).all(|i| height(i, j) >= 0.0));
        let outlines = outlines(xs, ys, height);
        let points = outlines.iter().map(Vec::len).sum();
        let end = |k: fn(&[f64]) -> usize| DVec2::new(xs[k(xs)], ys[k(ys)]);
        Self { bounds: [end(|_| 0), end(|at| at.len() - 1)], outlines, full, points }
    }
}

/// Whether a box lies beyond an edge of a triangle.
fn is_beside([a, b, c]: [DVec2; 3], [low, high]: [DVec2; 2]) -> bool {
    let turned = (b - a).perp_dot(c - a).signum();
    [(a, b), (b, c), (c, a)].into_iter().any(|(from, to)| {
        let inwards = (to - from).perp() * turned;
        let nearest = DVec2::select(inwards.cmpgt(DVec2::ZERO), high, low);
        inwards.dot(nearest - from) < 0.0
    })
}
