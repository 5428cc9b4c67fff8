//! How long form factors take.

use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::{Duration, Instant};

use hemicube::engines::{AssembleError, Classical, Draw, Engine, Hemicube};
use hemicube::form_factors::{Row, RowBlock, RowSink, SinkError};
use hemicube::patches::{PatchId, Patches};
use hemicube::progress::Progress;
use hemicube::scene::{Geometry, Scene, builtin};

use super::conditions::Conditions;
use super::device::Device;
use super::published::SCENES;
use super::stretch::Stretch;
use crate::failure::Failure;

/// The paper's scene of this number, from 1.
pub fn scene(number: usize) -> Result<Scene, Failure> {
    let name = SCENES[number - 1];
    builtin::build(name).ok_or_else(|| Failure::Failed(format!("{name}: no such scene")))
}

/// Who makes the rows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Way {
    /// Classical radiosity.
    Classical,
    /// Hemicubes on the CPU.
    Hemicube(Draw),
    /// Hemicubes on the graphics device.
    Gpu(Draw),
}

/// How long all rows take.
#[derive(Debug, Clone, Copy)]
pub struct Timing {
    /// Seconds for all rows, estimated if not all were measured.
    pub seconds: f64,
    /// Rows that were measured.
    pub rows: usize,
    /// Whether a sample stands for all rows.
    pub estimated: bool,
    /// Ray-triangle tests a second, of those who count them.
    pub tests_per_second: Option<f64>,
}

/// What a failed assembly means to the user.
pub fn assembly_failure(error: AssembleError) -> Failure {
    Failure::of(error, Failure::failed)
}

/// A sink that drops rows.
pub struct Dropped;

impl RowSink for Dropped {
    fn take(&mut self, _: RowBlock) -> Result<(), SinkError> {
        Ok(())
    }
}

/// Runs some things in turn, again until they have taken long enough, and returns the shortest time
/// of each. What is compared is run in turn so that other work on the machine meets both.
pub fn best<const N: usize>(
    conditions: &Conditions,
    mut run: impl FnMut() -> Result<[f64; N], Failure>,
) -> Result<[f64; N], Failure> {
    let mut seconds = run()?;
    let mut spent: f64 = seconds.iter().sum();
    for _ in 1..conditions.repeats {
        if spent >= conditions.enough {
            break;
        }
        let again = run()?;
        spent += again.iter().sum::<f64>();
        for (shortest, again) in seconds.iter_mut().zip(again) {
            *shortest = shortest.min(again);
        }
    }
    Ok(seconds)
}

/// A mesh whose form factors are timed, and what they are made with.
pub struct Subject<'a> {
    /// The scene's.
    pub geometry: &'a Geometry,
    /// The mesh.
    pub patches: &'a Patches,
    /// How carefully.
    pub conditions: &'a Conditions,
    /// For [`Way::Gpu`].
    pub device: &'a Device,
}

impl<'a> Subject<'a> {
    /// How long it takes to make all rows and drop them, by an engine new each time.
    pub fn all_rows(&self, way: Way, progress: &Stretch<'_>) -> Result<Timing, Failure> {
        if let Some(estimate) = self.sampled(way, progress)? {
            return Ok(estimate);
        }
        let ids: Vec<PatchId> = self.patches.ids().collect();
        let mut tests = None;
        let [seconds] = best(self.conditions, || {
            let start = Instant::now();
            let mut maker = self.maker(way)?;
            if let Some(engine) = maker.engine() {
                engine.make(&ids, &mut Dropped, progress).map_err(assembly_failure)?;
            }
            tests = maker.tests();
            Ok([start.elapsed().as_secs_f64()])
        })?;
        let tests_per_second = tests.map(|t| t / seconds);
        Ok(Timing { seconds, rows: ids.len(), estimated: false, tests_per_second })
    }

    fn maker(&self, way: Way) -> Result<Maker<'a>, Failure> {
        let Self { geometry, patches, conditions, device } = *self;
        Ok(match way {
            Way::Classical => Maker::Classical(Some(Classical::new(geometry, patches))),
            Way::Hemicube(draw) => {
                Maker::Other(Box::new(hemicube(geometry, patches, conditions, draw)?))
            }
            Way::Gpu(draw) => Maker::Other(device.hemicube(geometry, patches, conditions, draw)?),
        })
    }

    /// An estimate from a sample of rows, spread evenly; `None` if all rows should not take longer
    /// than the conditions allow.
    fn sampled(&self, way: Way, progress: &Stretch<'_>) -> Result<Option<Timing>, Failure> {
        let (n, budget) = (self.patches.len(), self.conditions.budget);
        let order = spread(n);
        let start = Instant::now();
        let mut maker = self.maker(way)?;
        let batch = way.batch();
        let (mut rows, mut next) = (0, batch);
        while rows < n {
            let ids = &order[rows..n.min(rows + next)];
            maker.fill(ids, progress)?;
            rows += ids.len();
            let elapsed = start.elapsed().as_secs_f64();
            let seconds = elapsed * way.scale(rows, n);
            if seconds <= budget {
                return Ok(None);
            }
            // Whole batches, and the last ones large, so that no thread waits long for others.
            let affordable = (budget / elapsed - 1.0) * rows as f64;
            next = (affordable as usize / batch * batch).min(3 * rows);
            if next == 0 {
                let tests_per_second = maker.tests().map(|t| t / elapsed);
                return Ok(Some(Timing { seconds, rows, estimated: true, tests_per_second }));
            }
        }
        Ok(None)
    }
}

/// The engine under these conditions.
pub fn hemicube<'a>(
    geometry: &'a Geometry,
    patches: &'a Patches,
    conditions: &Conditions,
    draw: Draw,
) -> Result<Hemicube<'a>, Failure> {
    Hemicube::new(geometry, patches, conditions.hemicube(draw)).map_err(Failure::failed)
}

impl Way {
    /// Time of all `n` rows over that of `m`. The classical engine computes the visibility of a
    /// pair with the first of its two rows: `m` rows take `m n - m²/2` of the `n²/2` pairs.
    fn scale(self, m: usize, n: usize) -> f64 {
        let (m, n) = (m as f64, n as f64);
        match self {
            Self::Classical => n * n / (m * (2.0 * n - m)),
            Self::Hemicube(_) | Self::Gpu(_) => n / m,
        }
    }

    /// Rows that are made at once at least.
    fn batch(self) -> usize {
        match self {
            Self::Classical | Self::Hemicube(_) => rayon::current_num_threads(),
            Self::Gpu(_) => 64,
        }
    }
}

/// An engine, with what one wants to know of it.
enum Maker<'a> {
    /// Away while it works.
    Classical(Option<Classical>),
    Other(Box<dyn Engine + 'a>),
}

impl<'a> Maker<'a> {
    fn engine(&mut self) -> Option<&mut (dyn Engine + 'a)> {
        match self {
            Self::Classical(engine) => engine.as_mut().map(|e| e as &mut dyn Engine),
            Self::Other(engine) => Some(&mut **engine),
        }
    }

    /// Makes rows. The classical engine may take long for a few: it works on a thread of its own,
    /// which is left alone when the user cancels.
    fn fill(&mut self, ids: &[PatchId], progress: &Stretch<'_>) -> Result<(), Failure> {
        let mut rows = vec![Row::default(); ids.len()];
        match self {
            Self::Other(engine) => engine.fill(ids, &mut rows).map_err(Failure::failed)?,
            Self::Classical(place) => {
                let Some(mut engine) = place.take() else { return Ok(()) };
                let (ids, (done, wait)) = (ids.to_vec(), channel());
                std::thread::spawn(move || {
                    let result = engine.fill(&ids, &mut rows);
                    let _ = done.send((engine, result));
                });
                let (engine, result) = loop {
                    match wait.recv_timeout(Duration::from_millis(50)) {
                        Ok(made) => break made,
                        Err(RecvTimeoutError::Timeout) => {
                            progress.advance(0)?;
                        }
                        Err(RecvTimeoutError::Disconnected) => {
                            return Err(Failure::failed("the classical engine stopped"));
                        }
                    }
                };
                result.map_err(Failure::failed)?;
                *place = Some(engine);
            }
        }
        Ok(progress.advance(0)?)
    }

    fn tests(&self) -> Option<f64> {
        match self {
            Self::Classical(engine) => engine.as_ref().map(|e| e.tests() as f64),
            Self::Other(_) => None,
        }
    }
}

/// All patches in an order whose every beginning is spread evenly: steps of about the golden ratio.
fn spread(n: usize) -> Vec<PatchId> {
    let golden = (n as f64 * 0.618_033_988_749_895) as usize;
    let coprime = |&step: &usize| gcd(step, n) == 1;
    let step = (golden.max(1)..=n.max(1)).find(coprime).unwrap_or(1);
    (0..n).map(|k| PatchId(((k * step + n / 3) % n) as u32)).collect()
}

fn gcd(a: usize, b: usize) -> usize {
    if b == 0 { a } else { gcd(b, a % b) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sample_is_spread_and_takes_every_row_once() {
        for n in [1, 2, 7, 546, 32_160] {
            let mut ids = spread(n);
            ids.sort_unstable();
            assert!(ids.iter().enumerate().all(|(i, id)| id.index() == i));
        }
        let first = &spread(30_000)[..9];
        for third in 0..3 {
            let there = first.iter().filter(|id| id.index() / 10_000 == third).count();
            assert!((2..=4).contains(&there), "{there}");
        }
    }

    #[test]
    fn estimates_end_at_what_is_measured() {
        for way in [Way::Classical, Way::Hemicube(Draw::Sources)] {
            assert_eq!(way.scale(500, 500), 1.0);
        }
        assert!((Way::Classical.scale(1, 1000) - 500.25).abs() < 0.01);
    }
}
