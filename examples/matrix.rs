//! The closed matrix of an enclosure: `cargo run --release --example matrix -- MODEL OUT.npz`.
//!
//! Without arguments: a unit cube, as furnace.npz in the folder for temporary files. Prints the
//! form factors between named surfaces.

#![allow(clippy::print_stdout, reason = "an example")]

use std::error::Error;

use hemicube::matrix::{Lumped, Rows};
use hemicube::scene::GroupBy;
use hemicube::{MatrixOptions, Scene, Silent};

fn main() -> Result<(), Box<dyn Error>> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let (mut scene, path) = match &args[..] {
        [model, path] => (Scene::load(model)?, path.into()),
        _ => (Scene::builtin("furnace")?, std::env::temp_dir().join("furnace.npz")),
    };
    // One row a face: backs absorb.
    scene.choose_sides(hemicube::scene::SidesChoice::One);
    let options = MatrixOptions { enclosure: true, ..MatrixOptions::default() };
    let matrix = scene.form_factors(&options, &Silent)?;
    matrix.save(path, &scene.geometry, &Silent)?;

    let surfaces = Lumped::new(&matrix, &scene.geometry, &scene.grouping(GroupBy::Surface))?;
    let (mut columns, mut values) = (Vec::new(), Vec::new());
    for i in 0..surfaces.len() {
        surfaces.row(i, &mut columns, &mut values)?;
        for (&j, f) in columns.iter().zip(&values) {
            println!("{} -> {}: {f:.6}", surfaces.label(i), surfaces.label(j as usize));
        }
    }
    Ok(())
}
