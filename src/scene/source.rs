//! A file that is read: its name, its bytes, places in it, and what may be wrong with it.

use std::cell::RefCell;
use std::fmt;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::DVec3;

use super::files::read_regular;
use super::geometry::MAX_ELEMENTS;
use super::shortened::{abridged, shortened};

/// Why a model could not be read: the file, the place in it, and what to do.
#[derive(Debug, thiserror::Error)]
pub enum ImportError {
    /// The file, or one that it refers to, cannot be opened or read.
    #[error("{}: cannot be read ({source}); check the path and its permissions", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The path is a directory.
    #[error("{}: is a directory; name the model file in it ({FORMATS})", path.display())]
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
    #[error(
        "{}: is not of a kind that can be read ({FORMATS}); export the model as one of them",
        path.display()
    )]
    UnknownFormat {
        /// The file.
        path: PathBuf,
    },
    /// Something in the file is wrong.
    #[error("{}: {}; {remedy}", path.display(), abridged(&format!("{place}: {problem}")))]
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
    #[error(
        "{}: needs the extension {}, which is not supported; {remedy}",
        path.display(), shortened(extension)
    )]
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
    /// A coordinate lies beyond what single precision can deal with.
    #[error(
        "{}: {place}: a coordinate exceeds {limit:e} metres; check the model's scale",
        path.display()
    )]
    TooFar {
        /// The file.
        path: PathBuf,
        /// What lies there.
        place: Place,
        /// The largest allowed coordinate in metres.
        limit: f64,
    },
    /// The unit asked for is no length.
    #[error("the model's unit must be a positive length, not {0} m")]
    Unit(f64),
    /// The largest reflectance asked for is none.
    #[error("the largest reflectance must be at least 0 and below 1, not {0}")]
    MaxReflectance(f64),
    /// The direction upwards asked for is none.
    #[error("{0} is no direction for upwards: it is zero, or not finite")]
    Up(DVec3),
}

/// The extensions of model files that are read.
pub(super) const FORMATS: &str = ".gltf, .glb, .obj, .stl, .ply or .vs3";

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

/// What to do about a file whose parts do not fit together.
pub(super) const EXPORT_AGAIN: &str = "export the model again";

/// A file being read.
pub(super) struct Source<'a> {
    pub path: &'a Path,
    pub bytes: &'a [u8],
    /// Files that it was found to refer to.
    pub found: RefCell<Vec<PathBuf>>,
    /// The files that there are, if they are not where the path says.
    held: &'a [(PathBuf, Arc<[u8]>)],
}

impl<'a> Source<'a> {
    pub fn new(path: &'a Path, bytes: &'a [u8]) -> Self {
        Self { path, bytes, found: RefCell::default(), held: &[] }
    }

    /// One of files that are held.
    pub fn held(path: &'a Path, bytes: &'a [u8], held: &'a [(PathBuf, Arc<[u8]>)]) -> Self {
        Self { held, ..Self::new(path, bytes) }
    }

    /// The bytes of a file that this one refers to.
    pub fn read(&self, path: &Path) -> io::Result<Arc<[u8]>> {
        match self.held.iter().find(|h| h.0 == path) {
            Some((_, bytes)) => Ok(Arc::clone(bytes)),
            None => read_regular(path).map(Into::into),
        }
    }

    /// Something is wrong at a place in this file.
    pub fn malformed(
        &self,
        place: Place,
        problem: impl Into<String>,
        remedy: impl Into<String>,
    ) -> ImportError {
        ImportError::Malformed {
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
    ) -> Result<(), ImportError> {
        if count > MAX_ELEMENTS {
            let (path, limit) = (self.path.into(), MAX_ELEMENTS);
            return Err(ImportError::TooLarge { path, place: place(), what, limit });
        }
        Ok(())
    }

    /// The path of a file that this one refers to: as given, or else by its bare name beside this
    /// file, as references often carry the folders of another machine.
    pub fn beside(&self, reference: &str) -> Option<PathBuf> {
        let folder = self.path.parent().unwrap_or_else(|| Path::new(""));
        let reference = reference.replace('\\', "/");
        let name = reference.rsplit('/').next().unwrap_or_default();
        let mut places = [folder.join(&reference), folder.join(name)].into_iter();
        let is_held = |p: &PathBuf| self.held.iter().any(|h| h.0 == *p);
        let path = places.find(|p| if self.held.is_empty() { p.is_file() } else { is_held(p) })?;
        self.found.borrow_mut().push(path.clone());
        Some(path)
    }
}
