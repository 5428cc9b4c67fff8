//! How long light of other lamps and of other reflectances takes, once a scene is solved.
//!
//! `cargo run --release --example relight -- room.hemi`

#![allow(clippy::print_stdout, reason = "a program that reports")]

use std::error::Error;
use std::path::Path;
use std::time::Instant;

use hemicube::export::{read_factors, read_scene, read_store};
use hemicube::progress::Silent;
use hemicube::scene::Rgb;
use hemicube::solution::LightOptions;
use hemicube::store::emitters;

/// Each is measured so often, and the median told.
const TIMES: usize = 21;

fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args().nth(1).ok_or("give a file of solutions (.hemi)")?;
    let path = Path::new(&path);
    let mut scene = None;
    say("read the scene", || scene = Some(read_scene(path)));
    let mut scene = scene.ok_or("not read")??;
    let mut store = None;
    say("read the solutions", || store = Some(read_store(path, &scene, u64::MAX, &Silent)));
    let store = store.ok_or("not read")??;
    println!("{} patches, {} sources", store.patches.len(), store.sources.len());
    for (_, emitter) in emitters(&scene) {
        emitter.scale(&mut scene, 0.5);
    }
    let mut mixed = store.mix(&scene)?;
    say("mix", || mixed = store.mix(&scene).unwrap_or_else(|_| mixed.clone()));
    let mut factors = None;
    say("read the form factors", || factors = Some(read_factors(path, u64::MAX)));
    let factors = factors.ok_or("not read")??;
    scene.optics.set_reflectance(0, Rgb::splat(0.3));
    let options = LightOptions::default();
    let mut again = None;
    say("solve again", || again = Some(store.solve_mixed(&scene, &factors, &options, &Silent)));
    again.ok_or("not solved")???;
    Ok(())
}

/// Does something again and again, and says how long it takes.
fn say(what: &str, mut work: impl FnMut()) {
    let mut seconds: Vec<f64> = (0..TIMES)
        .map(|_| {
            let start = Instant::now();
            work();
            start.elapsed().as_secs_f64()
        })
        .collect();
    seconds.sort_by(f64::total_cmp);
    println!("{what:24} {:8.1} ms", 1000.0 * seconds[TIMES / 2]);
}
