//! Opens the files that a model consists of: regular ones, as pipes and devices may have no end.

use std::fs::{self, File};
use std::io::{self, Read};
use std::path::Path;

/// Most bytes of a file: those of a text with as many triangles as are read.
const MOST_BYTES: u64 = 8 << 30;

/// Opens a regular file.
pub fn open_regular(path: &Path) -> io::Result<File> {
    let metadata = fs::metadata(path)?;
    if metadata.is_dir() {
        return Err(io::Error::other("it is a directory"));
    }
    if !metadata.is_file() {
        return Err(io::Error::other("it is a pipe or a device, not a file"));
    }
    File::open(path)
}

/// All of a regular file.
pub fn read_regular(path: &Path) -> io::Result<Vec<u8>> {
    let file = open_regular(path)?;
    let too_long = || io::Error::other(format!("it has more than {} GiB", MOST_BYTES >> 30));
    let length = file.metadata()?.len();
    if length > MOST_BYTES {
        return Err(too_long());
    }
    let mut bytes = Vec::new();
    bytes.try_reserve_exact(length as usize)?;
    // Some files of the system say that they are empty, and are not.
    file.take(MOST_BYTES + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > MOST_BYTES { Err(too_long()) } else { Ok(bytes) }
}
