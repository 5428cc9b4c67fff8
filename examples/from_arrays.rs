//! A scene from arrays of vertices and faces: `cargo run --release --example from_arrays`.
//!
//! A lamp over a table: prints the irradiance in the middle of the table and at its edge.

#![allow(clippy::print_stdout, reason = "an example")]

use std::error::Error;

use glam::DVec3;
use hemicube::scene::{Material, Rgb};
use hemicube::{GatherOptions, LightOptions, Probe, Scene, Silent};

fn main() -> Result<(), Box<dyn Error>> {
    // Metres, y upwards. The front of a face is where its corners run counter-clockwise.
    let vertices = [
        [-1.0, 0.0, -1.0],
        [-1.0, 0.0, 1.0],
        [1.0, 0.0, 1.0],
        [1.0, 0.0, -1.0],
        [-0.2, 1.0, -0.2],
        [0.2, 1.0, -0.2],
        [0.2, 1.0, 0.2],
        [-0.2, 1.0, 0.2],
    ];
    let faces = [[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]];
    let table =
        Material { name: "table".into(), reflectance: Rgb::splat(0.6), ..Material::default() };
    let lamp =
        Material { name: "lamp".into(), radiance: Rgb::splat(1000.0), ..Material::default() };
    let scene = Scene::from_arrays(&vertices, &faces, &[table, lamp], &[0, 0, 1, 1])?;

    let lit = scene.light(&LightOptions::default(), &Silent)?;
    let at = |x: f64| Probe { point: DVec3::new(x, 0.0, 0.0), normal: DVec3::Y };
    let found = lit.probe(&[at(0.0), at(0.9)], GatherOptions::default(), &Silent)?;
    for (place, e) in ["middle", "edge"].iter().zip(found) {
        println!("{place}: {:.1} ± {:.1} lx", e.irradiance.y, e.error.y);
    }
    Ok(())
}
