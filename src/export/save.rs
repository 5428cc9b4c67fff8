//! Results saved under a name: its extension says the format.

use std::path::Path;

use super::{
    ExportError, write_csv_file, write_exr, write_hdr, write_idf, write_jpeg, write_mtx, write_npy,
    write_npz, write_png,
};
use crate::matrix::{Matrix, Origin, Rows, SurfaceRow};
use crate::progress::Progress;
use crate::render::Picture;
use crate::scene::Geometry;

/// A format of matrices.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MatrixFormat {
    /// `.npz`: compressed sparse rows for SciPy, with areas and names.
    Npz,
    /// `.npy`: a dense array for NumPy.
    Npy,
    /// `.mtx`: Matrix Market.
    Mtx,
    /// `.csv`: a table with a header.
    Csv,
    /// `.idf`: view factors between the surfaces of a zone, for EnergyPlus.
    Idf,
}

impl MatrixFormat {
    /// That of a file by its extension, in either case.
    #[must_use]
    pub fn of(path: &Path) -> Option<Self> {
        match extension(path).as_str() {
            "npz" => Some(Self::Npz),
            "npy" => Some(Self::Npy),
            "mtx" => Some(Self::Mtx),
            "csv" => Some(Self::Csv),
            "idf" => Some(Self::Idf),
            _ => None,
        }
    }
}

/// The formats of matrices, as messages name them.
pub const MATRIX_FORMATS: &str = ".npz, .npy, .mtx, .csv or .idf";

/// Writes a matrix, the format being that of the extension. `surfaces` are what its rows stand for;
/// the zone of an .idf has the name of the scene.
///
/// # Errors
/// If the extension is no format, the format cannot hold such rows ([`write_idf`]), or the system
/// refuses.
pub fn write_matrix(
    path: &Path,
    rows: &dyn Rows,
    surfaces: &[SurfaceRow],
    origin: &Origin,
    progress: &dyn Progress,
) -> Result<(), ExportError> {
    match MatrixFormat::of(path) {
        Some(MatrixFormat::Npz) => write_npz(path, rows, surfaces, origin, progress),
        Some(MatrixFormat::Npy) => write_npy(path, rows, progress),
        Some(MatrixFormat::Mtx) => write_mtx(path, rows, origin, progress),
        Some(MatrixFormat::Csv) => write_csv_file(path, rows, progress),
        Some(MatrixFormat::Idf) => write_idf(path, rows, &origin.scene, origin, progress),
        None => Err(ExportError::Format { path: path.to_owned(), formats: MATRIX_FORMATS }),
    }
}

impl Matrix {
    /// Writes the matrix of `geometry` as .npz, .npy, .mtx or .csv; an .idf wants lumped rows.
    ///
    /// # Errors
    /// As [`write_matrix`].
    pub fn save(
        &self,
        path: impl AsRef<Path>,
        geometry: &Geometry,
        progress: &dyn Progress,
    ) -> Result<(), ExportError> {
        let surfaces = self.surfaces(geometry);
        write_matrix(path.as_ref(), self, &surfaces, &self.origin(geometry), progress)
    }
}

/// A format of pictures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PictureFormat {
    /// `.png`: display light in 8 bits.
    Png,
    /// `.jpg`: display light in 8 bits, smaller.
    Jpeg,
    /// `.exr`: OpenEXR, floats as they are.
    Exr,
    /// `.hdr`: Radiance RGBE, about 1 % exact.
    Hdr,
}

/// The formats of pictures, as messages name them.
pub const PICTURE_FORMATS: &str = ".png, .jpg, .exr or .hdr";

impl PictureFormat {
    /// That of a file by its extension, in either case.
    #[must_use]
    pub fn of(path: &Path) -> Option<Self> {
        match extension(path).as_str() {
            "png" => Some(Self::Png),
            "jpg" | "jpeg" => Some(Self::Jpeg),
            "exr" => Some(Self::Exr),
            "hdr" => Some(Self::Hdr),
            _ => None,
        }
    }

    /// Whether it holds light of any strength, such as radiance, rather than display light.
    #[must_use]
    pub fn is_of_radiance(self) -> bool {
        matches!(self, Self::Exr | Self::Hdr)
    }
}

impl Picture {
    /// Writes the picture: linear display light as .png or .jpg, or values as they are as .exr or
    /// .hdr.
    ///
    /// # Errors
    /// If the extension is another, or the system refuses.
    pub fn save(&self, path: impl AsRef<Path>) -> Result<(), ExportError> {
        let path = path.as_ref();
        match PictureFormat::of(path) {
            Some(PictureFormat::Png) => write_png(path, self),
            Some(PictureFormat::Jpeg) => write_jpeg(path, self),
            Some(PictureFormat::Exr) => write_exr(path, [self.width, self.height], &self.pixels),
            Some(PictureFormat::Hdr) => write_hdr(path, self),
            None => Err(ExportError::Format { path: path.to_owned(), formats: PICTURE_FORMATS }),
        }
    }
}

fn extension(path: &Path) -> String {
    path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_lowercase()
}
