//! Rows in a folder beside a result that is not complete: a run that was stopped leaves them to the
//! next one.
//!
//! A file has the rows of patches of one strip that were made together. It is an archive of arrays
//! as files of solutions have them, and `manifest.json` says what the rows depend on.

use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::fs;
use std::io::{self};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use serde::{Deserialize, Serialize};

use super::ExportError;
use super::archive::Archive;
use super::archive_writer::Writer;
use super::hemi::{RowsHead, read_rows, write_rows};
use super::members::{Members, Packing};
use super::target::{can_write, write_with};
use crate::form_factors::{FormFactors, KeptRows, RowBlock, RowSink};
use crate::patches::PatchId;
use crate::progress::{Progress, Silent};
use crate::scene::files::open_regular;

/// A folder of rows, for any number of processes at a time.
#[derive(Debug)]
pub struct RowFolder {
    folder: PathBuf,
    /// The names of what was there at first.
    found: BTreeSet<String>,
    compared: AtomicBool,
    taken_up: AtomicU64,
}

/// `manifest.json`.
#[derive(Serialize, Deserialize)]
struct Manifest {
    format: String,
    /// What the rows depend on.
    key: String,
    rows: RowsHead,
    checksum: String,
}

/// What a manifest begins with, the folder of arrays, and how names of files end.
const FORMAT: &str = "hemicube rows";
const ROWS: &str = "rows";
const EXTENSION: &str = "rows";

impl RowFolder {
    /// That of a result: the same path and `.rows`. It is made once there are rows.
    #[must_use]
    pub fn beside(result: &Path) -> Self {
        let mut name = result.as_os_str().to_owned();
        name.push(".rows");
        let folder = PathBuf::from(name);
        let name = |path: PathBuf| Some(path.file_name()?.to_str()?.to_owned());
        let found = files(&folder).into_iter().filter_map(name).collect();
        Self { folder, found, compared: AtomicBool::new(false), taken_up: AtomicU64::new(0) }
    }

    /// How many rows of an earlier run were used.
    #[must_use]
    pub fn taken_up(&self) -> u64 {
        self.taken_up.load(Ordering::Relaxed)
    }

    /// Removes all rows, once the result is complete and nobody needs them. Other files stay, and
    /// with them the folder.
    ///
    /// # Errors
    /// If the system refuses.
    pub fn remove(&self) -> Result<(), ExportError> {
        let failed = |source| ExportError::Io { path: self.folder.clone(), source };
        if !self.folder.is_dir() {
            return Ok(());
        }
        // What a killed run left half written goes too.
        can_write(&self.folder.join(EXTENSION))?;
        files(&self.folder).into_iter().try_for_each(fs::remove_file).map_err(failed)?;
        match fs::remove_dir(&self.folder) {
            Err(e) if e.kind() != io::ErrorKind::DirectoryNotEmpty => Err(failed(e)),
            _ => Ok(()),
        }
    }

    /// The file of the rows from that of `first` on.
    fn path(&self, key: &str, first: PatchId) -> PathBuf {
        self.folder.join(format!("{}-{}.{EXTENSION}", short(key), first.0))
    }

    /// Warns once if all that was there at first is of no use.
    fn compare(&self, key: &str, progress: &dyn Progress) {
        let is_first = !self.compared.swap(true, Ordering::Relaxed);
        if is_first
            && !self.found.is_empty()
            && !self.found.iter().any(|f| f.starts_with(short(key)))
        {
            progress.warn(&format!(
                "{}: its rows are of another scene or of other options, and are not used",
                self.folder.display()
            ));
        }
    }
}

/// Enough of a key to tell files apart.
fn short(key: &str) -> &str {
    key.get(..16).unwrap_or(key)
}

/// The files of rows in a folder; none if there is no folder.
fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let paths = entries.map(|entry| entry.path());
    paths.filter(|path| path.extension() == Some(OsStr::new(EXTENSION))).collect()
}

/// The rows of just these patches from a file.
fn read(
    path: &Path,
    key: &str,
    ids: &[PatchId],
    factors: &FormFactors,
) -> Result<Vec<RowBlock>, String> {
    /// Most bytes of a manifest.
    const MOST: u64 = 1 << 20;
    let file = open_regular(path).map_err(|e| e.to_string())?;
    let mut archive = Archive::new(file).map_err(|e| e.to_string())?;
    let text = archive.bytes("manifest.json", MOST)?;
    archive.checksum();
    let head: Manifest = serde_json::from_slice(&text).map_err(|e| e.to_string())?;
    if head.format != FORMAT || head.key != key {
        return Err("it has rows of another scene or of other options".into());
    }
    let (patches, room) = (factors.len() as u64, factors.room().unwrap_or(u64::MAX));
    let rows = read_rows(&mut archive, ROWS, &head.rows, patches, room)?;
    if archive.checksum() != head.checksum {
        return Err("its arrays are not those that were written: their checksum differs".into());
    }
    let blocks: Vec<RowBlock> = rows.into_blocks().collect();
    match blocks.iter().flat_map(|b| &b.ids).eq(ids) {
        true => Ok(blocks),
        false => Err("it has rows of other patches".into()),
    }
}

impl KeptRows for RowFolder {
    fn take_up(
        &self,
        key: &str,
        ids: &[PatchId],
        factors: &FormFactors,
        progress: &dyn Progress,
    ) -> Option<Vec<RowBlock>> {
        self.compare(key, progress);
        let path = self.path(key, *ids.first()?);
        if !path.exists() {
            return None;
        }
        match read(&path, key, ids, factors) {
            Ok(blocks) => {
                // Where rays are chosen for an error, the last turn of this run left rows too.
                if path.file_name().and_then(OsStr::to_str).is_some_and(|n| self.found.contains(n))
                {
                    self.taken_up.fetch_add(ids.len() as u64, Ordering::Relaxed);
                }
                Some(blocks)
            }
            Err(problem) => {
                progress.warn(&format!("{}: {problem}; rows are made again", path.display()));
                None
            }
        }
    }

    fn keep(&self, key: &str, ids: &[PatchId], factors: &FormFactors) -> io::Result<()> {
        let Some(first) = ids.first() else { return Ok(()) };
        fs::create_dir_all(&self.folder)?;
        let written = write_with(&self.path(key, *first), |file| {
            let mut members = Members { zip: Writer::new(file), progress: &Silent };
            let rows = write_rows(&mut members, ROWS, factors, ids)?;
            let checksum = members.zip.checksum();
            let head = Manifest { format: FORMAT.into(), key: key.into(), rows, checksum };
            members.bytes("manifest.json", Packing::Packed, &serde_json::to_vec(&head)?)?;
            members.zip.finish()
        });
        written.map_err(io::Error::other)
    }
}
