//! Lux on a work plane of the built-in room: `cargo run --release --example work_plane`.
//!
//! Prints a table of illuminance in lx, and what people ask of it: mean and uniformity.

#![allow(clippy::print_stdout, reason = "an example")]

use std::error::Error;

use glam::DVec3;
use hemicube::scene::luminance;
use hemicube::{GatherOptions, LightOptions, Place, Probe, Scene, Silent};

/// Metres: height of the plane, and distance of its points.
const HEIGHT: f64 = 0.75;
const STEP: f64 = 0.5;

fn main() -> Result<(), Box<dyn Error>> {
    let scene = Scene::builtin("room")?;
    let lit =
        scene.light(&LightOptions { error: Some(0.02), ..LightOptions::default() }, &Silent)?;
    let (low, high) = scene.geometry.bounds().ok_or("the scene is empty")?;
    let across = |low: f64, high: f64| {
        (1..).map(move |k| low + STEP * f64::from(k)).take_while(move |x| *x < high)
    };
    let mut probes = Vec::new();
    for z in across(low.z, high.z) {
        for x in across(low.x, high.x) {
            probes.push(Probe { point: DVec3::new(x, low.y + HEIGHT, z), normal: DVec3::Y });
        }
    }
    let found = lit.probe(&probes, GatherOptions::default(), &Silent)?;

    println!("     x      z        lx         ±");
    let mut free = Vec::new();
    for (probe, e) in probes.iter().zip(&found).filter(|f| f.1.place == Place::Free) {
        let (lux, error) = (luminance(e.irradiance), luminance(e.error));
        println!("{:6.2} {:6.2} {lux:9.3} {error:9.3}", probe.point.x, probe.point.z);
        free.push(lux);
    }
    let mean = free.iter().sum::<f64>() / free.len() as f64;
    let least = free.iter().copied().fold(f64::INFINITY, f64::min);
    println!("mean {mean:.3} lx, uniformity {:.3}", least / mean);
    Ok(())
}
