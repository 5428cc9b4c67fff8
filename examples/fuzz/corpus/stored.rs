//! What was computed and is read back: matrices and solutions.

use std::error::Error;
use std::fs;
use std::path::Path;

use hemicube::engines::{EngineOptions, ExactOptions, RaysOptions};
use hemicube::export::write_hemi;
use hemicube::scene::{Rgb, Scene, ies};
use hemicube::solution::Adaptive;
use hemicube::store::sources;
use hemicube::{LightOptions, MatrixOptions, Silent};

use super::{Input, Sound, gltf, models, tables};

/// The scene whose matrices are stored.
pub fn closed() -> Result<Scene, Box<dyn Error>> {
    Ok(Scene::builtin("furnace")?)
}

pub fn npz() -> Sound {
    let scene = closed()?;
    let usual = MatrixOptions::default();
    let closed = MatrixOptions { enclosure: true, ..usual };
    let split = MatrixOptions { patch_size: Some(0.2), threshold: 1e-3, ..usual };
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("F.npz");
    let mut found = Vec::new();
    for options in [usual, closed, split] {
        scene.form_factors(&options, &Silent)?.save(&path, &scene.geometry, &Silent)?;
        found.push(Input::new("F.npz", fs::read(&path)?));
    }
    Ok(found)
}

pub fn hemi() -> Sound {
    let folder = tempfile::tempdir()?;
    let load = |input: &Input| -> Result<Scene, Box<dyn Error>> {
        Ok(Scene::load(input.write(&folder.path().join(&input.files[0].0))?)?)
    };
    let rays = LightOptions {
        patch_size: Some(2.0),
        engine: EngineOptions::Rays(RaysOptions { samples: 32, seed: 0 }),
        ..LightOptions::default()
    };
    let exact = LightOptions { engine: EngineOptions::Exact(ExactOptions::default()), ..rays };
    let adaptive = Some(Adaptive { max_factor: 0.3, min_area: 0.1 });
    // A lamp with photometry, a mask, and the files of a model.
    let mut model = load(&gltf::glbs()?[0])?;
    let lamp = tables::ies()?[1].write(&folder.path().join("lamp"))?;
    model.set_photometry("s", ies::read(&lamp)?);
    model.sky = Rgb::splat(0.5);
    let leaf = load(&models::obj()?[2])?;
    Ok(vec![
        file(&closed()?, &LightOptions { adaptive, ..exact }, folder.path())?,
        file(&model, &rays, folder.path())?,
        file(&leaf, &exact, folder.path())?,
    ])
}

fn file(scene: &Scene, options: &LightOptions, folder: &Path) -> Result<Input, Box<dyn Error>> {
    let path = folder.join("m.hemi");
    let (store, factors) = scene.solve(sources(scene, &[])?, options, &Silent)?;
    write_hemi(&path, scene, &store, &factors, &Silent)?;
    Ok(Input::new("m.hemi", fs::read(&path)?))
}
