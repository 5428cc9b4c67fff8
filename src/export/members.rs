//! The members of an archive of arrays that is being written.

use std::io::{self, Seek, Write};

use zip::CompressionMethod;
use zip::write::SimpleFileOptions;

use crate::export::archive_writer::{LARGE, Writer};
use crate::export::npy::header;
use crate::progress::Progress;

/// Members, one after another.
pub struct Members<'a, W: Write + Seek> {
    pub zip: Writer<W>,
    /// May stop it.
    pub progress: &'a dyn Progress,
}

/// A number as NumPy stores it.
pub trait Number: Copy {
    /// NumPy's name of its kind.
    const KIND: &'static str;
    fn push(self, bytes: &mut Vec<u8>);
}

macro_rules! number {
    ($type:ty, $kind:literal) => {
        impl Number for $type {
            const KIND: &'static str = $kind;
            fn push(self, bytes: &mut Vec<u8>) {
                bytes.extend(self.to_le_bytes());
            }
        }
    };
}

number!(u8, "|u1");
number!(u16, "<u2");
number!(u32, "<u4");
number!(f32, "<f4");
number!(f64, "<f8");

/// Whether a member is made smaller, which takes time.
#[derive(Clone, Copy)]
pub enum Packing {
    Smallest,
    Packed,
    Plain,
}

fn options(bytes: u64, packing: Packing) -> SimpleFileOptions {
    let plain = SimpleFileOptions::default().large_file(bytes > LARGE);
    let level = match packing {
        Packing::Plain => return plain.compression_method(CompressionMethod::Stored),
        // Harder would take longer, and bring little with noisy numbers.
        Packing::Packed => 1,
        Packing::Smallest => 9,
    };
    plain.compression_method(CompressionMethod::Deflated).compression_level(Some(level))
}

impl<W: Write + Seek> Members<'_, W> {
    /// A member that is no array.
    pub fn bytes(&mut self, name: &str, packing: Packing, bytes: &[u8]) -> io::Result<()> {
        self.zip.start(name, options(bytes.len() as u64, packing))?;
        self.zip.write_all(bytes)
    }

    /// An array of that shape.
    pub fn array<N: Number>(
        &mut self,
        name: &str,
        shape: &[usize],
        packing: Packing,
        numbers: impl Iterator<Item = N>,
    ) -> io::Result<()> {
        /// Bytes written at once.
        const CHUNK: usize = 1 << 18;
        let count = shape.iter().product::<usize>() as u64;
        let lengths: Vec<String> = shape.iter().map(ToString::to_string).collect();
        let comma = if shape.len() == 1 { "," } else { "" };
        let shape = format!("({}{comma})", lengths.join(", "));
        let large = count * size_of::<N>() as u64;
        self.zip.start(&format!("{name}.npy"), options(large, packing))?;
        self.zip.write_all(&header(N::KIND, &shape))?;
        let mut bytes = Vec::with_capacity(CHUNK + size_of::<N>());
        for number in numbers {
            number.push(&mut bytes);
            if bytes.len() >= CHUNK {
                self.zip.write_all(&bytes)?;
                bytes.clear();
                self.progress.advance(0).map_err(|_| io::ErrorKind::Interrupted)?;
            }
        }
        self.zip.write_all(&bytes)
    }
}
