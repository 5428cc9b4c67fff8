//! One hemicube looked at: `cargo run --release --example one_hemicube`.
//!
//! Makes the row of one patch of the Cornell box and prints the patches that it sees most of.

#![allow(clippy::print_stdout, reason = "an example")]

use std::error::Error;

use hemicube::Scene;
use hemicube::engines::{Engine, Hemicube, HemicubeOptions};
use hemicube::form_factors::Row;
use hemicube::patches::{PatchId, Patches};

fn main() -> Result<(), Box<dyn Error>> {
    let scene = Scene::builtin("cornell-box")?;
    let geometry = &scene.geometry;
    let patches = Patches::uniform(geometry, 0.1)?;
    let mut engine = Hemicube::new(geometry, &patches, HemicubeOptions::default())?;
    let id = PatchId(0);
    let mut row = [Row::default()];
    engine.fill(&[id], &mut row)?;
    let [row] = row;

    let name = |j: PatchId| {
        let surface = geometry.surface_of[patches.cell(j).triangle.index()];
        &geometry.surfaces[surface as usize].name
    };
    println!("patch {} of {} sees {} patches", id.0, name(id), row.columns.len());
    let mut seen: Vec<(PatchId, f64)> = row.entries().collect();
    seen.sort_by(|a, b| b.1.total_cmp(&a.1));
    for (j, f) in &seen[..seen.len().min(10)] {
        println!("{f:.5}  patch {} of {}", j.0, name(*j));
    }
    println!("in all {:.5}, and {:.5} escape", row.weights.sum(), row.environment);
    Ok(())
}
