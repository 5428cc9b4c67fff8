//! Light over a raster: rows of cells, each of them a piece of surface. Pixels of a picture and
//! texels of an atlas are lit alike.

use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};

use rayon::prelude::*;

use super::smooth::smooth;
use super::spots::{Gathering, Light, NONE, Sample, Seen, Spot, Spots, WIDEST, looks};
use crate::engines::sampling::Table;
use crate::gather::{Calm, Gatherer};
use crate::progress::{Cancelled, Progress};
use crate::reconstruct::{Field, Normals};
use crate::scene::{Geometry, Scene};
use crate::visibility::ItemBuffer;

/// Rows of cells that are lit at once, and cells that are gathered together: squares of that.
pub(crate) const BAND: usize = 8;

/// Most cells whose spots are held at a time.
pub(crate) const HELD: usize = 1 << 20;

/// Cells of a raster.
pub(crate) trait Raster: Sync {
    /// Cells across and down, and samples along a side of each.
    fn size(&self) -> [usize; 3];

    /// What the cells of some rows see or are, row by row; `buffer` is reused.
    fn seen(&self, rows: &Range<usize>, buffer: &mut ItemBuffer) -> Vec<Seen>;

    /// Width of a cell where a sample is, m.
    fn width(&self, sample: &Sample) -> f64;

    /// The sheet that a cell is of: those of different sheets share no light, near as they may lie.
    fn sheet(&self, _: [usize; 2]) -> u32 {
        0
    }

    /// The cosine at which a sample is seen.
    fn facing(&self, sample: &Sample) -> f64;
}

/// Light that is gathered, along smooth normals.
pub(crate) struct Gathered<'a> {
    pub scene: &'a Scene,
    pub gatherer: &'a Gatherer<'a>,
    pub calm: Calm<'a>,
    pub normals: Normals,
    /// Whether lamps without extent light surfaces straight.
    pub lamps: bool,
}

/// Some rows of a raster and their light.
pub(crate) struct Lit<'a> {
    spots: &'a Spots,
    light: &'a [Light],
    /// The cell among those of the spots that the rows begin with.
    first: usize,
    /// Samples of a cell.
    samples: usize,
}

impl Lit<'_> {
    /// The spot that a sample of a cell belongs to, if any, and its light.
    pub fn of(&self, cell: usize, sample: usize) -> (u8, Option<&Light>) {
        let cell = self.first + cell;
        let k = self.spots.of_sample[cell * self.samples + sample];
        let light = || &self.light[self.spots.first[cell] as usize + usize::from(k)];
        (k, (k != NONE).then(light))
    }
}

impl<'a> Gathered<'a> {
    pub fn new(scene: &'a Scene, field: &Field<'a>, gatherer: &'a Gatherer<'a>) -> Self {
        let normals = field.normals(&scene.geometry);
        Self { scene, gatherer, calm: gatherer.calm(), normals, lamps: true }
    }

    pub fn geometry(&self) -> &'a Geometry {
        &self.scene.geometry
    }

    /// Lights a raster, and hands over rows after rows. Advances `progress` by one a row.
    pub fn light(
        &self,
        raster: &impl Raster,
        progress: &dyn Progress,
        mut done: impl FnMut(Range<usize>, &Lit<'_>),
    ) -> Result<(), Cancelled> {
        let [w, h, n] = raster.size();
        let noise = self.gatherer.noise();
        let tables: Vec<Table> = looks(noise).map(|rays| self.gatherer.table(rays)).collect();
        let margin = WIDEST as usize;
        let slab = (HELD / w).saturating_sub(2 * margin).max(margin).next_multiple_of(BAND);
        for from in (0..h).step_by(slab) {
            let rows = from..(from + slab).min(h);
            // Spots around are of use too.
            let low = (rows.start.saturating_sub(margin) / BAND) * BAND;
            let high = (rows.end + margin).min(h);
            let counts = |y: usize| rows.contains(&y);
            let mut spots = self.spots(raster, low..high, &tables, counts, progress)?;
            let light = smooth(&mut spots, w);
            let first = (rows.start - low) * w;
            done(rows, &Lit { spots: &spots, light: &light, first, samples: n * n });
        }
        Ok(())
    }

    /// The spots of some rows of cells, and what light they find.
    fn spots(
        &self,
        raster: &impl Raster,
        rows: Range<usize>,
        tables: &[Table],
        counts: impl Fn(usize) -> bool + Sync,
        progress: &dyn Progress,
    ) -> Result<Spots, Cancelled> {
        let [w, _, n] = raster.size();
        let cancelled = AtomicBool::new(false);
        let bands: Vec<usize> = rows.clone().step_by(BAND).collect();
        let found: Vec<Spots> = bands
            .into_par_iter()
            .map_init(ItemBuffer::default, |buffer, from| {
                if cancelled.load(Ordering::Relaxed) {
                    return Spots::default();
                }
                let band = from..(from + BAND).min(rows.end);
                let spots = self.spots_of_band(raster, band.clone(), tables, buffer);
                let done = band.filter(|y| counts(*y)).count();
                if progress.advance(done as u64).is_err() {
                    cancelled.store(true, Ordering::Relaxed);
                }
                spots
            })
            .collect();
        if cancelled.into_inner() {
            return Err(Cancelled);
        }
        let mut all = Spots { first: vec![0], ..Spots::default() };
        all.of_sample.reserve(rows.len() * w * n * n);
        for band in found {
            let before = all.spots.len() as u32;
            all.spots.extend(band.spots);
            all.first.extend(band.first[1..].iter().map(|f| f + before));
            all.of_sample.extend(band.of_sample);
        }
        Ok(all)
    }

    fn spots_of_band(
        &self,
        raster: &impl Raster,
        band: Range<usize>,
        tables: &[Table],
        buffer: &mut ItemBuffer,
    ) -> Spots {
        let [w, _, n] = raster.size();
        let rows = band.len();
        let seen = raster.seen(&band, buffer);
        let mut gathering = Gathering::new(self.gatherer, &self.calm, self.lamps, tables);
        let mut of_sample = vec![NONE; rows * w * n * n];
        let mut of_cells: Vec<Vec<Spot>> = vec![Vec::new(); rows * w];
        // Square by square, so that rays that go together begin together, and sheet by sheet.
        for left in (0..w).step_by(BAND) {
            let cells: Vec<[usize; 2]> =
                (0..rows).flat_map(|y| (left..(left + BAND).min(w)).map(move |x| [x, y])).collect();
            let sheet = |[x, y]: [usize; 2]| raster.sheet([x, band.start + y]);
            let mut sheets: Vec<u32> = cells.iter().map(|c| sheet(*c)).collect();
            sheets.sort_unstable();
            sheets.dedup();
            for own in sheets {
                let mut spots = Vec::new();
                let mut ends = Vec::new();
                for &[x, y] in cells.iter().filter(|c| sheet(**c) == own) {
                    let cell = y * w + x;
                    gathering.cell(
                        &seen[cell],
                        (|s| raster.width(s), |s| raster.facing(s)),
                        (((band.start + y) * w + x) as u64, x % 2 == 0 && y % 2 == 0),
                        &mut of_sample[cell * n * n..][..n * n],
                        &mut spots,
                    );
                    ends.push((cell, spots.len()));
                }
                spots.iter_mut().for_each(|s| s.sheet = own);
                gathering.light(&mut spots);
                let mut start = 0;
                for (cell, end) in ends {
                    of_cells[cell].extend_from_slice(&spots[start..end]);
                    start = end;
                }
            }
        }
        let mut all = Spots { spots: Vec::new(), first: vec![0], of_sample };
        for spots in of_cells {
            all.spots.extend(spots);
            all.first.push(all.spots.len() as u32);
        }
        all
    }
}
