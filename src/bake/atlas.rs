//! The atlas: all charts in one raster of texels, and what each texel stands for.

use std::ops::Range;

use glam::{DVec2, DVec3};
use thiserror::Error;

use super::charts::{Chart, Piece, charts, pieces};
use super::facet::Facet;
use super::options::BakeOptions;
use super::pack::{GUTTER, pack};
use super::sides::Sides;
use crate::gather::Probe;
use crate::patches::SurfacePoint;
use crate::progress::{Cancelled, Progress};
use crate::render::raster::{BAND, Gathered, HELD, Raster};
use crate::render::spots::{Sample, Seen};
use crate::scene::{Scene, Side, TriangleId};
use crate::store::MixError;
use crate::units::Bytes;
use crate::visibility::ItemBuffer;

/// Most texels of an atlas across or down: what every reader takes.
pub const MOST_TEXELS: usize = 8192;

/// Why nothing was baked.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum BakeError {
    /// The atlas would be too large.
    #[error(
        "an atlas of {} x {} texels cannot be made; {MOST_TEXELS} x {MOST_TEXELS} can", .0[0], .0[1]
    )]
    Atlas([usize; 2]),
    /// The atlas does not fit in memory.
    #[error(
        "an atlas of {} x {} texels takes {} of memory, and {} are allowed",
        .size[0], .size[1], Bytes(*.needed), Bytes(*.allowed)
    )]
    Memory {
        /// Texels across and down.
        size: [usize; 2],
        /// Predicted need in bytes.
        needed: u64,
        /// What is allowed in bytes.
        allowed: u64,
    },
    /// Solutions do not add up to the light of the scene.
    #[error("{0}")]
    Mix(#[from] MixError),
    /// No surface exchanges light.
    #[error("there is nothing to bake: no surface exchanges light")]
    Nothing,
    /// The caller cancelled.
    #[error("cancelled")]
    Cancelled(#[from] Cancelled),
}

/// Samples along a side of a texel: an odd number, so that one lies in its middle.
const N: usize = 5;

/// Widest chart, in texels.
const WIDEST: f64 = 2048.0;

/// Where each piece of surface lies in a raster of texels. The outermost corners of a chart lie on
/// centres of texels, so that what is read between texels is never from beyond it.
#[derive(Debug)]
pub(crate) struct Atlas {
    /// Texels across and down.
    pub size: [usize; 2],
    /// Width of a texel on surfaces, m.
    pub texel: f64,
    /// All sides that count, in pieces.
    pub pieces: Vec<Piece>,
    /// Corner and size of each chart's rectangle, gutters left out.
    pub charts: Vec<[[usize; 2]; 2]>,
    /// The tiles that may have texels in each band of rows, first those of pieces of charts.
    in_band: Vec<Vec<u32>>,
    tiles: Vec<Tile>,
    /// The chart of each texel; of those of none, one more than there are.
    chart_of: Vec<u32>,
}

/// Bytes that an atlas of so many texels takes while it is lit and written; measured.
fn needed([w, h]: [usize; 2], layers: usize) -> u64 {
    /// Of a texel: its light, its chart, and what files are made of.
    const TEXEL: u64 = 95;
    /// Of a texel of each further layer.
    const LAYER: u64 = 12;
    /// Of a texel that is being lit.
    const LIT: u64 = 500;
    let layers = layers.saturating_sub(1) as u64 * LAYER;
    (w * h) as u64 * (TEXEL + layers) + (w * h).min(HELD) as u64 * LIT
}

impl Atlas {
    /// Lays out sides; `layers` is how many lights it is for.
    pub fn of(
        sides: &Sides,
        gathered: &Gathered<'_>,
        options: &BakeOptions,
        layers: usize,
        progress: &dyn Progress,
    ) -> Result<Self, BakeError> {
        let g = gathered.geometry();
        let texel = options.texel.unwrap_or_else(|| sides.usual_texel(g));
        let is_wound = sides.are_fronts(g);
        let is_covered = |piece: &Piece| {
            let point = piece.point(DVec3::splat(1.0 / 3.0)).position(g);
            let probe = Probe { point, normal: g.normal(piece.triangle, piece.side) };
            is_wound && gathered.gatherer.is_enclosed(probe, u64::from(piece.triangle.0))
        };
        let counts = |t, side| sides.has(t, side);
        let atlas = Self::new(gathered.scene, texel, counts, is_covered, progress)?;
        if atlas.pieces.is_empty() {
            return Err(BakeError::Nothing);
        }
        let needed = needed(atlas.size, layers);
        if needed > options.memory {
            let allowed = options.memory;
            return Err(BakeError::Memory { size: atlas.size, needed, allowed });
        }
        Ok(atlas)
    }

    /// Lays out all sides that count, by texels of that width (m).
    fn new(
        scene: &Scene,
        texel: f64,
        counts: impl Fn(TriangleId, Side) -> bool,
        is_covered: impl Fn(&Piece) -> bool + Sync,
        progress: &dyn Progress,
    ) -> Result<Self, BakeError> {
        let mut pieces = pieces(&scene.geometry, counts, is_covered, texel, progress)?;
        let charts = charts(scene, &mut pieces, WIDEST * texel);
        let steps = |c: &Chart| (c.size / texel).ceil().max(DVec2::ONE);
        if let Some(chart) = charts.iter().find(|c| steps(c).max_element() > MOST_TEXELS as f64) {
            return Err(BakeError::Atlas(steps(chart).to_array().map(|n| n as usize)));
        }
        let sizes: Vec<[usize; 2]> =
            charts.iter().map(|c| steps(c).to_array().map(|n| n as usize + 1)).collect();
        let (places, size) = pack(&sizes);
        if size.into_iter().any(|n| n > MOST_TEXELS) {
            return Err(BakeError::Atlas(size));
        }
        let corner = |place: [usize; 2]| DVec2::new(place[0] as f64 + 0.5, place[1] as f64 + 0.5);
        let mut tiles = Vec::new();
        let mut aprons = Vec::new();
        for (number, (chart, place)) in charts.iter().zip(&places).enumerate() {
            let scale = steps(chart) / chart.size.max(DVec2::splat(f64::MIN_POSITIVE));
            let tile = |piece: u32, flat: &[DVec2; 3]| {
                let texels = flat.map(|q| corner(*place) + q * scale);
                Tile { piece, chart: number as u32, texels }
            };
            for (&p, flat) in chart.pieces.iter().zip(&chart.flat) {
                let tile = tile(p, flat);
                pieces[p as usize].texels = tile.texels;
                tiles.extend((!pieces[p as usize].covered).then_some(tile));
            }
            aprons.extend(chart.apron.iter().map(|(p, flat)| tile(*p, flat)));
        }
        tiles.extend(aprons);
        let mut in_band = vec![Vec::new(); size[1].div_ceil(BAND)];
        for (i, tile) in tiles.iter().enumerate() {
            let y = tile.texels.map(|t| t.y);
            let ([_, top], [_, down]) =
                outer([places[tile.chart as usize], sizes[tile.chart as usize]]);
            let low = y[0].min(y[1]).min(y[2]).max(top as f64) as usize;
            let high = (y[0].max(y[1]).max(y[2]).max(0.0) as usize + 1).min(top + down);
            let first = low.saturating_sub(1) / BAND;
            let touched = (high / BAND + 1).saturating_sub(first);
            for band in in_band.iter_mut().skip(first).take(touched) {
                band.push(i as u32);
            }
        }
        let charts: Vec<[[usize; 2]; 2]> =
            places.into_iter().zip(sizes).map(|(place, size)| [place, size]).collect();
        let mut chart_of = vec![charts.len() as u32; size[0] * size[1]];
        for (number, chart) in charts.iter().enumerate() {
            let ([left, top], [across, down]) = outer(*chart);
            for row in chart_of.chunks_mut(size[0]).skip(top).take(down) {
                row[left..left + across].fill(number as u32);
            }
        }
        Ok(Self { size, texel, pieces, charts, in_band, tiles, chart_of })
    }

    /// All pieces as triangles, with places in the atlas.
    pub fn facets(&self) -> Vec<Facet> {
        self.pieces.iter().map(|p| self.facet(p, [[0.0; 3]; 3])).collect()
    }

    /// A piece as a triangle with radiances at its corners.
    pub fn facet(&self, p: &Piece, radiance: [[f32; 3]; 3]) -> Facet {
        let [w, h] = self.size.map(|n| n as f64);
        Facet {
            triangle: p.triangle,
            side: p.side,
            corners: p.corners,
            atlas: p.texels.map(|t| t / DVec2::new(w, h)),
            chart: p.chart,
            radiance,
        }
    }

    /// For each sample of each texel of a band of rows the piece that it lies on, and where.
    fn samples(&self, rows: &Range<usize>) -> Vec<[Option<(u32, DVec3)>; N * N]> {
        let w = self.size[0];
        let mut found = vec![[None; N * N]; rows.len() * w];
        for &i in &self.in_band[rows.start / BAND] {
            let tile = &self.tiles[i as usize];
            let ([left, top], [across, down]) = self.outer(tile.chart as usize);
            let ys = [rows.start.max(top) * N, rows.end.min(top + down) * N];
            let xs = [left * N, (left + across) * N];
            each_within(tile.texels.map(|t| t * N as f64), [xs, ys], |x, y, l| {
                let cell: &mut [_; N * N] = &mut found[(y / N - rows.start) * w + x / N];
                cell[y % N * N + x % N].get_or_insert((tile.piece, l));
            });
        }
        found
    }

    /// The place of each sample of a texel of a band of rows, cell by cell.
    pub fn places(&self, rows: &Range<usize>) -> Vec<[Option<SurfacePoint>; N * N]> {
        let at = |(i, l): (u32, DVec3)| self.pieces[i as usize].point(l);
        self.samples(rows).iter().map(|cell| cell.map(|s| s.map(at))).collect()
    }

    /// Corner and size of a chart's rectangle with the gutter around it.
    pub fn outer(&self, chart: usize) -> ([usize; 2], [usize; 2]) {
        outer(self.charts[chart])
    }
}

/// A chart's rectangle with the gutter around it.
fn outer([place, size]: [[usize; 2]; 2]) -> ([usize; 2], [usize; 2]) {
    (place.map(|p| p - GUTTER), size.map(|s| s + 2 * GUTTER))
}

/// A piece in the texels of a chart: its own, or one that its surface goes on to.
#[derive(Debug, Clone, Copy)]
struct Tile {
    piece: u32,
    chart: u32,
    texels: [DVec2; 3],
}

/// An atlas as a raster to be lit.
pub(super) struct Texels<'a> {
    pub atlas: &'a Atlas,
    pub gathered: &'a Gathered<'a>,
}

impl Raster for Texels<'_> {
    fn size(&self) -> [usize; 3] {
        [self.atlas.size[0], self.atlas.size[1], N]
    }

    fn seen(&self, rows: &Range<usize>, _: &mut ItemBuffer) -> Vec<Seen> {
        self.atlas.samples(rows).iter().map(|samples| self.seen_by(samples)).collect()
    }

    fn width(&self, _: &Sample) -> f64 {
        self.atlas.texel
    }

    fn sheet(&self, [x, y]: [usize; 2]) -> u32 {
        self.atlas.chart_of[y * self.atlas.size[0] + x]
    }

    fn facing(&self, _: &Sample) -> f64 {
        1.0
    }
}

impl Texels<'_> {
    /// What a texel stands for whose samples lie on pieces.
    fn seen_by(&self, samples: &[Option<(u32, DVec3)>]) -> Seen {
        if samples.iter().all(Option::is_none) {
            return Seen::Nothing;
        }
        let (scene, normals) = (self.gathered.scene, &self.gathered.normals);
        let at = |&(i, l): &(u32, DVec3)| self.atlas.pieces[i as usize].point(l);
        let first = samples[0];
        let is_one =
            first.is_some_and(|(i, _)| samples.iter().all(|s| s.is_some_and(|s| s.0 == i)));
        if let (true, Some(first)) = (is_one, first) {
            let corner =
                |i: usize| samples[i].as_ref().map_or(at(&first), at).position(&scene.geometry);
            let places = [0, N - 1, N * (N - 1), N * N - 1].map(corner);
            let middle = places.iter().sum::<DVec3>() / 4.0;
            // Samples lie within the texel, at the middles of its parts.
            let wider = N as f64 / (N - 1) as f64;
            let l = |i: usize| samples[i].map_or(first.1, |s| s.1);
            let centre = (l(0) + l(N * N - 1)) / 2.0;
            let sample = Sample::new(scene, normals, at(&(first.0, centre)));
            return Seen::One(sample, places.map(|p| middle + (p - middle) * wider));
        }
        let sample =
            |s: &Option<(u32, DVec3)>| s.as_ref().map(|s| Sample::new(scene, normals, at(s)));
        Seen::Each(samples.iter().map(sample).collect())
    }
}

/// Calls `found` for each sample (at half-odd coordinates) within a triangle, in some columns and
/// rows of a raster, with its barycentric coordinates.
pub(super) fn each_within(
    [a, b, c]: [DVec2; 3],
    [columns, rows]: [[usize; 2]; 2],
    mut found: impl FnMut(usize, usize, DVec3),
) {
    let area = (b - a).perp_dot(c - a);
    if area == 0.0 {
        return;
    }
    let first = |low: f64, from: usize| ((low - 0.5).ceil().max(0.0) as usize).max(from);
    let end = |high: f64, to: usize| ((high - 0.5).floor() as i64 + 1).clamp(0, to as i64) as usize;
    let (low, high) = (a.min(b).min(c), a.max(b).max(c));
    for y in first(low.y, rows[0])..end(high.y, rows[1]) {
        let py = y as f64 + 0.5;
        // Where the row crosses the triangle.
        let (mut left, mut right) = (f64::INFINITY, f64::NEG_INFINITY);
        for (p, q) in [(a, b), (b, c), (c, a)] {
            if (p.y - py) * (q.y - py) <= 0.0 && p.y != q.y {
                let x = p.x + (q.x - p.x) * (py - p.y) / (q.y - p.y);
                (left, right) = (left.min(x), right.max(x));
            }
        }
        for x in first(left, columns[0])..end(right, columns[1]) {
            let p = DVec2::new(x as f64 + 0.5, py);
            let l = DVec2::new((p - a).perp_dot(c - a), (b - a).perp_dot(p - a)) / area;
            let l = DVec3::new(1.0 - l.x - l.y, l.x, l.y).max(DVec3::ZERO);
            found(x, y, l / l.element_sum());
        }
    }
}
