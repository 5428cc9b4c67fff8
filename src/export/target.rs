//! Where a result goes: into the place of a file, complete or not at all, or into what is no file.

use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use super::ExportError;
use crate::progress::Cancelled;

/// The folder that a file lies in.
#[must_use]
pub fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// The file that a path means: what symbolic links point at in the end, whether it exists or not.
#[must_use]
pub fn target_of(path: &Path) -> PathBuf {
    /// As many links as systems follow.
    const MOST_LINKS: usize = 40;
    let mut target = path.to_path_buf();
    for _ in 0..MOST_LINKS {
        let Ok(link) = fs::read_link(&target) else { break };
        target = folder_of(&target).join(link);
    }
    target
}

/// Whether there is something at `path` that is no regular file, such as a pipe or a device: it is
/// written into, and never replaced.
#[must_use]
pub fn is_stream(path: &Path) -> bool {
    fs::metadata(path).is_ok_and(|m| !m.is_file() && !m.is_dir())
}

/// Whether a file can be made at `path`; worth asking before long work. Takes away what killed
/// runs left there.
pub fn can_write(path: &Path) -> Result<(), ExportError> {
    let target = target_of(path);
    if is_stream(&target) {
        return Ok(());
    }
    remove_stale(folder_of(&target));
    temporary(&target).map(|_| ()).map_err(|e| failure(path, e))
}

/// Writes `bytes` to `path`: first beside it, then in its place, so that nobody ever sees half a
/// file.
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), ExportError> {
    write_with(path, |file| file.write_all(bytes))
}

/// The same with a function that writes; it fails as interrupted if the caller cancelled.
pub(super) fn write_with(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<&File>) -> io::Result<()>,
) -> Result<(), ExportError> {
    let target = target_of(path);
    let written = if is_stream(&target) {
        OpenOptions::new().write(true).open(&target).and_then(|file| buffered(&file, write))
    } else {
        replace(&target, write)
    };
    written.map_err(|e| failure(path, e))
}

fn replace(
    target: &Path,
    write: impl FnOnce(&mut BufWriter<&File>) -> io::Result<()>,
) -> io::Result<()> {
    let file = temporary(target)?;
    buffered(file.as_file(), write)?;
    // What is there keeps who may read it.
    if let Ok(old) = fs::metadata(target) {
        file.as_file().set_permissions(old.permissions())?;
    }
    file.persist(target).map_err(|e| e.error)?;
    Ok(())
}

fn buffered(
    file: &File,
    write: impl FnOnce(&mut BufWriter<&File>) -> io::Result<()>,
) -> io::Result<()> {
    /// Bytes written at once.
    const BUFFER: usize = 1 << 20;
    let mut buffer = BufWriter::with_capacity(BUFFER, file);
    write(&mut buffer)?;
    buffer.flush()
}

fn failure(path: &Path, source: io::Error) -> ExportError {
    match source.kind() {
        io::ErrorKind::Interrupted => Cancelled.into(),
        _ => ExportError::Io { path: path.to_path_buf(), source },
    }
}

/// What the names of temporary files begin and end with.
const NAME: (&str, &str) = (".hemicube-", ".tmp");

/// A file beside `target` that is locked while it is written, and as private as the target, or as
/// the system makes new files.
fn temporary(target: &Path) -> io::Result<NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(NAME.0).suffix(NAME.1);
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        let old = fs::metadata(target).map(|old| old.permissions());
        builder.permissions(old.unwrap_or(fs::Permissions::from_mode(0o666)));
    }
    // The system's words alone: errors speak of the target.
    let file = builder.tempfile_in(folder_of(target)).map_err(|e| io::Error::from(e.kind()))?;
    // Where there are no locks, nobody takes the file away either.
    let _ = file.as_file().try_lock();
    Ok(file)
}

/// Removes temporary files of runs that were killed: nobody holds their locks any more.
fn remove_stale(folder: &Path) {
    let Ok(entries) = fs::read_dir(folder) else { return };
    for entry in entries.flatten() {
        let name = entry.file_name();
        let Some(name) = name.to_str() else { continue };
        let ours = name.starts_with(NAME.0) && name.ends_with(NAME.1);
        if ours && entry.file_type().is_ok_and(|t| t.is_file()) {
            let free = File::open(entry.path()).is_ok_and(|file| file.try_lock().is_ok());
            if free {
                let _ = fs::remove_file(entry.path());
            }
        }
    }
}

#[cfg(test)]
#[cfg(unix)]
mod tests {
    use std::os::unix::fs::{PermissionsExt, symlink};

    use super::*;

    fn mode(path: &Path) -> u32 {
        fs::metadata(path).unwrap().permissions().mode() & 0o777
    }

    #[test]
    fn files_keep_who_may_read_them_and_new_ones_obey_the_system() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::write(at("private"), "old").unwrap();
        fs::set_permissions(at("private"), fs::Permissions::from_mode(0o600)).unwrap();
        write_whole(&at("private"), b"new").unwrap();
        assert_eq!(
            (fs::read(at("private")).unwrap(), mode(&at("private"))),
            (b"new".into(), 0o600)
        );
        write_whole(&at("ours"), b"new").unwrap();
        fs::write(at("theirs"), "").unwrap();
        assert_eq!(mode(&at("ours")), mode(&at("theirs")), "the umask");
    }

    #[test]
    fn links_are_followed() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::create_dir(at("deep")).unwrap();
        fs::write(at("deep/file"), "old").unwrap();
        symlink("deep/file", at("link")).unwrap();
        symlink("deep/none", at("dangling")).unwrap();
        for link in ["link", "dangling"] {
            can_write(&at(link)).unwrap();
            write_whole(&at(link), b"new").unwrap();
            assert!(fs::symlink_metadata(at(link)).unwrap().is_symlink());
            assert_eq!(fs::read(at(link)).unwrap(), b"new");
        }
        assert_eq!(fs::read(at("deep/none")).unwrap(), b"new");
    }

    #[test]
    fn what_is_no_file_is_written_into() {
        use std::os::unix::fs::FileTypeExt;
        let folder = tempfile::tempdir().unwrap();
        let socket = folder.path().join("socket");
        let _listener = std::os::unix::net::UnixListener::bind(&socket).unwrap();
        can_write(&socket).unwrap();
        write_whole(&socket, b"new").unwrap_err();
        assert!(fs::symlink_metadata(&socket).unwrap().file_type().is_socket());
        // A link to a device, so that the worst is a link replaced.
        let null = folder.path().join("null");
        symlink("/dev/null", &null).unwrap();
        assert!(is_stream(&null) && is_stream(&target_of(&null)));
    }

    #[test]
    fn what_a_killed_run_left_is_removed_and_what_one_writes_is_not() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        for name in [".hemicube-a1b2c3.tmp", ".hemicube-notes", ".tmpab"] {
            fs::write(at(name), "half").unwrap();
        }
        let busy = temporary(&at("F.npz")).unwrap();
        can_write(&at("out.png")).unwrap();
        assert!(!at(".hemicube-a1b2c3.tmp").exists());
        assert!(at(".hemicube-notes").exists() && at(".tmpab").exists() && busy.path().exists());
    }
}
