//! An opened document: what every part of the reader looks things up in.

use std::ops::Deref;
use std::sync::Arc;

use gltf::json;

use crate::scene::source::{EXPORT_AGAIN, ImportError, Place, Source};

/// An opened document: the JSON root and the bytes of its buffers.
pub struct Document<'a> {
    pub source: &'a Source<'a>,
    /// The JSON.
    pub text: &'a [u8],
    pub root: json::Root,
    /// `None` where the file names no data (as fallbacks of compressed views may).
    pub buffers: Vec<Option<Bytes<'a>>>,
}

/// Bytes of a buffer: the binary chunk in place, or a file's.
#[derive(Clone)]
pub enum Bytes<'a> {
    Chunk(&'a [u8]),
    Loaded(Arc<[u8]>),
}

impl Deref for Bytes<'_> {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        match self {
            Self::Chunk(bytes) => bytes,
            Self::Loaded(bytes) => bytes,
        }
    }
}

impl Document<'_> {
    pub fn malformed(
        &self,
        element: impl Into<String>,
        problem: impl Into<String>,
        remedy: &str,
    ) -> ImportError {
        self.source.malformed(Place::Element(element.into()), problem, remedy)
    }

    /// The bytes of a buffer view, and its stride.
    pub fn view(&self, index: usize) -> Result<(&[u8], Option<usize>), ImportError> {
        let fail =
            |problem: String| self.malformed(format!("buffer view {index}"), problem, EXPORT_AGAIN);
        let Some(view) = self.root.buffer_views.get(index) else {
            return Err(fail("does not exist".into()));
        };
        let buffer = view.buffer.value();
        let Some(Some(bytes)) = self.buffers.get(buffer) else {
            return Err(fail(format!("its buffer {buffer} has no data")));
        };
        let range = || {
            let start = usize::try_from(view.byte_offset.unwrap_or_default().0).ok()?;
            let length = usize::try_from(view.byte_length.0).ok()?;
            bytes.get(start..start.checked_add(length)?)
        };
        match range() {
            Some(range) => Ok((range, view.byte_stride.map(|s| s.0).filter(|&s| s > 0))),
            None => Err(fail(format!("goes beyond the {} bytes of its buffer", bytes.len()))),
        }
    }
}

/// `node 3 (chair)`, or `node 3` if it has no name.
pub fn label(kind: &str, index: usize, name: Option<&str>) -> String {
    match name {
        Some(name) if !name.is_empty() => format!("{kind} {index} ({name})"),
        _ => format!("{kind} {index}"),
    }
}
