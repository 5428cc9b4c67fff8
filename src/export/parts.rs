//! Matrices in parts: the plan that all parts share (JSON), and the parts, each an archive of
//! arrays in one folder.
//!
//! | member | shape | holds |
//! |---|---|---|
//! | `head.json` | | the plan's checksum, which part it is, and what was done |
//! | `counts` | t | pairs of patches that exchange anything, of each pair of tiles |
//! | `rows`, `columns` | e | places of both patches in their tiles |
//! | `exchange` | e | what they exchange, A_i F_ij, m² |
//! | `checksum` | | of all that stands before it |

mod read;

pub use read::{Damage, MOST_PARTS, Parts, PartsError, has_part, read_plan};

use std::io::{self, Seek, Write};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::ExportError;
use super::archive_writer::Writer;
use super::members::{Members, Packing};
use super::target::{write_whole, write_with};
use crate::engines::PairsTally;
use crate::matrix::{Part, Plan};
use crate::progress::Progress;

/// What a plan and a part begin with.
const PLAN: &str = "hemicube plan";
const PART: &str = "hemicube part";

/// Of the formats; others are refused.
const VERSION: u32 = 1;

/// A plan as its file holds it.
#[derive(Serialize, Deserialize)]
struct PlanFile {
    format: String,
    version: u32,
    /// Version of the program that wrote it.
    program: String,
    plan: Plan,
    checksum: String,
}

/// What a part says of itself.
#[derive(Serialize, Deserialize)]
struct PartHead {
    format: String,
    version: u32,
    program: String,
    /// [`Plan::checksum`].
    plan: String,
    part: u32,
    of: u32,
    tally: PairsTally,
}

/// Where a part is in its folder.
#[must_use]
pub fn part_path(folder: &Path, (part, of): (u32, u32)) -> PathBuf {
    folder.join(format!("part-{part}-of-{of}.npz"))
}

/// Writes a plan.
///
/// # Errors
/// If the file cannot be written.
pub fn write_plan(path: &Path, plan: &Plan) -> Result<(), ExportError> {
    let file = PlanFile {
        format: PLAN.into(),
        version: VERSION,
        program: env!("CARGO_PKG_VERSION").into(),
        plan: plan.clone(),
        checksum: plan.checksum(),
    };
    let fail = |e: serde_json::Error| ExportError::Io { path: path.into(), source: e.into() };
    let mut text = serde_json::to_vec_pretty(&file).map_err(fail)?;
    text.push(b'\n');
    write_whole(path, &text)
}

/// Writes a part of a matrix into a folder that exists.
///
/// # Errors
/// If the file cannot be written, or the caller cancelled.
pub fn write_part(
    folder: &Path,
    plan: &Plan,
    part: &Part,
    progress: &dyn Progress,
) -> Result<PathBuf, ExportError> {
    let path = part_path(folder, (part.number, part.of));
    write_with(&path, |file| write_as(file, plan, part, progress))?;
    Ok(path)
}

fn write_as(
    file: &mut (impl Write + Seek),
    plan: &Plan,
    part: &Part,
    progress: &dyn Progress,
) -> io::Result<()> {
    const PLAIN: Packing = Packing::Plain;
    let mut to = Members { zip: Writer::new(file), progress };
    let head = PartHead {
        format: PART.into(),
        version: VERSION,
        program: env!("CARGO_PKG_VERSION").into(),
        plan: plan.checksum(),
        part: part.number,
        of: part.of,
        tally: part.tally,
    };
    to.bytes("head.json", PLAIN, &serde_json::to_vec_pretty(&head)?)?;
    let tiles = &part.tiles;
    let entries = tiles.iter().map(|t| t.len()).sum();
    to.array("counts", &[tiles.len()], PLAIN, tiles.iter().map(|t| t.len() as u32))?;
    let rows = tiles.iter().flat_map(|t| t.rows.iter().copied());
    to.array("rows", &[entries], PLAIN, rows)?;
    let columns = tiles.iter().flat_map(|t| t.columns.iter().copied());
    to.array("columns", &[entries], PLAIN, columns)?;
    let exchange = tiles.iter().flat_map(|t| t.exchange.iter().copied());
    to.array("exchange", &[entries], PLAIN, exchange)?;
    let checksum = to.zip.checksum();
    to.bytes("checksum", PLAIN, checksum.as_bytes())?;
    to.zip.finish()
}
