//! The kinds of input: what is sound, and what reads it.

use std::path::Path;

use crate::after;
use crate::corpus::{self, Sound};
use crate::read;
use crate::shared;

/// Nothing if it was read, or why it was refused.
pub type Found = Result<(), String>;

/// A kind of input.
pub struct Kind {
    pub name: &'static str,
    /// Extensions of files of this kind.
    pub endings: &'static [&'static str],
    /// Makes the inputs that are changed.
    pub sound: fn() -> Sound,
    /// Reads one, and tries what comes of it.
    pub read: fn(&Path) -> Found,
}

pub const KINDS: &[Kind] = &[
    Kind { name: "obj", endings: &["obj"], sound: corpus::models::obj, read: read::model },
    Kind { name: "stl", endings: &["stl"], sound: corpus::solids::stl, read: read::model },
    Kind { name: "ply", endings: &["ply"], sound: corpus::solids::ply, read: read::model },
    Kind { name: "gltf", endings: &["gltf"], sound: corpus::gltf::gltf, read: read::model },
    Kind { name: "glb", endings: &["glb"], sound: corpus::gltf::glbs, read: read::model },
    Kind { name: "vs3", endings: &["vs3"], sound: corpus::models::vs3, read: read::view3d },
    Kind {
        name: "texture",
        endings: &["png", "jpg", "jpeg"],
        sound: corpus::images::images,
        read: read::texture,
    },
    Kind { name: "ies", endings: &["ies"], sound: corpus::tables::ies, read: read::photometry },
    Kind { name: "points", endings: &["csv"], sound: corpus::tables::points, read: read::points },
    Kind { name: "npz", endings: &["npz"], sound: corpus::stored::npz, read: read::matrix },
    Kind { name: "hemi", endings: &["hemi"], sound: corpus::stored::hemi, read: after::solutions },
    Kind { name: "plan", endings: &["json"], sound: corpus::parts::plan, read: shared::plan },
    Kind { name: "part", endings: &["part"], sound: corpus::parts::part, read: shared::part },
    Kind { name: "rows", endings: &["rows"], sound: corpus::parts::rows, read: shared::rows },
];
