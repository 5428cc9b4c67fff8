//! An archive that is being written.

use std::io::{self, Seek, SeekFrom, Write};

use zip::ZipWriter;
use zip::write::SimpleFileOptions;

/// Larger members need the 64-bit form of the archive.
pub const LARGE: u64 = 0xf000_0000;

/// An archive, and the checksum of what was put in so far.
pub struct Writer<W: Write + Seek> {
    zip: ZipWriter<UntilError<W>>,
    hash: blake3::Hasher,
}

impl<W: Write + Seek> Writer<W> {
    pub fn new(file: W) -> Self {
        let zip = ZipWriter::new(UntilError { file, at: 0, lost: false });
        Self { zip, hash: blake3::Hasher::new() }
    }

    /// Begins a member.
    pub fn start(&mut self, name: &str, options: SimpleFileOptions) -> io::Result<()> {
        Ok(self.zip.start_file(name, options)?)
    }

    /// The checksum of all that was written since the last one was asked for.
    pub fn checksum(&mut self) -> String {
        let sum = self.hash.finalize().to_hex().to_string();
        self.hash.reset();
        sum
    }

    /// Writes the directory.
    pub fn finish(self) -> io::Result<()> {
        self.zip.finish()?;
        Ok(())
    }
}

impl<W: Write + Seek> Write for Writer<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.zip.write(bytes)?;
        self.hash.update(&bytes[..written]);
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.zip.flush()
    }
}

/// A file that tells its first error and then takes everything: an archive that is dropped tries to
/// write its directory, and would print that it cannot.
struct UntilError<W> {
    file: W,
    /// Where it stands, or would if it had not failed.
    at: u64,
    /// Whether it failed.
    lost: bool,
}

impl<W: Write + Seek> Write for UntilError<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = if self.lost { Ok(bytes.len()) } else { self.file.write(bytes) };
        match &written {
            Ok(count) => self.at += *count as u64,
            Err(e) => self.lost = e.kind() != io::ErrorKind::Interrupted,
        }
        written
    }

    fn flush(&mut self) -> io::Result<()> {
        if self.lost { Ok(()) } else { self.file.flush() }
    }
}

impl<W: Write + Seek> Seek for UntilError<W> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        if self.lost {
            if let SeekFrom::Start(place) = to {
                self.at = place;
            }
            return Ok(self.at);
        }
        let sought = self.file.seek(to);
        match &sought {
            Ok(at) => self.at = *at,
            Err(_) => self.lost = true,
        }
        sought
    }
}
