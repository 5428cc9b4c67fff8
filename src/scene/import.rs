//! From a model file to a [`Scene`].

use std::fmt;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use glam::DVec3;

use super::builder::{MAX_REFLECTANCE, SceneBuilder};
use super::geometry::Sides;
use super::{Lamp, Scene, gltf, obj, ply, stl};

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
    /// The direction that points upwards; by default as the format says (+y). Coordinates stay as
    /// they are.
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

/// Why a model could not be read: the file, the place in it, and what to do.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// The file, or one that it refers to, cannot be opened or read.
    #[error("{}: cannot be read ({source}); check the path and its permissions", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The path is a directory.
    #[error("{}: is a directory; name the model file in it ({READ})", path.display())]
    Directory {
        /// The directory.
        path: PathBuf,
    },
    /// The file has no bytes.
    #[error("{}: is empty; export the model again", path.display())]
    Empty {
        /// The file.
        path: PathBuf,
    },
    /// The file's extension is not one that is read.
    #[error("{}: is not of a kind that can be read ({READ}); export the model as one of them", path.display())]
    UnknownFormat {
        /// The file.
        path: PathBuf,
    },
    /// Something in the file is wrong.
    #[error("{}: {place}: {problem}; {remedy}", path.display())]
    Malformed {
        /// The file.
        path: PathBuf,
        /// The line, node, accessor, ...
        place: Place,
        /// What is wrong there.
        problem: String,
        /// What to do about it.
        remedy: String,
    },
    /// The file needs an extension of its format that is not supported.
    #[error("{}: needs the extension {extension}, which is not supported; {remedy}", path.display())]
    Extension {
        /// The file.
        path: PathBuf,
        /// The extension's name.
        extension: String,
        /// What to do about it.
        remedy: String,
    },
    /// The file has no surface for light to fall on.
    #[error("{}: has no triangles; export the model with its meshes", path.display())]
    NoTriangles {
        /// The file.
        path: PathBuf,
    },
    /// The model is larger than can be dealt with.
    #[error("{}: {place}: makes more than {limit} {what}; simplify the model", path.display())]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// Where the limit was passed.
        place: Place,
        /// Triangles or vertices.
        what: &'static str,
        /// The largest allowed number.
        limit: usize,
    },
    /// An option has no sense.
    #[error("{0}")]
    Options(String),
}

/// A place in a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Place {
    /// A line, counted from 1.
    Line(usize),
    /// An element of the document, such as `node 3 (chair)`.
    Element(String),
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Line(n) => write!(f, "line {n}"),
            Self::Element(name) => f.write_str(name),
        }
    }
}

const READ: &str = ".gltf, .glb, .obj, .stl or .ply";

/// Most triangles and vertices of a scene. A small file can ask for more than any memory holds by
/// instancing a mesh over and over.
pub(super) const MAX_ELEMENTS: usize = 1 << 25;

/// Largest coordinate in metres: beyond it areas overflow the `f32` kernels.
const MAX_COORDINATE: f64 = 1e15;

/// A file being read.
pub(super) struct Source<'a> {
    pub path: &'a Path,
    pub bytes: &'a [u8],
}

impl Source<'_> {
    /// Something is wrong at a place in this file.
    pub fn malformed(
        &self,
        place: Place,
        problem: impl Into<String>,
        remedy: impl Into<String>,
    ) -> SceneError {
        SceneError::Malformed {
            path: self.path.into(),
            place,
            problem: problem.into(),
            remedy: remedy.into(),
        }
    }

    /// Fails if the scene would grow beyond what can be dealt with.
    pub fn check_size(
        &self,
        count: usize,
        what: &'static str,
        place: impl FnOnce() -> Place,
    ) -> Result<(), SceneError> {
        if count > MAX_ELEMENTS {
            let (path, limit) = (self.path.into(), MAX_ELEMENTS);
            return Err(SceneError::TooLarge { path, place: place(), what, limit });
        }
        Ok(())
    }

    /// The path of a file that this one refers to: as given, or else by its bare name beside this
    /// file, as references often carry the folders of another machine.
    pub fn beside(&self, reference: &str) -> Option<PathBuf> {
        let folder = self.path.parent().unwrap_or_else(|| Path::new(""));
        let reference = reference.replace('\\', "/");
        let name = reference.rsplit('/').next().unwrap_or_default();
        [folder.join(&reference), folder.join(name)].into_iter().find(|p| p.is_file())
    }
}

/// Reads a model: glTF 2.0 (`.gltf`, `.glb`), Wavefront OBJ (`.obj`), STL (`.stl`) or PLY (`.ply`).
///
/// What is doubtful, or was assumed, is in the scene's findings.
///
/// # Errors
/// If the file cannot be read or is broken, if it has no triangles, or if an option has no sense.
pub fn load(path: &Path, options: &ImportOptions) -> Result<Scene, SceneError> {
    check(options)?;
    let unreadable = |source| SceneError::Unreadable { path: path.into(), source };
    let metadata = fs::metadata(path).map_err(unreadable)?;
    if metadata.is_dir() {
        return Err(SceneError::Directory { path: path.into() });
    }
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
    let read = match extension.as_deref() {
        Some("gltf" | "glb") => gltf::read,
        Some("obj") => obj::read,
        Some("stl") => stl::read,
        Some("ply") => ply::read,
        _ => return Err(SceneError::UnknownFormat { path: path.into() }),
    };
    let bytes = fs::read(path).map_err(unreadable)?;
    if bytes.is_empty() {
        return Err(SceneError::Empty { path: path.into() });
    }
    let name = path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
    let mut builder = SceneBuilder::new(name);
    builder.max_reflectance(options.max_reflectance);
    if let Some(up) = options.up {
        builder.up(up.normalize());
    }
    let source = Source { path, bytes: &bytes };
    read(&source, &mut builder)?;
    let mut scene = builder.finish();
    if scene.geometry.is_empty() {
        return Err(SceneError::NoTriangles { path: path.into() });
    }
    scale(&mut scene, options.unit);
    let in_range = |v: &DVec3| v.is_finite() && v.abs().max_element() <= MAX_COORDINATE;
    if !scene.geometry.vertices.iter().all(in_range) {
        return Err(source.malformed(
            Place::Element("vertices".into()),
            format!("a coordinate exceeds {MAX_COORDINATE:e} metres"),
            "check the model's scale and --unit",
        ));
    }
    scene.choose_sides(options.sides);
    Ok(scene)
}

fn check(options: &ImportOptions) -> Result<(), SceneError> {
    let fail = |message: String| Err(SceneError::Options(message));
    if !(options.unit.is_finite() && options.unit > 0.0) {
        return fail(format!("--unit must be a positive length, not {} m", options.unit));
    }
    if !(0.0..1.0).contains(&options.max_reflectance) {
        return fail(format!(
            "--max-reflectance must be at least 0 and below 1, not {}",
            options.max_reflectance
        ));
    }
    if options.up.is_some_and(|up| !up.is_finite() || up.length_squared() <= 0.0) {
        return fail("--up must be a direction other than zero".into());
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
    /// Lets other sides reflect than the model says.
    pub fn choose_sides(&mut self, choice: SidesChoice) {
        let sides = match choice {
            SidesChoice::File => return,
            SidesChoice::One => Sides::One,
            SidesChoice::Two => Sides::Two,
        };
        self.geometry.sides.fill(sides);
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
            assert!(message(&at(name)).contains(READ));
        }
        let error = load(&at("folder.obj"), &ImportOptions::default());
        assert!(matches!(error, Err(SceneError::Directory { .. })));
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
        for name in ["noise.obj", "noise.gltf", "noise.glb", "noise.stl", "noise.ply"] {
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
