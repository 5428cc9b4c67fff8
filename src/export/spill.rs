//! Rows of a matrix in a temporary file, while they wait to be written in the form wanted.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use super::ExportError;
use super::target::folder_of;
use crate::form_factors::{RowBlock, RowSink, SinkError};
use crate::matrix::RowStore;
use crate::patches::PatchId;

/// A file without a name beside the result: it is gone with the program, however that ends.
#[derive(Debug)]
pub struct Spill {
    file: Mutex<File>,
    /// Where the row of each patch begins, and how many entries it has.
    places: Vec<(u64, u32)>,
    end: u64,
    bytes: Vec<u8>,
    beside: PathBuf,
}

impl Spill {
    /// Bytes of an entry: column and factor.
    pub const ENTRY_BYTES: u64 = 8;

    /// An empty one on the disk where `path` will be.
    pub fn beside(path: &Path) -> Result<Self, ExportError> {
        let fail = |source: io::Error| ExportError::Io { path: path.to_path_buf(), source };
        let file = Mutex::new(tempfile::tempfile_in(folder_of(path)).map_err(fail)?);
        let beside = folder_of(path).to_path_buf();
        Ok(Self { file, places: Vec::new(), end: 0, bytes: Vec::new(), beside })
    }

    fn named(&self, e: &io::Error) -> io::Error {
        io::Error::other(format!("a temporary file in {}: {e}", self.beside.display()))
    }
}

impl RowSink for Spill {
    fn take(&mut self, block: RowBlock) -> Result<(), SinkError> {
        for (k, id) in block.ids.iter().enumerate() {
            let row = block.row(k);
            self.bytes.clear();
            self.bytes.extend(row.columns.iter().flat_map(|j| j.0.to_le_bytes()));
            self.bytes.extend(row.entries().flat_map(|(_, f)| (f as f32).to_le_bytes()));
            if self.places.len() <= id.index() {
                self.places.resize(id.index() + 1, (0, 0));
            }
            self.places[id.index()] = (self.end, row.columns.len() as u32);
            let file = self.file.get_mut().unwrap_or_else(PoisonError::into_inner);
            // Nothing is read before all is written, so the file stands at its end.
            let written = file.write_all(&self.bytes);
            written.map_err(|e| SinkError::Store(self.named(&e)))?;
            self.end += self.bytes.len() as u64;
        }
        Ok(())
    }
}

impl RowStore for Spill {
    fn read(
        &self,
        id: PatchId,
        columns: &mut Vec<PatchId>,
        values: &mut Vec<f32>,
    ) -> io::Result<()> {
        let (start, count) = self.places.get(id.index()).copied().unwrap_or_default();
        let mut bytes = vec![0; (Self::ENTRY_BYTES * u64::from(count)) as usize];
        let mut file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        let read = file.seek(SeekFrom::Start(start)).and_then(|_| file.read_exact(&mut bytes));
        drop(file);
        read.map_err(|e| self.named(&e))?;
        let (first, second) = bytes.split_at(4 * count as usize);
        columns.clear();
        columns.extend(first.as_chunks::<4>().0.iter().map(|b| PatchId(u32::from_le_bytes(*b))));
        values.clear();
        values.extend(second.as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)));
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test")]

    use super::*;
    use crate::form_factors::{Row, Weights};

    #[test]
    fn rows_come_back_as_they_went() {
        let folder = tempfile::tempdir().unwrap();
        let mut spill = Spill::beside(&folder.path().join("F.npz")).unwrap();
        let row = |columns: &[u32], values: &[f32]| Row {
            columns: columns.iter().map(|&j| PatchId(j)).collect(),
            weights: Weights::Each(values.to_vec()),
            ..Row::default()
        };
        let mut take = |ids: &[PatchId], rows: &[Row]| {
            spill.take(RowBlock::of(ids, rows).unwrap()).unwrap();
        };
        take(&[PatchId(2)], &[row(&[0, 7], &[0.25, 1e-30])]);
        take(&[PatchId(0), PatchId(1)], &[row(&[], &[]), row(&[3], &[0.5])]);
        let (mut columns, mut values) = (vec![PatchId(9)], vec![9.0]);
        for (id, expected) in
            [(0, (vec![], vec![])), (1, (vec![PatchId(3)], vec![0.5])), (9, Default::default())]
        {
            spill.read(PatchId(id), &mut columns, &mut values).unwrap();
            assert_eq!((columns.clone(), values.clone()), expected);
        }
        spill.read(PatchId(2), &mut columns, &mut values).unwrap();
        assert_eq!((&columns[..], &values[..]), (&[0, 7].map(PatchId)[..], &[0.25, 1e-30][..]));
        assert!(folder.path().read_dir().unwrap().next().is_none(), "the file has no name");
    }
}
