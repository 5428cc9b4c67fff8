//! Results in files, one format a file; a file is complete or absent.

mod csv;
mod mtx;
mod npy;
mod npz;
mod png;
mod save;
mod spill;

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use thiserror::Error;

use crate::progress::Cancelled;

pub use csv::{write_csv, write_csv_file, write_surfaces};
pub use mtx::write_mtx;
pub use npy::write_npy;
pub use npz::read::{ReadError, read_npz};
pub use npz::write_npz;
pub use png::write_png;
pub use save::{MATRIX_FORMATS, MatrixFormat, write_matrix};
pub use spill::Spill;

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

/// Whether a file can be made beside `path`; worth asking before long work.
pub fn can_write(path: &Path) -> Result<(), ExportError> {
    temporary(path).map(|_| ())
}

/// The folder that a file lies in.
#[must_use]
pub fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// An unnamed place beside `path`. Errors speak of `path` alone.
fn temporary(path: &Path) -> Result<tempfile::NamedTempFile, ExportError> {
    tempfile::NamedTempFile::new_in(folder_of(path))
        .map_err(|e| ExportError::Io { path: path.to_path_buf(), source: e.kind().into() })
}

/// Writes `bytes` to `path`: first beside it, then in its place, so that nobody ever sees half a
/// file.
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), ExportError> {
    write_with(path, |file| file.write_all(bytes))
}

/// The same with a function that writes; it fails as interrupted if the caller cancelled.
fn write_with(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<&File>) -> io::Result<()>,
) -> Result<(), ExportError> {
    /// Bytes written at once.
    const BUFFER: usize = 1 << 20;
    let fail = |source: io::Error| match source.kind() {
        io::ErrorKind::Interrupted => Cancelled.into(),
        _ => ExportError::Io { path: path.to_path_buf(), source },
    };
    let file = temporary(path)?;
    let mut buffer = BufWriter::with_capacity(BUFFER, file.as_file());
    write(&mut buffer).map_err(fail)?;
    buffer.flush().map_err(fail)?;
    drop(buffer);
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // Temporary files are private; a result is as readable as any other file.
        let mode = std::fs::Permissions::from_mode(0o644);
        file.as_file().set_permissions(mode).map_err(fail)?;
    }
    file.persist(path).map_err(|e| fail(e.error))?;
    Ok(())
}
