//! From a model file to a [`Scene`].

use std::fs;
use std::io;
use std::path::Path;

use glam::DVec3;

use super::builder::{MAX_REFLECTANCE, SceneBuilder};
use super::files::read_regular;
use super::geometry::{MAX_COORDINATE, Sides};
use super::lamp::Lamp;
use super::model::Scene;
use super::source::{ImportError, Place, Source};
use super::{gltf, obj, ply, stl, upright, vs3};

/// Which sides of triangles reflect.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SidesChoice {
    /// As the file says: glTF by `doubleSided`; both in the other formats, which do not say.
    #[default]
    File,
    /// Fronts only; backs absorb what arrives.
    One,
    /// Fronts and backs.
    Two,
}

/// How to read a model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ImportOptions {
    /// Metres per unit of the model (default 1).
    pub unit: f64,
    /// The direction that points upwards; by default as the format says (+y), or as the model
    /// stands (y or z) where it does not say. Coordinates stay as they are.
    pub up: Option<DVec3>,
    /// Reflectances above this are clamped to it, 0..1 (default .9).
    pub max_reflectance: f64,
    /// Which sides reflect (default: as the file says).
    pub sides: SidesChoice,
}

impl Default for ImportOptions {
    fn default() -> Self {
        Self { unit: 1.0, up: None, max_reflectance: MAX_REFLECTANCE, sides: SidesChoice::File }
    }
}

/// Reads a model: glTF 2.0 (`.gltf`, `.glb`), Wavefront OBJ (`.obj`), STL (`.stl`), PLY (`.ply`) or
/// View3D (`.vs3`).
///
/// What is doubtful, or was assumed, is in the scene's findings.
///
/// # Errors
/// If the file cannot be read or is broken, if it has no triangles, or if an option has no sense.
pub fn load(path: &Path, options: &ImportOptions) -> Result<Scene, ImportError> {
    check(options)?;
    look_at(path)?;
    let read = match extension(path).as_deref() {
        Some("gltf" | "glb") => gltf::read,
        Some("obj") => obj::read,
        Some("stl") => stl::read,
        Some("ply") => ply::read,
        Some("vs3") => {
            |source: &Source<'_>, builder: &mut SceneBuilder| vs3::read(source, builder).map(|_| ())
        }
        _ => return Err(ImportError::UnknownFormat { path: path.into() }),
    };
    load_by(path, options, read).map(|(scene, ())| scene)
}

fn extension(path: &Path) -> Option<String> {
    path.extension().map(|e| e.to_string_lossy().to_lowercase())
}

fn unreadable(path: &Path) -> impl Fn(io::Error) -> ImportError + '_ {
    |source| ImportError::Unreadable { path: path.into(), source }
}

/// Fails if there is no file.
pub(super) fn look_at(path: &Path) -> Result<(), ImportError> {
    match fs::metadata(path).map_err(unreadable(path))?.is_dir() {
        true => Err(ImportError::Directory { path: path.into() }),
        false => Ok(()),
    }
}

/// Reads a model with the importer of its format, and hands over what that returns beside it.
pub(super) fn load_by<T>(
    path: &Path,
    options: &ImportOptions,
    read: impl FnOnce(&Source<'_>, &mut SceneBuilder) -> Result<T, ImportError>,
) -> Result<(Scene, T), ImportError> {
    let bytes = read_regular(path).map_err(unreadable(path))?;
    if bytes.is_empty() {
        return Err(ImportError::Empty { path: path.into() });
    }
    let name = path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
    let mut builder = SceneBuilder::new(name);
    builder.max_reflectance(options.max_reflectance);
    if let Some(up) = options.up {
        builder.up(up.normalize());
    }
    let source = Source::new(path, &bytes);
    let beside = read(&source, &mut builder)?;
    let mut scene = builder.finish();
    if options.up.is_none() {
        // Most printers of solids, and of buildings, have z upwards, most other programs y.
        scene.up = match extension(path).as_deref() {
            Some("stl" | "vs3") => upright::guess(&scene.geometry, DVec3::Z),
            Some("ply") => upright::guess(&scene.geometry, DVec3::Y),
            Some("obj") => upright::doubt(&scene.geometry),
            _ => scene.up,
        };
    }
    if scene.geometry.is_empty() {
        return Err(ImportError::NoTriangles { path: path.into() });
    }
    scene.files = source.found.take();
    scene.files.push(path.into());
    scene.files.sort();
    scene.files.dedup();
    scale(&mut scene, options.unit);
    let in_range = |v: &DVec3| v.is_finite() && v.abs().max_element() <= MAX_COORDINATE;
    let too_far = |place: String| {
        let place = Place::Element(place);
        Err(ImportError::TooFar { path: path.into(), place, limit: MAX_COORDINATE })
    };
    if !scene.geometry.vertices.iter().all(in_range) {
        return too_far("vertices".into());
    }
    if let Some(lamp) = scene.lamps.iter().find(|l| !l.position().iter().all(in_range)) {
        return too_far(format!("light {}", lamp.name()));
    }
    scene.choose_sides(options.sides);
    Ok((scene, beside))
}

fn check(options: &ImportOptions) -> Result<(), ImportError> {
    let ImportOptions { unit, up, max_reflectance, .. } = *options;
    if !(unit.is_finite() && unit > 0.0) {
        return Err(ImportError::Unit(unit));
    }
    if !(0.0..1.0).contains(&max_reflectance) {
        return Err(ImportError::MaxReflectance(max_reflectance));
    }
    if let Some(up) = up.filter(|up| !up.is_finite() || up.length_squared() <= 0.0) {
        return Err(ImportError::Up(up));
    }
    Ok(())
}

fn scale(scene: &mut Scene, unit: f64) {
    // Not even a factor of one, so that coordinates keep their bits.
    if unit == 1.0 {
        return;
    }
    for v in &mut scene.geometry.vertices {
        *v *= unit;
    }
    for camera in &mut scene.cameras {
        camera.eye *= unit;
    }
    for lamp in &mut scene.lamps {
        match lamp {
            Lamp::Point { position, .. } | Lamp::Spot { position, .. } => *position *= unit,
            Lamp::Directional { .. } => {}
        }
    }
}

impl Scene {
    /// Reads a model as its file says, in metres; [`load`] takes options.
    ///
    /// # Errors
    /// As [`load`].
    pub fn load(path: impl AsRef<Path>) -> Result<Self, ImportError> {
        load(path.as_ref(), &ImportOptions::default())
    }

    /// Lets other sides reflect than the model says; what only blocks goes on to do so.
    pub fn choose_sides(&mut self, choice: SidesChoice) {
        let sides = match choice {
            SidesChoice::File => return,
            SidesChoice::One => Sides::One,
            SidesChoice::Two => Sides::Two,
        };
        self.geometry.choose_sides(sides);
        if sides == Sides::One {
            for material in &mut self.optics.materials {
                material.emits_both = false;
            }
        }
    }

    /// Turns every triangle round: fronts become backs.
    pub fn flip(&mut self) {
        self.geometry.flip();
        for uv in &mut self.optics.uv {
            uv.swap(1, 2);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::source::FORMATS;

    fn message(path: &Path) -> String {
        load(path, &ImportOptions::default()).unwrap_err().to_string()
    }

    #[test]
    fn paths_that_are_no_models_are_clear_errors() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::write(at("empty.obj"), "").unwrap();
        fs::write(at("model.fbx"), "x").unwrap();
        fs::write(at("bare"), "x").unwrap();
        fs::create_dir(at("folder.obj")).unwrap();
        assert!(message(&at("gone.obj")).contains("gone.obj: cannot be read"));
        assert!(message(&at("empty.obj")).contains("empty.obj: is empty"));
        assert!(message(&at("folder.obj")).contains("is a directory; name the model file"));
        for name in ["model.fbx", "bare"] {
            assert!(message(&at(name)).contains(FORMATS));
        }
        let error = load(&at("folder.obj"), &ImportOptions::default());
        assert!(matches!(error, Err(ImportError::Directory { .. })));
    }

    #[cfg(unix)]
    #[test]
    fn pipes_and_devices_are_refused_at_once() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        std::os::unix::net::UnixListener::bind(at("socket.obj")).unwrap();
        std::os::unix::fs::symlink("/dev/zero", at("endless.ply")).unwrap();
        fs::File::create(at("huge.stl")).unwrap().set_len(1 << 40).unwrap();
        assert!(message(&at("socket.obj")).contains("socket.obj: cannot be read (it is a pipe"));
        assert!(message(&at("endless.ply")).contains("endless.ply: cannot be read (it is a pipe"));
        assert!(message(&at("huge.stl")).contains("huge.stl: cannot be read (it has more than"));
        // Beside a model, they are as good as missing.
        let model = "mtllib endless.ply\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
        fs::write(at("model.obj"), model).unwrap();
        let scene = load(&at("model.obj"), &ImportOptions::default()).unwrap();
        assert!(scene.findings.iter().any(|f| f.message.contains("endless.ply is missing")));
    }

    #[test]
    fn three_megabytes_of_noise_are_one_error() {
        let mut state = 1_u64;
        let noise: Vec<u8> = (0..3 << 20)
            .map(|_| {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                (state >> 56) as u8
            })
            .collect();
        let folder = tempfile::tempdir().unwrap();
        for name in ["noise.obj", "noise.gltf", "noise.glb", "noise.stl", "noise.ply", "noise.vs3"]
        {
            let path = folder.path().join(name);
            fs::write(&path, &noise).unwrap();
            let message = message(&path);
            assert!(message.contains(name) && message.len() < 500, "{message}");
        }
    }

    #[test]
    fn coordinates_out_of_range_are_errors() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("m.OBJ");
        fs::write(&path, "v 1e20 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
        assert!(message(&path).contains("exceeds 1e15 metres"));
        let small = ImportOptions { unit: 1e-10, ..ImportOptions::default() };
        assert_eq!(load(&path, &small).unwrap().name, "m");
    }
}
