//! Whether results can be written where they are to go, without harm to anything that is read.

use std::path::{Path, PathBuf};

use hemicube::export::{can_write, folder_of, is_stream, target_of};

use crate::failure::Failure;

/// Refuses results that cannot be written, and those that would overwrite an input or each other.
/// Each is given with the flag that names it.
pub fn check<'a>(
    outputs: &[(&str, Option<&'a PathBuf>)],
    inputs: impl IntoIterator<Item = &'a PathBuf>,
) -> Result<(), Failure> {
    let inputs: Vec<(Identity, &PathBuf)> =
        inputs.into_iter().map(|path| (identity(path), path)).collect();
    let mut seen: Vec<(Identity, &str)> = Vec::new();
    for (flag, path) in outputs.iter().filter_map(|(flag, path)| Some((*flag, (*path)?))) {
        ensure_folder(path)?;
        if is_stream(path) {
            continue;
        }
        let own = identity(path);
        if let Some((_, input)) = inputs.iter().find(|i| i.0 == own) {
            return Err(Failure::Input(format!(
                "{}: is read by this run ({}); give {flag} another name",
                path.display(),
                input.display()
            )));
        }
        if let Some((_, other)) = seen.iter().find(|s| s.0 == own) {
            return Err(Failure::Input(format!(
                "{}: is the file of {other} and of {flag}; give them different names",
                path.display()
            )));
        }
        seen.push((own, flag));
    }
    Ok(())
}

/// Refuses a file in a folder that is not there or cannot be written to, before any work is done.
fn ensure_folder(path: &Path) -> Result<(), Failure> {
    let folder = folder_of(path);
    if !folder.is_dir() {
        return Err(Failure::Input(format!("{}: no such folder", folder.display())));
    }
    if path.is_dir() {
        return Err(Failure::Input(format!("{}: is a folder, not a file", path.display())));
    }
    can_write(path).map_err(Failure::input)
}

/// What file a path means, however it is spelled.
#[derive(Debug, PartialEq)]
enum Identity {
    /// Device and number of a file.
    #[cfg(unix)]
    Inode(u64, u64),
    /// Where a file is, or will be.
    Place(PathBuf),
}

fn identity(path: &Path) -> Identity {
    let target = target_of(path);
    #[cfg(unix)]
    if let Ok(metadata) = target.metadata() {
        use std::os::unix::fs::MetadataExt;
        return Identity::Inode(metadata.dev(), metadata.ino());
    }
    let folder = folder_of(&target);
    let folder = folder.canonicalize().unwrap_or_else(|_| folder.to_path_buf());
    Identity::Place(folder.join(target.file_name().unwrap_or_default()))
}
