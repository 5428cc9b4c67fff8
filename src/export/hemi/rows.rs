//! Rows of form factors as arrays.

use std::io::{self, Seek, Write};

use super::manifest::{BlockHead, RowsHead, WeightsHead};
use crate::export::archive::{Archive, Kind, float, integer, word};
use crate::export::members::{Members, Packing};
use crate::form_factors::{FormFactors, RowAccount, RowBlock, RowSink, RowView, Weights};
use crate::patches::{MAX_PATCHES, PatchId};
use crate::ranks::RanksError;

/// Rows that ranks send at a time.
const AT_ONCE: usize = 1024;

/// Writes all rows into the folder `name`, in the order of patches. Where ranks share them, the
/// others [send] theirs meanwhile.
pub fn write<W: Write + Seek>(
    to: &mut Members<'_, W>,
    name: &str,
    factors: &FormFactors,
) -> io::Result<RowsHead> {
    let ids = with_row(factors);
    let lengths = factors.lengths(&ids).map_err(io::Error::other)?;
    let mut failure = None;
    let columns = ids.chunks(AT_ONCE).zip(lengths.chunks(AT_ONCE)).flat_map(|(ids, lengths)| {
        factors.columns(ids, lengths).unwrap_or_else(|e| {
            failure = Some(e);
            Vec::new()
        })
    });
    let head = write_some(to, name, factors, (&ids, &lengths), columns)?;
    match failure {
        Some(e) => Err(io::Error::other(e)),
        None => Ok(head),
    }
}

/// Lets rank 0 [write] the rows that this one has.
pub fn send(factors: &FormFactors) -> Result<(), RanksError> {
    let ids = with_row(factors);
    let lengths = factors.lengths(&ids)?;
    let mut parts = ids.chunks(AT_ONCE).zip(lengths.chunks(AT_ONCE));
    parts.try_for_each(|(ids, lengths)| factors.columns(ids, lengths).map(|_| ()))
}

fn with_row(factors: &FormFactors) -> Vec<PatchId> {
    (0..factors.len() as u32).map(PatchId).filter(|i| factors.has_row(*i)).collect()
}

/// Writes the rows of some patches that are all here.
pub fn write_own<W: Write + Seek>(
    to: &mut Members<'_, W>,
    name: &str,
    factors: &FormFactors,
    ids: &[PatchId],
) -> io::Result<RowsHead> {
    let lengths: Vec<[u32; 2]> = ids.iter().map(|&i| factors.lengths_of(i)).collect();
    let columns = ids.iter().filter_map(|&i| factors.row(i)).flat_map(|r| r.columns);
    write_some(to, name, factors, (ids, &lengths), columns.map(|j| j.0))
}

/// Writes some rows: of which patches, how many entries each and its first half have, and what they
/// see one after the other.
fn write_some<W: Write + Seek>(
    to: &mut Members<'_, W>,
    name: &str,
    factors: &FormFactors,
    (ids, lengths): (&[PatchId], &[[u32; 2]]),
    columns: impl Iterator<Item = u32>,
) -> io::Result<RowsHead> {
    const PLAIN: Packing = Packing::Plain;
    let rows: Vec<RowView<'_>> = ids.iter().filter_map(|i| factors.row(*i)).collect();
    let count = rows.len();
    let entries: u64 = lengths.iter().map(|l| u64::from(l[0])).sum();
    let at = |part: &str| format!("{name}/{part}");
    to.array(&at("patches"), &[count], PLAIN, ids.iter().map(|i| i.0))?;
    to.array(&at("lengths"), &[count], PLAIN, lengths.iter().map(|l| l[0]))?;
    let sampled =
        rows.iter().zip(lengths).filter(|(r, _)| matches!(r.weights, Weights::Equal { .. }));
    let halves: Vec<u32> = sampled.map(|(_, l)| l[1]).collect();
    to.array(&at("halves"), &[halves.len()], PLAIN, halves.into_iter())?;
    let account = |i: &PatchId| {
        let RowAccount { environment, back, lost } = factors.account(*i);
        [environment, back, lost]
    };
    to.array(&at("account"), &[count, 3], PLAIN, ids.iter().flat_map(account))?;
    to.array(&at("columns"), &[entries as usize], PLAIN, columns)?;
    let fixed = rows.iter().flat_map(|r| match r.weights {
        Weights::Fixed(w) => &w[r.range()],
        _ => &[],
    });
    let each = rows.iter().flat_map(|r| match r.weights {
        Weights::Each(w) => &w[r.range()],
        _ => &[],
    });
    to.array(&at("fixed"), &[fixed.clone().count()], PLAIN, fixed.copied())?;
    to.array(&at("each"), &[each.clone().count()], PLAIN, each.copied())?;
    let mut blocks: Vec<BlockHead> = Vec::new();
    for row in &rows {
        let weights = match row.weights {
            Weights::Fixed(_) => WeightsHead::Fixed,
            Weights::Each(_) => WeightsHead::Each,
            Weights::Equal { rays, .. } => WeightsHead::Equal(*rays),
        };
        match blocks.last_mut() {
            Some(last) if last.weights == weights => last.rows += 1,
            _ => blocks.push(BlockHead { rows: 1, weights }),
        }
    }
    Ok(RowsHead { rows: count as u64, entries, blocks })
}

/// Reads the rows of so many patches from the folder `name`, in at most `memory` bytes.
pub fn read(
    from: &mut Archive,
    name: &str,
    head: &RowsHead,
    patches: u64,
    memory: u64,
) -> Result<FormFactors, String> {
    let wrong = |what: &str| format!("{name}: {what}");
    let in_blocks = head.blocks.iter().try_fold(0_u64, |all, b| all.checked_add(b.rows));
    let too_many = head.rows > patches || patches > MAX_PATCHES;
    if too_many || in_blocks != Some(head.rows) {
        return Err(wrong("the manifest does not say how many rows there are"));
    }
    let at = |part: &str| format!("{name}/{part}");
    let patch =
        |kind, b: &[u8]| integer(kind, b).filter(|&i| i < patches).map(|i| PatchId(i as u32));
    let ids = from.numbers(&at("patches"), head.rows, patch)?;
    if !ids.is_sorted_by(|a, b| a < b) {
        return Err(wrong("patches.npy is not in order"));
    }
    let lengths = from.numbers(&at("lengths"), head.rows, word)?;
    let rows_of = |which: &dyn Fn(WeightsHead) -> bool| {
        head.blocks.iter().filter(|b| which(b.weights)).map(|b| b.rows).sum::<u64>()
    };
    let sampled = rows_of(&|w| matches!(w, WeightsHead::Equal(_)));
    let halves = from.numbers(&at("halves"), sampled, word)?;
    let account = from.numbers(&at("account"), 3 * head.rows, share)?;
    let all: u64 = lengths.iter().map(|&l| u64::from(l)).sum();
    if all != head.entries {
        return Err(wrong("lengths.npy does not say where rows end"));
    }
    let mut columns = from.numbers(&at("columns"), head.entries, patch)?;
    let mut first = 0;
    let mut entries = [0_u64; 2];
    for block in &head.blocks {
        let lengths = &lengths[first..first + block.rows as usize];
        let all: u64 = lengths.iter().map(|&l| u64::from(l)).sum();
        match block.weights {
            WeightsHead::Fixed => entries[0] += all,
            WeightsHead::Each => entries[1] += all,
            WeightsHead::Equal(rays) if lengths.iter().all(|&l| l <= rays && rays > 0) => {}
            WeightsHead::Equal(_) => return Err(wrong("rows of more than their rays")),
        }
        first += block.rows as usize;
    }
    let mut fixed = from.numbers(&at("fixed"), entries[0], word)?;
    let factor =
        |kind, b: &[u8]| float(kind, b).map(|f| f as f32).filter(|f| (0.0..=MOST).contains(f));
    let mut each = from.numbers(&at("each"), entries[1], factor)?;

    let mut factors = FormFactors::new(patches as usize, memory);
    let mut rows = 0;
    let mut halves = halves.into_iter();
    for head in &head.blocks {
        let range = rows..rows + head.rows as usize;
        let mut block = RowBlock { starts: vec![0], ..RowBlock::default() };
        block.ids = ids[range.clone()].to_vec();
        let mut end = 0;
        for row in range.clone() {
            let length = lengths[row] as usize;
            if let WeightsHead::Equal(_) = head.weights {
                let half = halves.next().filter(|&h| h as usize <= length);
                let half = half.ok_or_else(|| wrong("halves.npy leads out of its rows"))?;
                block.halves.push(end + half as usize);
            }
            end += length;
            block.starts.push(end);
            let [environment, back, lost] = [0, 1, 2].map(|k| account[3 * row + k]);
            block.accounts.push(RowAccount { environment, back, lost });
        }
        block.columns = first_of(&mut columns, end);
        block.weights = match head.weights {
            WeightsHead::Fixed => Weights::Fixed(first_of(&mut fixed, end)),
            WeightsHead::Each => Weights::Each(first_of(&mut each, end)),
            WeightsHead::Equal(rays) => Weights::Equal { entries: end, rays },
        };
        factors.take(block).map_err(|e| wrong(&e.to_string()))?;
        rows = range.end;
    }
    Ok(factors)
}

/// What rounding leaves of a form factor of 1 at the most.
const MOST: f32 = 2.0;

/// A share of a row; what is lost is what its sum lacks, or has too much.
fn share(kind: Kind, bytes: &[u8]) -> Option<f64> {
    float(kind, bytes).filter(|share| share.abs() <= f64::from(MOST))
}

/// Takes the first numbers off; the last of them need no copy.
fn first_of<T>(numbers: &mut Vec<T>, count: usize) -> Vec<T> {
    let rest = numbers.split_off(count);
    std::mem::replace(numbers, rest)
}
