//! Reads inputs as the program does.

use std::fmt::Display;
use std::fs;
use std::path::Path;
use std::sync::{Arc, OnceLock};

use glam::DVec3;
use hemicube::export::read_npz;
use hemicube::gather::{Gatherer, Table};
use hemicube::scene::{Lamp, Rgb, Scene, View3d, ies};
use hemicube::solution::{Solution, light_by};
use hemicube::visibility::Bvh;
use hemicube::{GatherOptions, Silent};

use crate::after::{self, MEMORY, light_options};
use crate::corpus::stored::closed;
use crate::kinds::Found;

pub fn text(error: impl Display) -> String {
    error.to_string()
}

pub fn model(path: &Path) -> Found {
    let scene = Scene::load(path).map_err(text)?;
    after::scene(&scene);
    Ok(())
}

pub fn view3d(path: &Path) -> Found {
    let task = View3d::load(path).map_err(text)?;
    assert_eq!(task.rows().len(), task.surfaces.len(), "rows of View3D");
    after::scene(&task.scene);
    Ok(())
}

/// A picture on a square, which it also cuts out and lets shine.
pub fn texture(path: &Path) -> Found {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let model = "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 3 0\nvt 3 3\nvt 0 3\n\
                 usemtl m\nf 1/1 2/2 3/3 4/4\n";
    let material =
        format!("newmtl m\nKd 1 1 1\nKe 1 1 1\nmap_Kd {name}\nmap_Ke {name}\nmap_d {name}");
    fs::write(path.with_file_name("m.mtl"), material).map_err(text)?;
    let file = path.with_file_name("m.obj");
    fs::write(&file, model).map_err(text)?;
    let scene = Scene::load(&file).map_err(text)?;
    after::scene(&scene);
    // A model is read without a picture that is broken.
    match scene.optics.textures.iter().find_map(|t| t.decode().err()) {
        Some(error) => Err(text(error)),
        None => Ok(()),
    }
}

pub fn photometry(path: &Path) -> Found {
    let photometry = ies::read(path).map_err(text)?;
    let flux = photometry.flux();
    assert!(flux.is_finite() && flux >= 0.0, "a flux of {flux}");
    let mut scene = closed().map_err(text)?;
    scene.optics.set_radiance(0, Rgb::ZERO);
    scene.lamps.push(Lamp::Point {
        name: "lamp".into(),
        position: DVec3::splat(0.1),
        intensity: Rgb::ONE,
        x_axis: DVec3::X,
        photometry: Some(Arc::new(photometry)),
    });
    after::scene(&scene);
    Ok(())
}

/// A scene and its light, made once.
fn lit() -> Result<&'static (Scene, Solution), String> {
    static LIT: OnceLock<Result<(Scene, Solution), String>> = OnceLock::new();
    let make = || {
        let scene = closed().map_err(text)?;
        let solution = scene.light(&light_options(&scene), &Silent).map_err(text)?.solution;
        Ok((scene, solution))
    };
    LIT.get_or_init(make).as_ref().map_err(Clone::clone)
}

pub fn points(path: &Path) -> Found {
    /// So many are measured.
    const MOST: usize = 16;
    let bytes = fs::read(path).map_err(text)?;
    let table = Table::parse(&String::from_utf8(bytes).map_err(text)?).map_err(text)?;
    assert_eq!(table.rows.len(), table.probes.len(), "rows of points");
    let (scene, solution) = lit()?;
    let (field, bvh) = (solution.field(scene), Bvh::new(&scene.geometry));
    let options = GatherOptions { samples: 256, shadow: 128, ..GatherOptions::default() };
    let gatherer = Gatherer::new(scene, solution, &field, &bvh, options);
    let found =
        gatherer.all(&table.probes[..table.probes.len().min(MOST)], &Silent).map_err(text)?;
    let known = found.iter().all(|e| e.irradiance.is_finite() && e.error.is_finite());
    assert!(known, "points: {found:?}");
    Ok(())
}

pub fn matrix(path: &Path) -> Found {
    let stored = read_npz(path, MEMORY).map_err(text)?;
    let scene = closed().map_err(text)?;
    let (patches, factors) = stored.restore(&scene.geometry, MEMORY).map_err(text)?;
    let options = light_options(&scene);
    let solution = light_by(&scene, patches, factors, &options, &Silent).map_err(text)?;
    after::check_light(&solution);
    Ok(())
}
