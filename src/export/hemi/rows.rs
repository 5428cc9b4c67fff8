//! Rows of form factors as arrays.

use std::io::{self, Seek, Write};

use super::manifest::{BlockHead, RowsHead, WeightsHead};
use super::members::{Members, Packing};
use crate::export::archive::{Archive, float, integer};
use crate::form_factors::{FormFactors, RowAccount, RowBlock, RowSink, Weights};
use crate::patches::PatchId;

/// Writes rows into the folder `name`.
pub fn write<W: Write + Seek>(
    to: &mut Members<W>,
    name: &str,
    rows: &FormFactors,
) -> io::Result<RowsHead> {
    const PLAIN: Packing = Packing::Plain;
    let blocks: Vec<&RowBlock> = rows.blocks().collect();
    let (count, entries) = (rows.rows(), rows.entries() as usize);
    let at = |part: &str| format!("{name}/{part}");
    let ids = blocks.iter().flat_map(|b| b.ids.iter().map(|i| i.0));
    to.array(&at("patches"), &[count], PLAIN, ids)?;
    let lengths =
        |b: &RowBlock| b.starts.windows(2).map(|w| (w[1] - w[0]) as u32).collect::<Vec<_>>();
    to.array(&at("lengths"), &[count], PLAIN, blocks.iter().flat_map(|b| lengths(b)))?;
    let halves = |b: &RowBlock| {
        let ends = b.halves.iter().zip(&b.starts);
        ends.map(|(half, start)| (half - start) as u32).collect::<Vec<_>>()
    };
    let sampled = blocks.iter().map(|b| b.halves.len()).sum();
    to.array(&at("halves"), &[sampled], PLAIN, blocks.iter().flat_map(|b| halves(b)))?;
    let shares = |a: &RowAccount| [a.environment, a.back, a.lost];
    let accounts = blocks.iter().flat_map(|b| b.accounts.iter().flat_map(shares));
    to.array(&at("account"), &[count, 3], PLAIN, accounts)?;
    let columns = blocks.iter().flat_map(|b| b.columns.iter().map(|j| j.0));
    to.array(&at("columns"), &[entries], PLAIN, columns)?;
    let fixed = |b: &&RowBlock| match &b.weights {
        Weights::Fixed(w) => w.clone(),
        _ => Vec::new(),
    };
    let each = |b: &&RowBlock| match &b.weights {
        Weights::Each(w) => w.clone(),
        _ => Vec::new(),
    };
    let kept = |kind: WeightsHead| {
        blocks.iter().filter(|b| head(b).weights == kind).map(|b| b.entries()).sum::<usize>()
    };
    to.array(&at("fixed"), &[kept(WeightsHead::Fixed)], PLAIN, blocks.iter().flat_map(fixed))?;
    to.array(&at("each"), &[kept(WeightsHead::Each)], PLAIN, blocks.iter().flat_map(each))?;
    // Neighbours that are stored alike become one block.
    let mut heads: Vec<BlockHead> = Vec::new();
    for head in blocks.iter().map(|b| head(b)) {
        match heads.last_mut() {
            Some(last) if last.weights == head.weights => last.rows += head.rows,
            _ => heads.push(head),
        }
    }
    Ok(RowsHead { rows: count as u64, entries: entries as u64, blocks: heads })
}

fn head(block: &RowBlock) -> BlockHead {
    let weights = match block.weights {
        Weights::Fixed(_) => WeightsHead::Fixed,
        Weights::Each(_) => WeightsHead::Each,
        Weights::Equal { rays, .. } => WeightsHead::Equal(rays),
    };
    BlockHead { rows: block.len() as u64, weights }
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
    if head.rows > patches || in_blocks != Some(head.rows) {
        return Err(wrong("the manifest does not say how many rows there are"));
    }
    let at = |part: &str| format!("{name}/{part}");
    let whole = |kind, b: &[u8]| integer(kind, b).and_then(|i| u32::try_from(i).ok());
    let patch =
        |kind, b: &[u8]| integer(kind, b).filter(|&i| i < patches).map(|i| PatchId(i as u32));
    let ids = from.numbers(&at("patches"), head.rows, patch)?;
    let lengths = from.numbers(&at("lengths"), head.rows, whole)?;
    let rows_of = |which: &dyn Fn(WeightsHead) -> bool| {
        head.blocks.iter().filter(|b| which(b.weights)).map(|b| b.rows).sum::<u64>()
    };
    let sampled = rows_of(&|w| matches!(w, WeightsHead::Equal(_)));
    let halves = from.numbers(&at("halves"), sampled, whole)?;
    let share = |kind, b: &[u8]| float(kind, b).filter(|x| x.is_finite());
    let account = from.numbers(&at("account"), 3 * head.rows, share)?;
    let all: u64 = lengths.iter().map(|&l| u64::from(l)).sum();
    if all != head.entries {
        return Err(wrong("lengths.npy does not say where rows end"));
    }
    let columns = from.numbers(&at("columns"), head.entries, patch)?;
    let mut first = 0;
    let mut entries = [0_u64; 2];
    for block in &head.blocks {
        let lengths = &lengths[first..first + block.rows as usize];
        let all: u64 = lengths.iter().map(|&l| u64::from(l)).sum();
        match block.weights {
            WeightsHead::Fixed => entries[0] += all,
            WeightsHead::Each => entries[1] += all,
            WeightsHead::Equal(0) => return Err(wrong("rows of no rays")),
            WeightsHead::Equal(_) => {}
        }
        first += block.rows as usize;
    }
    let fixed = from.numbers(&at("fixed"), entries[0], whole)?;
    let factor =
        |kind, b: &[u8]| float(kind, b).map(|f| f as f32).filter(|f| (0.0..=2.0).contains(f));
    let each = from.numbers(&at("each"), entries[1], factor)?;

    let mut factors = FormFactors::new(patches as usize, memory);
    let (mut rows, mut columns) = (0, columns.into_iter());
    let (mut fixed, mut each) = (fixed.into_iter(), each.into_iter());
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
        block.columns = columns.by_ref().take(end).collect();
        block.weights = match head.weights {
            WeightsHead::Fixed => Weights::Fixed(fixed.by_ref().take(end).collect()),
            WeightsHead::Each => Weights::Each(each.by_ref().take(end).collect()),
            WeightsHead::Equal(rays) => Weights::Equal { entries: end, rays },
        };
        factors.take(block).map_err(|e| wrong(&e.to_string()))?;
        rows = range.end;
    }
    Ok(factors)
}
