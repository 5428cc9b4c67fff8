//! What follows once something was read: a short way through the library, and whether anything came
//! of it that no light can be.

use std::path::Path;

use hemicube::bake::{Bake, BakeOptions};
use hemicube::engines::{EngineOptions, RaysOptions};
use hemicube::export::{BakeMode, read_factors, read_scene, read_sources, read_store, write_glb};
use hemicube::gather::Gatherer;
use hemicube::matrix::Rows;
use hemicube::patches::Patches;
use hemicube::render::{Renderer, Sight};
use hemicube::scene::{Rgb, Scene, inspect};
use hemicube::solution::Solution;
use hemicube::visibility::Bvh;
use hemicube::{GatherOptions, LightOptions, LitScene, MatrixOptions, Probe, Silent, View};

use crate::kinds::Found;
use crate::read::text;

/// Bytes that work may take.
pub const MEMORY: u64 = 1 << 28;

/// Models of more triangles are not lit.
const MOST_LIT: usize = 500;

/// Those of more have no matrix made.
const MOST_ROWS: usize = 40;

/// Few patches and few rays.
pub fn light_options(scene: &Scene) -> LightOptions {
    LightOptions {
        patch_size: Some(Patches::area_adding(&scene.geometry, 40)),
        engine: EngineOptions::Rays(RaysOptions { samples: 32, seed: 0 }),
        memory: MEMORY,
        ..LightOptions::default()
    }
}

/// Looks at a scene, and does one of several things with it. All may be refused; what comes of it
/// must be finite.
pub fn scene(scene: &Scene) {
    let _ = inspect(scene);
    let way = scene.geometry.fingerprint()[0] % 4;
    if way == 0 && scene.geometry.len() <= MOST_ROWS {
        check_matrix(scene);
    } else if scene.geometry.len() <= MOST_LIT {
        let Ok(lit) = scene.light(&light_options(scene), &Silent) else { return };
        check_light(&lit.solution);
        match way {
            1 => check_points(&lit),
            2 => check_picture(&lit),
            _ if scene.geometry.len() <= MOST_ROWS => bake(&lit),
            _ => {}
        }
    }
}

/// Light at a corner of the model.
fn check_points(lit: &LitScene<'_>) {
    let (point, normal) = (lit.scene.geometry.vertices[0], lit.scene.up.normalize_or_zero());
    let options = GatherOptions { samples: 256, shadow: 128, ..GatherOptions::default() };
    let found = lit.probe(&[Probe { point, normal }], options, &Silent).unwrap_or_default();
    assert!(found.iter().all(|e| e.irradiance.is_finite()), "a point: {found:?}");
}

fn check_picture(lit: &LitScene<'_>) {
    let Ok(mut view) = View::of(lit.scene) else { return };
    (view.picture.width, view.picture.height, view.picture.samples) = (12, 8, 1);
    let Ok(picture) = lit.look(&view, &Silent) else { return };
    let known = picture.pixels.as_flattened().iter().all(|c| c.is_finite());
    assert!(known, "a picture: {:?}", picture.pixels);
}

/// Bakes few texels, and writes the model that they belong to.
fn bake(lit: &LitScene<'_>) {
    /// Of the longest side of the model.
    const TEXEL: f64 = 0.1;
    let LitScene { scene, solution } = lit;
    let Some((low, high)) = scene.geometry.bounds() else { return };
    let (field, bvh) = (lit.field(), Bvh::new(&scene.geometry));
    let gatherer = Gatherer::new(scene, solution, &field, &bvh, GatherOptions::of_pictures(0));
    let renderer = Renderer::gathering(scene, &field, &gatherer);
    let texel = Some(TEXEL * (high - low).max_element());
    let options = BakeOptions { texel, memory: MEMORY };
    let shown = |s: &Sight| s.radiance.as_vec3().to_array();
    let Ok(bake) = Bake::new(scene, solution, &renderer, &options, shown, &Silent) else { return };
    let known = bake.irradiance().as_flattened().iter().all(|e| e.is_finite());
    assert!(known, "baked light: {:?}", bake.irradiance());
    if let Ok(file) = tempfile::NamedTempFile::with_suffix(".glb") {
        let _ = write_glb(file.path(), scene, &bake, BakeMode::Lightmap { keeps_lamps: true });
    }
}

fn check_matrix(scene: &Scene) {
    /// Rounding may leave a factor a little above 1.
    const MOST: f64 = 1.01;
    let options = MatrixOptions { memory: MEMORY, ..MatrixOptions::default() };
    let Ok(matrix) = scene.form_factors(&options, &Silent) else { return };
    let (mut columns, mut values) = (Vec::new(), Vec::new());
    for i in 0..matrix.len() {
        if matrix.row(i, &mut columns, &mut values).is_ok() {
            let sound = values.iter().all(|f| (0.0..=MOST).contains(f));
            assert!(sound, "row {i} of a matrix: {values:?}");
        }
    }
}

pub fn check_light(solution: &Solution) {
    /// Sampled light may be a little below zero, as a share of the brightest.
    const NOISE: f64 = 0.01;
    let all = solution.irradiance.iter();
    let least = -NOISE * all.map(|h| h.max_element()).fold(0.0, f64::max);
    let sound = |h: &Rgb| h.is_finite() && h.min_element() >= least;
    let wrong = solution.irradiance.iter().find(|h| !sound(h));
    assert!(wrong.is_none(), "irradiance of a patch: {wrong:?}");
}

/// Numbers that were stored are believed if they are numbers.
fn check_stored(solution: &Solution) {
    assert!(solution.irradiance.iter().all(|h| h.is_finite()), "irradiance of a solution");
}

/// Reads a file of solutions part by part, mixes them, and solves them for another reflectance.
pub fn solutions(path: &Path) -> Found {
    read_sources(path).map_err(text)?;
    let mut read = read_scene(path).map_err(text)?;
    scene(&read);
    let store = read_store(path, &read, MEMORY, &Silent).map_err(text)?;
    check_stored(&store.mix(&read).map_err(text)?);
    let factors = read_factors(path, MEMORY).map_err(text)?;
    if !read.optics.materials.is_empty() {
        read.optics.set_reflectance(0, Rgb::splat(0.3));
    }
    let options = light_options(&read);
    let again = store.solve_mixed(&read, &factors, &options, &Silent).map_err(text)?;
    check_stored(&again.map_err(text)?);
    Ok(())
}
