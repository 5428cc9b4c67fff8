//! The pictures of `hemicube render`: which views, into which files, and what they show.

use std::path::{Path, PathBuf};

use hemicube::View;
use hemicube::export::{PICTURE_FORMATS, PictureFormat};
use hemicube::render::{Picture, PictureOptions, PixelErrors, Renderer, check};
use hemicube::scene::{Camera, Scene, luminance};
use hemicube::tone::{FalseColour, KEY, Map, contact_sheet};

use crate::args::{Exposure, Render};
use crate::failure::Failure;
use crate::outputs;
use crate::render::{inputs, picture_failure, tone_of};
use crate::terminal::{Bar, say};

/// The share of a picture that its error is stated for.
const MOST_OF_A_PICTURE: f64 = 0.8;

/// The error that a map shows white, where none is asked for.
const FULL: f64 = 0.1;

/// What stands for the name of a camera in names of files.
const CAMERA: &str = "{camera}";

/// The views asked for; `exposure` is what a stage's light was made for.
pub fn views(
    cameras: Vec<Camera>,
    exposure: Option<f64>,
    args: &Render,
) -> Result<Vec<View>, Failure> {
    let view = |camera: Camera| {
        let usual = View::through(camera.clone()).picture;
        let (width, height) = args.size.unwrap_or((usual.width, usual.height));
        check(&camera, width, height).map_err(picture_failure)?;
        Ok(View {
            picture: PictureOptions { width, height, ..PictureOptions::default() },
            exposure: match args.look.exposure {
                Exposure::Auto => exposure,
                Exposure::Stops(stops) => Some(stops),
            },
            tone: tone_of(args.look.tone),
            ..View::through(camera)
        })
    };
    cameras.into_iter().map(view).collect()
}

/// The files that pictures go to.
pub struct Outputs {
    /// One a view; none if only a sheet is wanted.
    pictures: Vec<PathBuf>,
    sheet: Option<PathBuf>,
    map: Option<PathBuf>,
}

impl Outputs {
    /// Those asked for, checked before any work is done.
    pub fn of(scene: &Scene, views: &[View], args: &Render) -> Result<Self, Failure> {
        let many = views.len() > 1;
        let name = match &args.output {
            Some(name) => Some(name.clone()),
            None if many && args.contact_sheet.is_some() => None,
            None if many => Some(PathBuf::from(format!("{}-{CAMERA}.png", scene.name))),
            None => Some(PathBuf::from(format!("{}.png", scene.name))),
        };
        let has_place = |p: &Path| p.to_string_lossy().contains(CAMERA);
        if let Some(name) = name.as_ref().filter(|n| many && !has_place(n)) {
            return Err(Failure::Input(format!(
                "{}: {} views cannot go into one file; write {CAMERA} where their names belong",
                name.display(),
                views.len()
            )));
        }
        let pictures: Vec<PathBuf> = match &name {
            Some(name) => views.iter().map(|v| named(name, &v.camera.name)).collect(),
            None => Vec::new(),
        };
        let me = Self { pictures, sheet: args.contact_sheet.clone(), map: args.error_map.clone() };
        if many && me.map.is_some() {
            return Err(Failure::input("--error-map is of one view; give one --camera"));
        }
        for path in &me.pictures {
            if PictureFormat::of(path).is_none() {
                let text = format!("{}: pictures are written as {PICTURE_FORMATS}", path.display());
                return Err(Failure::Input(text));
            }
        }
        let plain = |p: &&PathBuf| PictureFormat::of(p).is_some_and(|f| !f.is_of_radiance());
        let coloured = args.false_colour.is_some();
        if let Some(path) = me.pictures.iter().find(|p| coloured && !plain(p)) {
            let text = format!("{}: false colour is written as .png or .jpg", path.display());
            return Err(Failure::Input(text));
        }
        for (path, what) in [(&me.sheet, "sheets"), (&me.map, "maps")] {
            if let Some(path) = path.as_ref().filter(|p| !plain(p)) {
                let text = format!("{}: {what} are written as .png or .jpg", path.display());
                return Err(Failure::Input(text));
            }
        }
        let mut files: Vec<(&str, Option<&PathBuf>)> =
            me.pictures.iter().map(|p| ("-o", Some(p))).collect();
        files.push(("--contact-sheet", me.sheet.as_ref()));
        files.push(("--error-map", me.map.as_ref()));
        files.push(("--report", args.look.light.run.report.as_ref()));
        outputs::check(&files, inputs(scene, &args.look.input, &args.look.light))?;
        Ok(me)
    }

    /// All of them.
    pub fn all(&self) -> impl Iterator<Item = &PathBuf> {
        self.pictures.iter().chain(&self.sheet)
    }
}

/// A file's name with that of a camera in its place.
fn named(name: &Path, camera: &str) -> PathBuf {
    let harmless = |c: char| if c.is_alphanumeric() || "-_.".contains(c) { c } else { '_' };
    let camera: String = camera.chars().map(harmless).collect();
    PathBuf::from(name.to_string_lossy().replace(CAMERA, &camera))
}

/// What pictures turned out like.
pub struct Taken {
    /// The exposure of display light.
    pub stops: Option<f64>,
    /// How well light is known on most of the pictures: all, and what is the solution's.
    pub known: Option<[f64; 2]>,
}

/// Takes pictures and writes them.
pub struct Pictures<'a> {
    pub renderer: &'a Renderer<'a>,
    pub outputs: &'a Outputs,
    pub args: &'a Render,
    pub bar: &'a Bar,
}

impl Pictures<'_> {
    /// Takes all views, alike exposed.
    pub fn take(&self, views: &[View]) -> Result<Taken, Failure> {
        let factor = self.exposure(views)?.exp2();
        let mut for_sheet = Vec::new();
        let mut known: Option<[f64; 2]> = None;
        let mut displays = false;
        for (i, view) in views.iter().enumerate() {
            let path = self.outputs.pictures.get(i);
            let format = path.and_then(|p| PictureFormat::of(p));
            let errors = if self.args.false_colour.is_some() {
                let (picture, errors) = self.coloured(view)?;
                self.save(path, &picture)?;
                for_sheet.push((view.camera.name.clone(), picture));
                errors
            } else if format.is_some_and(PictureFormat::is_of_radiance) {
                let radiance = view
                    .mapped_by(self.renderer, |s| s.radiance.as_vec3().to_array(), self.bar)
                    .map_err(picture_failure)?;
                self.save(path, &radiance.0)?;
                for_sheet.push((view.camera.name.clone(), shown(view, &radiance.0, factor)));
                radiance.1
            } else {
                displays = true;
                let view = View { exposure: Some(factor.log2()), ..view.clone() };
                let shot = view.taken_by(self.renderer, self.bar).map_err(picture_failure)?;
                self.save(path, &shot.picture)?;
                for_sheet.push((view.camera.name.clone(), shot.picture));
                shot.errors
            };
            if let Some(errors) = errors {
                let [a, b] = errors.below(MOST_OF_A_PICTURE);
                known = known.map_or(Some([a, b]), |[c, d]| Some([a.max(c), b.max(d)]));
                self.map(&errors)?;
            }
            if self.outputs.sheet.is_none() {
                for_sheet.clear();
            }
        }
        if let Some(path) = &self.outputs.sheet {
            self.save(Some(path), &contact_sheet(&for_sheet))?;
        }
        Ok(Taken { stops: displays.then(|| factor.log2()), known })
    }

    /// The exposure in stops: what was asked for, or the middle of what suits each view.
    fn exposure(&self, views: &[View]) -> Result<f64, Failure> {
        if let Some(stops) = views[0].exposure {
            return Ok(stops);
        }
        let suits = |v: &View| {
            let aspect = v.picture.width as f64 / v.picture.height as f64;
            self.renderer.auto_exposure(&v.camera, aspect, KEY).map_err(picture_failure)
        };
        let mut all = views.iter().map(suits).collect::<Result<Vec<f64>, _>>()?;
        all.sort_by(f64::total_cmp);
        Ok(all[all.len() / 2].log2())
    }

    /// Illuminance in colours.
    fn coloured(&self, view: &View) -> Result<(Picture, Option<PixelErrors>), Failure> {
        let unit = self.args.false_colour.map_or("", |u| u.text());
        // What emits or is empty has no part in a pixel's mean.
        let (picture, errors) = view
            .mapped_by(
                self.renderer,
                |s| if s.reflects { [luminance(s.irradiance) as f32, 1.0, 0.0] } else { [0.0; 3] },
                self.bar,
            )
            .map_err(picture_failure)?;
        let value = |p: &[f32; 3]| if p[1] > 0.5 { p[0] / p[1] } else { f32::NAN };
        let map = Map {
            width: picture.width,
            height: picture.height,
            values: picture.pixels.iter().map(value).collect(),
        };
        let colours = FalseColour { range: self.args.range, unit: unit.into() };
        if !self.args.look.light.run.quiet {
            let [low, high] = colours.range_of(&map);
            say(&format!("{}: --range {low},{high} {unit}", view.camera.name));
        }
        Ok((colours.picture(&map), errors))
    }

    /// How well pixels are known, as a picture, if that is wanted.
    fn map(&self, errors: &PixelErrors) -> Result<(), Failure> {
        let Some(path) = &self.outputs.map else { return Ok(()) };
        let full = self.args.look.light.error_of_light().map_or(FULL, |e| 2.0 * e);
        self.save(Some(path), &errors.picture(full))?;
        if !self.args.look.light.run.quiet {
            say(&format!(
                "{}: black 0 %, red {:.2} %, yellow {:.2} %, white {:.2} % or more of what is \
                 seen: half-widths of 95 % intervals",
                path.display(),
                100.0 * full / 3.0,
                200.0 * full / 3.0,
                100.0 * full
            ));
        }
        Ok(())
    }

    fn save(&self, path: Option<&PathBuf>, picture: &Picture) -> Result<(), Failure> {
        self.bar.finish();
        path.map_or(Ok(()), |path| picture.save(path).map_err(Failure::failed))
    }
}

/// Display light of a picture of radiance.
fn shown(view: &View, radiance: &Picture, factor: f64) -> Picture {
    let map = |p: &[f32; 3]| view.tone.map(glam::DVec3::from(p.map(f64::from)) * factor);
    Picture { pixels: radiance.pixels.iter().map(map).collect(), ..*radiance }
}
