//! How the time to make all rows of form factors grows with the number of patches.
//!
//! `cargo run --release --example row_growth`
//!
//! Makes a sample of the rows of the built-in room on one thread, drops them, and fits the time of
//! all rows (n × the time of one) by a power of n. Both ways of drawing take turns, each time is
//! the best of several, and time is the thread's own where the system tells it, so that other work
//! on the machine disturbs little.

#![allow(clippy::print_stdout, reason = "an example")]

use std::error::Error;
use std::time::Instant;

use hemicube::engines::{Draw, Engine, Hemicube, HemicubeOptions};
use hemicube::form_factors::Row;
use hemicube::patches::{PatchId, Patches};
use hemicube::scene::builtin;

/// Largest areas of a patch in m²; they yield about 7,000, 20,000, 40,000 and 150,000 patches.
const SIZES: [f64; 4] = [0.25, 0.02, 0.008, 0.002];

/// Rows made of each subdivision, spread evenly.
const SAMPLE: usize = 400;

/// Each time is the best of so many.
const TURNS: usize = 5;

type Outcome<T> = Result<T, Box<dyn Error + Send + Sync>>;

fn main() -> Outcome<()> {
    rayon::ThreadPoolBuilder::new().num_threads(1).build()?.install(growth)
}

fn growth() -> Outcome<()> {
    let scene = builtin::build("room").ok_or("no room")?;
    let geometry = &scene.geometry;
    println!("room: {} source triangles, hemicubes of 128 px, one thread", geometry.len());
    println!(
        "{:>8}  {:>16}  {:>16}  {:>7}",
        "patches", "sources, ms/row", "patches, ms/row", "ratio"
    );
    let mut totals: [Vec<(f64, f64)>; 2] = Default::default();
    for size in SIZES {
        let patches = Patches::uniform(geometry, size)?;
        let engine = |draw| {
            Hemicube::new(
                geometry,
                &patches,
                HemicubeOptions { draw, ..HemicubeOptions::default() },
            )
        };
        let mut engines = [engine(Draw::Sources)?, engine(Draw::Patches)?];
        let step = patches.len().div_ceil(SAMPLE);
        let ids: Vec<PatchId> = patches.ids().step_by(step).collect();
        let mut best = [f64::INFINITY; 2];
        for _ in 0..TURNS {
            for (best, engine) in best.iter_mut().zip(&mut engines) {
                *best = best.min(milliseconds_a_row(engine, &ids)?);
            }
        }
        let n = patches.len() as f64;
        for (totals, best) in totals.iter_mut().zip(best) {
            totals.push((n, n * best));
        }
        let [sources, drawn] = best;
        println!("{:>8}  {sources:>16.3}  {drawn:>16.3}  {:>7.2}", patches.len(), drawn / sources);
    }
    println!(
        "time of all rows: sources n^{:.2}, patches n^{:.2}",
        power(&totals[0]),
        power(&totals[1])
    );
    Ok(())
}

fn milliseconds_a_row(engine: &mut Hemicube<'_>, ids: &[PatchId]) -> Outcome<f64> {
    let mut row = [Row::default()];
    let start = Clock::now();
    for &id in ids {
        engine.fill(&[id], &mut row)?;
    }
    Ok(start.milliseconds() / ids.len() as f64)
}

/// Time that this thread has had of a processor where the system tells it, else time of day.
struct Clock {
    wall: Instant,
    thread: Option<u64>,
}

impl Clock {
    fn now() -> Self {
        Self { wall: Instant::now(), thread: nanoseconds_of_thread() }
    }

    fn milliseconds(&self) -> f64 {
        match (self.thread, nanoseconds_of_thread()) {
            (Some(from), Some(to)) => (to - from) as f64 * 1e-6,
            _ => self.wall.elapsed().as_secs_f64() * 1e3,
        }
    }
}

fn nanoseconds_of_thread() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    text.split_whitespace().next()?.parse().ok()
}

/// The exponent p of the least-squares fit y = c x^p.
fn power(points: &[(f64, f64)]) -> f64 {
    let logs: Vec<(f64, f64)> = points.iter().map(|p| (p.0.ln(), p.1.ln())).collect();
    let n = logs.len() as f64;
    let (mx, my) =
        (logs.iter().map(|l| l.0).sum::<f64>() / n, logs.iter().map(|l| l.1).sum::<f64>() / n);
    let covariance: f64 = logs.iter().map(|l| (l.0 - mx) * (l.1 - my)).sum();
    covariance / logs.iter().map(|l| (l.0 - mx).powi(2)).sum::<f64>()
}
