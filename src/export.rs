//! Results in files, one format a file; a file is complete or absent.

mod archive;
mod archive_writer;
mod csv;
mod exr;
mod glb;
mod hdr;
mod heat;
mod hemi;
mod html;
mod idf;
mod jpeg;
mod members;
mod mtx;
mod npy;
mod npz;
mod parts;
mod png;
mod row_cells;
mod row_folder;
mod save;
mod spill;
mod target;
mod view3d;
mod vtu;

use std::io;
use std::path::PathBuf;

use thiserror::Error;

use crate::progress::Cancelled;

pub use csv::{write_csv, write_csv_file, write_surfaces};
pub use exr::write_exr;
pub use glb::{BakeMode, Baked, write_glb};
pub use hdr::write_hdr;
pub use heat::{sides_table, surfaces_table, write_conductors, write_heat_vtu};
pub use hemi::{read_factors, read_scene, read_sources, read_store, write_hemi};
pub use html::{MOST_LAYERS, PageView, live_page, page_data, page_facets, write_html};
pub use idf::{IdfNameError, check_idf_name, check_idf_names, write_idf};
pub use jpeg::write_jpeg;
pub use mtx::write_mtx;
pub use npy::write_npy;
pub use npz::read::{ReadError, read_npz};
pub use npz::write_npz;
pub use parts::{
    Damage, MOST_PARTS, Parts, PartsError, has_part, part_path, read_plan, write_part, write_plan,
};
pub use png::{encode_picture, write_png};
pub use row_cells::{DrawnRow, write_row_cells};
pub use row_folder::RowFolder;
pub use save::{MATRIX_FORMATS, MatrixFormat, PICTURE_FORMATS, PictureFormat, write_matrix};
pub use spill::Spill;
pub use target::{can_write, folder_of, is_stream, target_of, write_whole};
pub use view3d::{View3dTable, write_view3d, write_view3d_row};
pub use vtu::{CellArray, CellValues, write_vtu};

/// Why a file was not written.
#[derive(Debug, Error)]
pub enum ExportError {
    /// The system refused.
    #[error("cannot write {}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The picture could not be encoded.
    #[error("cannot encode {}: {message}", path.display())]
    Encode {
        /// The file.
        path: PathBuf,
        /// What the encoder said.
        message: String,
    },
    /// Nothing of the kind is written in that format.
    #[error("{}: is written as {formats}", path.display())]
    Format {
        /// The file.
        path: PathBuf,
        /// The formats that there are.
        formats: &'static str,
    },
    /// The caller cancelled.
    #[error("cancelled")]
    Cancelled(#[from] Cancelled),
}
