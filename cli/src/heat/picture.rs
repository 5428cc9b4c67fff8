//! A picture of temperatures (`--picture`).

use std::path::Path;

use hemicube::View;
use hemicube::heat::HeatBalance;
use hemicube::patches::PatchId;
use hemicube::reconstruct::Field;
use hemicube::render::{PictureOptions, Renderer, Seen, check};
use hemicube::scene::{Camera, Rgb, Scene};
use hemicube::tone::{FalseColour, Map};

use super::Model;
use crate::args::Heat;
use crate::failure::Failure;
use crate::render::picture_failure;
use crate::terminal::{Bar, say};

/// The view asked for, if there is to be a picture.
pub fn view(args: &Heat, scene: &Scene) -> Result<Option<View>, Failure> {
    if args.picture.is_none() {
        return Ok(None);
    }
    let mut view = match (args.eye, args.target) {
        (Some(eye), Some(target)) => {
            View::through(Camera { up: scene.up, ..Camera::at(eye, target) })
        }
        _ => View::of(scene).map_err(picture_failure)?,
    };
    if let Some(vfov) = args.vfov {
        view.camera.vfov = vfov.to_radians();
    }
    let (width, height) = args.size.unwrap_or((view.picture.width, view.picture.height));
    check(&view.camera, width, height).map_err(picture_failure)?;
    Ok(Some(View { picture: PictureOptions { width, height, ..view.picture }, ..view }))
}

/// Draws it.
pub fn draw(
    args: &Heat,
    path: &Path,
    view: &View,
    model: &Model<'_>,
    found: &HeatBalance,
    bar: &Bar,
) -> Result<(), Failure> {
    let patches = &model.matrix.patches;
    let mut temperatures = vec![None; patches.len()];
    for (i, face) in model.matrix.layout.faces.iter().enumerate() {
        if let Some(patch) = face.patch {
            temperatures[patch.index()] = found.sides[model.row_of(i)].temperature;
        }
    }
    let known: Vec<f64> = temperatures.iter().copied().flatten().collect();
    let values: Vec<Rgb> = temperatures.iter().map(|t| Rgb::splat(t.unwrap_or(0.0))).collect();
    let usable = |id: PatchId| temperatures[id.index()].is_some();
    let field = Field::new(&model.scene.geometry, patches, values, usable);
    let renderer = Renderer::new(model.scene, &field);
    let shown = |s: &hemicube::render::Sight| match s.seen {
        Seen::Surface if s.irradiance.x > 0.0 => [s.irradiance.x as f32, 1.0, 0.0],
        _ => [0.0; 3],
    };
    let (picture, _) = view.mapped_by(&renderer, shown, bar).map_err(picture_failure)?;
    let value = |p: &[f32; 3]| if p[1] > 0.5 { p[0] / p[1] } else { f32::NAN };
    let map = Map {
        width: picture.width,
        height: picture.height,
        values: picture.pixels.iter().map(value).collect(),
    };
    let low = known.iter().copied().fold(f64::INFINITY, f64::min);
    let high = known.iter().copied().fold(0.0, f64::max);
    let range = args.range.unwrap_or_else(|| spread(low, high));
    if !args.run.quiet {
        let [low, high] = range;
        say(&format!("{}: --range {low},{high} K", path.display()));
    }
    let colours = FalseColour { range: Some(range), unit: String::from("K") };
    bar.finish();
    colours.picture(&map).save(path).map_err(Failure::failed)
}

/// Round numbers about a range.
fn spread(low: f64, high: f64) -> [f64; 2] {
    if low >= high {
        let middle = if low.is_finite() { low } else { 0.0 };
        return [(middle - 1.0).max(0.0), middle + 1.0];
    }
    let step = 10_f64.powf((high - low).log10().floor()) / 2.0;
    [(low / step).floor() * step, (high / step).ceil() * step]
}
