//! How long the exact matrix of a furnished room takes, and how well its rows close.
//!
//! `cargo run --release --example exact_rooms`

#![allow(clippy::print_stdout, reason = "an example")]

use std::error::Error;
use std::time::Instant;

use hemicube::form_factors::{Exact, ExactOptions};
use hemicube::patches::Patches;
use hemicube::progress::Silent;
use hemicube::scene::builtin;
use hemicube::visibility::Bvh;

/// Largest areas of a patch in m².
const SIZES: [f64; 3] = [1.0, 0.25, 0.06];

fn main() -> Result<(), Box<dyn Error>> {
    let scene = builtin::build("cornell-box").ok_or("no such scene")?;
    let geometry = &scene.geometry;
    let bvh = Bvh::new(geometry);
    println!("{:>8}  {:>8}  {:>12}  {:>12}", "patches", "seconds", "mean lost", "worst lost");
    let mut before: Option<(f64, f64)> = None;
    for size in SIZES {
        let patches = Patches::uniform(geometry, size)?;
        let start = Instant::now();
        let engine = Exact::new(geometry, &patches, &bvh, ExactOptions::default());
        let factors = engine.matrix(8 << 30, &Silent)?;
        let seconds = start.elapsed().as_secs_f64();
        let lost = || patches.ids().map(|id| factors.account(id).lost.abs());
        let (n, worst) = (patches.len() as f64, lost().fold(0.0, f64::max));
        println!("{n:>8}  {seconds:>8.2}  {:>12.2e}  {worst:>12.2e}", lost().sum::<f64>() / n);
        if let Some((m, s)) = before.replace((n, seconds)) {
            println!("{:>8}  time grows as n^{:.2}", "", (seconds / s).ln() / (n / m).ln());
        }
    }
    Ok(())
}
