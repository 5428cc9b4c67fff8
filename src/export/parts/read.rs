//! Reads plans and parts back. All of a part is read and checked before any of it is believed.

use std::fs::{self, File};
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use rayon::prelude::*;
use thiserror::Error;

use super::{PART, PLAN, PartHead, PlanFile, VERSION, part_path};
use crate::engines::{FoundPairs, PairsTally, TilePairs};
use crate::export::archive::{Archive, Kind, float, integer, word};
use crate::export::npz::read::ReadError;
use crate::matrix::Plan;
use crate::progress::{Cancelled, Progress};
use crate::scene::files::open_regular;

/// Most bytes of a plan, and of a part's head.
const MOST: u64 = 1 << 20;

/// Most parts of a matrix.
pub const MOST_PARTS: u32 = 1 << 20;

/// All parts of a matrix, in their files.
#[derive(Debug)]
pub struct Parts {
    files: Vec<PartFile>,
    tally: PairsTally,
}

/// One part in its file.
#[derive(Debug)]
struct PartFile {
    path: PathBuf,
    /// Where the entries of each pair of tiles begin, and where the last end.
    starts: Vec<u64>,
    /// Where rows, columns and exchange begin in the file.
    places: [u64; 3],
}

/// What is wrong with a part.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Damage {
    /// Which part.
    pub part: u32,
    /// What is wrong with it.
    pub problem: String,
}

/// Why parts cannot be joined.
#[derive(Debug, Error)]
pub enum PartsError {
    /// The folder cannot be read.
    #[error("{}: cannot be read ({source})", folder.display())]
    Folder {
        /// The folder.
        folder: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// There is none.
    #[error("{}: there are no parts in it", .0.display())]
    None(PathBuf),
    /// There are parts of several divisions.
    #[error("{}: there are parts of {} and of {}", folder.display(), of[0], of[1])]
    Mixed {
        /// The folder.
        folder: PathBuf,
        /// Numbers of parts.
        of: [u32; 2],
    },
    /// Some are missing or damaged.
    #[error(
        "{}: {} of {of} parts cannot be used: {}",
        folder.display(), damages.len(), list(damages)
    )]
    Incomplete {
        /// The folder.
        folder: PathBuf,
        /// Number of parts.
        of: u32,
        /// The parts that cannot be used, by number.
        damages: Vec<Damage>,
    },
    /// The caller cancelled.
    #[error("cancelled")]
    Cancelled(#[from] Cancelled),
}

/// The first of them, with what is wrong.
fn list(damages: &[Damage]) -> String {
    const NAMED: usize = 8;
    let named = damages.iter().take(NAMED).map(|d| format!("{} ({})", d.part, d.problem));
    let more = damages.len().saturating_sub(NAMED);
    let more = (more > 0).then(|| format!("and {more} more"));
    named.chain(more).collect::<Vec<_>>().join(", ")
}

/// Reads a plan.
///
/// # Errors
/// If the file cannot be read, or is no plan as it was written.
pub fn read_plan(path: &Path) -> Result<Plan, ReadError> {
    let unreadable = |source| ReadError::Unreadable { path: path.into(), source };
    let broken = |problem: &str| ReadError::Broken { path: path.into(), problem: problem.into() };
    let mut text = Vec::new();
    let file = open_regular(path).map_err(unreadable)?;
    file.take(MOST + 1).read_to_end(&mut text).map_err(unreadable)?;
    let read: PlanFile = serde_json::from_slice(&text)
        .map_err(|e| broken(&format!("is no plan of a matrix ({e})")))?;
    if read.format != PLAN {
        return Err(broken("is no plan of a matrix"));
    }
    if read.version != VERSION {
        return Err(broken(&format!("was written by hemicube {}, in another form", read.program)));
    }
    if read.program != env!("CARGO_PKG_VERSION") {
        let (program, own) = (read.program, env!("CARGO_PKG_VERSION"));
        return Err(broken(&format!("was made by hemicube {program}, and this is {own}")));
    }
    let plan = read.plan;
    let tiles = u64::from(plan.tiling.tiles);
    let sound = plan.patch_size.is_none_or(|size| size > 0.0)
        && (1e-6..=1.0).contains(&plan.error)
        && (1.0 / 16.0..=16.0).contains(&plan.tiling.ray_scale)
        && u32::try_from(plan.patches).is_ok()
        && tiles <= plan.patches
        && plan.patches <= 128 * tiles;
    if !sound || read.checksum != plan.checksum() {
        return Err(broken("is not as it was written: its checksum differs"));
    }
    Ok(plan)
}

impl Parts {
    /// The parts of a plan in a folder: how many there are follows from their names. Each is read
    /// and checked as a whole; advances `progress` by one a part.
    ///
    /// # Errors
    /// If any is missing, damaged or of another plan, or `progress` stops it.
    pub fn open(folder: &Path, plan: &Plan, progress: &dyn Progress) -> Result<Self, PartsError> {
        let of = divisions(folder)?;
        let of = match of[..] {
            [] => return Err(PartsError::None(folder.into())),
            [of] => of,
            [a, b, ..] => return Err(PartsError::Mixed { folder: folder.into(), of: [a, b] }),
        };
        progress.stage("parts", of.into());
        let one = |part: u32| {
            progress.advance(1)?;
            Ok((part, open(folder, plan, (part, of))))
        };
        let opened: Result<Vec<_>, Cancelled> = (1..=of).into_par_iter().map(one).collect();
        let (mut files, mut damages, mut tally) = (Vec::new(), Vec::new(), PairsTally::default());
        for (part, opened) in opened? {
            match opened {
                Ok((file, of_part)) => {
                    files.push(file);
                    tally = tally.and(of_part);
                }
                Err(problem) => damages.push(Damage { part, problem }),
            }
        }
        match damages.is_empty() {
            true => Ok(Self { files, tally }),
            false => Err(PartsError::Incomplete { folder: folder.into(), of, damages }),
        }
    }

    /// Number of parts.
    #[must_use]
    pub fn count(&self) -> usize {
        self.files.len()
    }
}

/// Whether a part of a plan is in a folder, whole.
#[must_use]
pub fn has_part(folder: &Path, plan: &Plan, part: (u32, u32)) -> bool {
    open(folder, plan, part).is_ok()
}

/// In how many parts matrices are that have parts in a folder.
fn divisions(folder: &Path) -> Result<Vec<u32>, PartsError> {
    let fail = |source| PartsError::Folder { folder: folder.into(), source };
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).map_err(fail)? {
        let name = entry.map_err(fail)?.file_name();
        let numbers = name.to_str().and_then(|name| {
            let (part, of) =
                name.strip_prefix("part-")?.strip_suffix(".npz")?.split_once("-of-")?;
            Some((part.parse::<u32>().ok()?, of.parse::<u32>().ok()?))
        });
        let sound = |&(part, of): &(u32, u32)| (1..=of).contains(&part) && of <= MOST_PARTS;
        found.extend(numbers.filter(sound).map(|n| n.1));
    }
    found.sort_unstable();
    found.dedup();
    Ok(found)
}

/// Opens a part and checks all of it.
fn open(
    folder: &Path,
    plan: &Plan,
    (part, of): (u32, u32),
) -> Result<(PartFile, PairsTally), String> {
    let path = part_path(folder, (part, of));
    let file = open_regular(&path).map_err(|e| match e.kind() {
        io::ErrorKind::NotFound => "missing".to_owned(),
        _ => e.to_string(),
    })?;
    let mut archive = Archive::new(file).map_err(|_| "is cut off, or no part")?;
    let head = archive.bytes("head.json", MOST)?;
    let head: PartHead = serde_json::from_slice(&head).map_err(|e| format!("head.json: {e}"))?;
    if head.format != PART || head.version != VERSION {
        return Err(format!("was written by hemicube {}, in another form", head.program));
    }
    if head.plan != plan.checksum() {
        return Err("of another plan".into());
    }
    if (head.part, head.of) != (part, of) {
        return Err(format!("is part {} of {}", head.part, head.of));
    }
    let tiles = plan.numbers((part, of)).count() as u64;
    let most = |kind, b: &[u8]| word(kind, b).filter(|&count| count <= 128 * 128);
    let counts = archive.numbers("counts", tiles, most)?;
    let mut starts = vec![0];
    starts.extend(counts.iter().scan(0, |sum, &count| {
        *sum += u64::from(count);
        Some(*sum)
    }));
    let entries = starts[starts.len() - 1];
    let place = |kind, b: &[u8]| integer(kind, b).filter(|&k| k < 128).map(|_| ());
    let places = [
        numbers(&mut archive, "rows", Kind::Byte, entries, place)?,
        numbers(&mut archive, "columns", Kind::Byte, entries, place)?,
        numbers(&mut archive, "exchange", Kind::Single, entries, |kind, b| {
            float(kind, b).filter(|s| *s > 0.0 && s.is_finite()).map(|_| ())
        })?,
    ];
    let checksum = archive.checksum();
    if archive.bytes("checksum", MOST)? != checksum.as_bytes() {
        return Err("its checksum differs".into());
    }
    let PairsTally { pairs, partly, squares, .. } = head.tally;
    if pairs != entries || partly > pairs || (pairs > 0 && squares == 0) {
        return Err("head.json does not say how many pairs it holds".into());
    }
    Ok((PartFile { path, starts, places }, head.tally))
}

/// Checks an array that must hold so many numbers of a kind; where the first stands in the file.
fn numbers(
    archive: &mut Archive,
    name: &str,
    kind: Kind,
    count: u64,
    each: impl Fn(Kind, &[u8]) -> Option<()>,
) -> Result<u64, String> {
    let array = archive.open(name)?;
    if array.count != count || array.kind != kind {
        return Err(format!("{name}.npy does not hold {count} numbers"));
    }
    let place = array.place().ok_or_else(|| format!("{name}.npy is compressed"))?;
    let sound = array.take(each)?.is_some();
    if sound { Ok(place) } else { Err(format!("{name}.npy holds a number that is none of it")) }
}

impl FoundPairs for Parts {
    fn pairs(&self, number: u64) -> io::Result<TilePairs> {
        let parts = self.files.len() as u64;
        let part = &self.files[(number % parts) as usize];
        let slot = (number / parts) as usize;
        let [from, to] = [part.starts[slot], part.starts[slot + 1]];
        let count = (to - from) as usize;
        if count == 0 {
            return Ok(TilePairs::default());
        }
        let read = || {
            let mut file = File::open(&part.path)?;
            let [rows, columns, exchange] = part.places;
            let rows = bytes(&mut file, rows + from, count)?;
            let columns = bytes(&mut file, columns + from, count)?;
            let exchange = bytes(&mut file, exchange + 4 * from, 4 * count)?;
            let single = |b: &[u8; 4]| f32::from_le_bytes(*b);
            let exchange = exchange.as_chunks::<4>().0.iter().map(single).collect();
            Ok(TilePairs { rows, columns, exchange })
        };
        read().map_err(|e: io::Error| io::Error::other(format!("{}: {e}", part.path.display())))
    }

    fn tally(&self) -> PairsTally {
        self.tally
    }
}

/// Bytes of a file.
fn bytes(file: &mut File, from: u64, count: usize) -> io::Result<Vec<u8>> {
    let mut bytes = vec![0; count];
    file.seek(SeekFrom::Start(from))?;
    file.read_exact(&mut bytes)?;
    Ok(bytes)
}
