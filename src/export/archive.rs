//! The arrays of an archive. What one claims to hold is known before any of it is inflated.

use std::fs::File;
use std::io::{BufReader, Read};

use zip::read::ZipFile;
use zip::result::ZipResult;
use zip::{CompressionMethod, ZipArchive};

/// An archive, and the checksum of what was read of it.
pub struct Archive {
    zip: ZipArchive<BufReader<File>>,
    hash: blake3::Hasher,
    /// Bytes that members which are no arrays may still take.
    room: u64,
}

/// Members that are no arrays take in all at most `least` bytes, and so many times the length of
/// their file: a few kilobytes can inflate to gigabytes.
pub fn most(least: u64, length: u64) -> u64 {
    const TIMES: u64 = 100;
    least.saturating_add(TIMES.saturating_mul(length))
}

/// What the numbers of an array are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Kind {
    Byte,
    Word,
    Int32,
    Int64,
    Single,
    Double,
    /// Text of that many bytes.
    Text(usize),
}

/// An array that is about to be read.
pub struct Array<'a> {
    name: String,
    pub kind: Kind,
    /// How many numbers it claims to hold.
    pub count: u64,
    /// Bytes before the first number.
    header: u64,
    file: ZipFile<'a, BufReader<File>>,
    hash: &'a mut blake3::Hasher,
}

impl Archive {
    /// One in a file.
    pub fn new(file: File) -> ZipResult<Self> {
        /// Models of zeros are allowed to shrink as they do.
        const LEAST: u64 = 1 << 30;
        let room = most(LEAST, file.metadata()?.len());
        let zip = ZipArchive::new(BufReader::new(file))?;
        Ok(Self { zip, hash: blake3::Hasher::new(), room })
    }

    /// The checksum of all arrays that were read since the last one was asked for.
    pub fn checksum(&mut self) -> String {
        let sum = self.hash.finalize().to_hex().to_string();
        self.hash.reset();
        sum
    }

    /// The numbers of an array that must hold `count` of them.
    pub fn numbers<T>(
        &mut self,
        name: &str,
        count: u64,
        each: impl Fn(Kind, &[u8]) -> Option<T>,
    ) -> Result<Vec<T>, String> {
        let array = self.open(name)?;
        if array.count != count {
            return Err(format!("{name}.npy holds {} numbers, not {count}", array.count));
        }
        array
            .take(each)?
            .ok_or_else(|| format!("{name}.npy holds a number that cannot be one of it"))
    }

    /// The bytes of a member that is no array, of which there may be so many.
    pub fn bytes(&mut self, name: &str, most: u64) -> Result<Vec<u8>, String> {
        let most = most.min(self.room);
        let file = self.zip.by_name(name).map_err(|e| format!("{name}: {e}"))?;
        let mut bytes = Vec::new();
        file.take(most + 1).read_to_end(&mut bytes).map_err(|e| format!("{name}: {e}"))?;
        if bytes.len() as u64 > most {
            return Err(format!("{name} is longer than {most} bytes"));
        }
        self.room -= bytes.len() as u64;
        self.hash.update(&bytes);
        Ok(bytes)
    }

    /// What an array claims to hold.
    pub fn open(&mut self, name: &str) -> Result<Array<'_>, String> {
        let name = format!("{name}.npy");
        let wrong = |problem: &str| format!("{name} {problem}");
        let mut file = self.zip.by_name(&name).map_err(|e| format!("{name}: {e}"))?;
        let mut start = [0; 10];
        file.read_exact(&mut start).map_err(|_| wrong("is cut off"))?;
        if start[..8] != *b"\x93NUMPY\x01\x00" {
            return Err(wrong("is no array of version 1.0"));
        }
        let mut text = vec![0; usize::from(u16::from_le_bytes([start[8], start[9]]))];
        file.read_exact(&mut text).map_err(|_| wrong("is cut off"))?;
        self.hash.update(&start).update(&text);
        let text = String::from_utf8_lossy(&text);
        let kind = kind(&text).ok_or_else(|| wrong("holds numbers of a kind that is not read"))?;
        let count = count(&text).ok_or_else(|| wrong("does not say how many numbers it holds"))?;
        let header = (start.len() + text.len()) as u64;
        Ok(Array { kind, count, header, file, hash: &mut self.hash, name })
    }
}

/// What stands behind `key` in the dictionary of an array.
fn value<'a>(text: &'a str, key: &str) -> Option<&'a str> {
    Some(text.split_once(&format!("'{key}':"))?.1.trim_start())
}

fn kind(text: &str) -> Option<Kind> {
    let name = value(text, "descr")?.strip_prefix('\'')?.split('\'').next()?;
    match name {
        "|u1" => Some(Kind::Byte),
        "<u4" => Some(Kind::Word),
        "<i4" => Some(Kind::Int32),
        "<i8" => Some(Kind::Int64),
        "<f4" => Some(Kind::Single),
        "<f8" => Some(Kind::Double),
        _ => name.strip_prefix("|S")?.parse().ok().map(Kind::Text),
    }
}

fn count(text: &str) -> Option<u64> {
    let shape = value(text, "shape")?.strip_prefix('(')?.split(')').next()?;
    let mut lengths = shape.split(',').map(str::trim).filter(|length| !length.is_empty());
    lengths.try_fold(1_u64, |all, length| all.checked_mul(length.parse().ok()?))
}

impl Array<'_> {
    /// Where the first number stands in the file; `None` if the array is compressed.
    pub fn place(&self) -> Option<u64> {
        let stored = self.file.compression() == CompressionMethod::Stored;
        self.file.data_start().filter(|_| stored).map(|start| start + self.header)
    }

    /// What `each` makes of its numbers; `None` if it makes nothing of one. Memory holds no more
    /// than the result.
    pub fn take<T>(
        mut self,
        each: impl Fn(Kind, &[u8]) -> Option<T>,
    ) -> Result<Option<Vec<T>>, String> {
        /// Bytes read at once: a multiple of those of any number.
        const CHUNK: u64 = 1 << 18;
        let name = self.name;
        let size = self.kind.bytes();
        let (mut numbers, mut bytes) = (Vec::new(), Vec::new());
        let room = usize::try_from(self.count).ok();
        let room = room.and_then(|n| numbers.try_reserve_exact(n).ok());
        room.ok_or_else(|| format!("{name}: there is no memory for it"))?;
        let mut left = self.count.saturating_mul(size as u64);
        while left > 0 {
            bytes.clear();
            // A text is one number.
            let chunk = CHUNK.max(size as u64).min(left);
            let read = self.file.by_ref().take(chunk).read_to_end(&mut bytes);
            read.map_err(|e| format!("{name}: {e}"))?;
            if bytes.len() as u64 != chunk {
                return Err(format!("{name} is cut off"));
            }
            self.hash.update(&bytes);
            left -= chunk;
            for number in bytes.chunks_exact(size) {
                let Some(number) = each(self.kind, number) else { return Ok(None) };
                numbers.push(number);
            }
        }
        // The end of the file is where its own checksum is compared.
        match self.file.read(&mut [0]) {
            Ok(0) => Ok(Some(numbers)),
            Ok(_) => Err(format!("{name} is longer than it says")),
            Err(e) => Err(format!("{name}: {e}")),
        }
    }
}

impl Kind {
    /// Bytes of a number.
    fn bytes(self) -> usize {
        match self {
            Self::Byte => 1,
            Self::Word | Self::Int32 | Self::Single => 4,
            Self::Int64 | Self::Double => 8,
            Self::Text(bytes) => bytes.max(1),
        }
    }
}

/// An integer; a negative one becomes too large.
pub fn integer(kind: Kind, bytes: &[u8]) -> Option<u64> {
    match kind {
        Kind::Byte => bytes.first().copied().map(u64::from),
        Kind::Word => bytes.try_into().ok().map(|b| u32::from_le_bytes(b).into()),
        Kind::Int32 => bytes.try_into().ok().map(|b| i32::from_le_bytes(b) as u64),
        Kind::Int64 => bytes.try_into().ok().map(u64::from_le_bytes),
        Kind::Single | Kind::Double | Kind::Text(_) => None,
    }
}

/// A float.
pub fn float(kind: Kind, bytes: &[u8]) -> Option<f64> {
    match kind {
        Kind::Single => bytes.try_into().ok().map(|b| f32::from_le_bytes(b).into()),
        Kind::Double => bytes.try_into().ok().map(f64::from_le_bytes),
        Kind::Byte | Kind::Word | Kind::Int32 | Kind::Int64 | Kind::Text(_) => None,
    }
}

/// An integer of 32 bits.
pub fn word(kind: Kind, bytes: &[u8]) -> Option<u32> {
    integer(kind, bytes).and_then(|i| u32::try_from(i).ok())
}

/// A float that is a number.
pub fn finite(kind: Kind, bytes: &[u8]) -> Option<f64> {
    float(kind, bytes).filter(|x| x.is_finite())
}

/// A text.
pub fn text(kind: Kind, bytes: &[u8]) -> Option<Vec<u8>> {
    matches!(kind, Kind::Text(_)).then(|| bytes.to_vec())
}
