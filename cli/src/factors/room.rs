//! Whether a matrix has room where it is to go, before it is made.

use hemicube::export::{MatrixFormat, Spill, folder_of};
use hemicube::matrix::{Forecast, RowStore};
use hemicube::units::Bytes;

use crate::args::Factors;
use crate::machine;

/// A larger table than this is refused on stdout.
const MOST_ON_STDOUT: u64 = 256 << 20;

/// Where the rows of a matrix go that will be like this: to memory (`None`) or through a file. Says
/// why there is no room for it.
pub fn store(
    args: &Factors,
    format: MatrixFormat,
    forecast: &Forecast,
) -> Result<Option<Box<dyn RowStore>>, String> {
    let file = if args.outcome.group.is_some() { 0 } else { file_bytes(args, format, forecast) };
    let Some(path) = &args.outcome.output else {
        return match file > MOST_ON_STDOUT {
            true => Err(format!(
                "a table of {0} x {0} form factors takes about {1}; on stdout {2} are the limit: \
                 write it \
                 with -o F.npz, or lump it with --group",
                forecast.rows,
                Bytes(file),
                Bytes(MOST_ON_STDOUT)
            )),
            false => Ok(None),
        };
    };
    let through_a_file = !forecast.fits() && !args.outcome.enclosure;
    let spilled = if through_a_file { Spill::ENTRY_BYTES * forecast.entries } else { 0 };
    let free = machine::free_disk(folder_of(path)).unwrap_or(u64::MAX);
    if file + spilled > free {
        let remedy = match format {
            MatrixFormat::Npz => "use fewer patches, --threshold or --group, or another disk",
            _ => "write .npz, which leaves zeros out, use --group, or another disk",
        };
        let beside = match spilled {
            0 => String::new(),
            bytes => format!(" and {} for a while beside it, for want of --memory", Bytes(bytes)),
        };
        return Err(format!(
            "{}: {1} x {1} form factors take about {2} on disk{beside}; {3} are free: {remedy}",
            path.display(),
            forecast.rows,
            Bytes(file),
            Bytes(free)
        ));
    }
    if !through_a_file {
        return Ok(None);
    }
    let spill = Spill::beside(path).map_err(|e| e.to_string())?;
    Ok(Some(Box::new(spill)))
}

/// Bytes of the file, nearly.
fn file_bytes(args: &Factors, format: MatrixFormat, forecast: &Forecast) -> u64 {
    let double = args.outcome.enclosure || args.outcome.threshold.is_some_and(|t| t > 0.0);
    let (n, entries) = (forecast.rows as u64, forecast.entries);
    let all = n.saturating_mul(n);
    let number = if double { 8 } else { 4 };
    // Digits of a factor, with what parts it from the next.
    let digits = if double { 22 } else { 13 };
    match format {
        // Columns, which ascend, shrink to a byte or two.
        MatrixFormat::Npz => entries.saturating_mul(number + 2),
        MatrixFormat::Npy => all.saturating_mul(number),
        // Row and column go before the digits.
        MatrixFormat::Mtx => {
            entries.saturating_mul(digits + 2 * (u64::from(n.max(1).ilog10()) + 2))
        }
        // Lumped matrices, which .idf alone holds, are small.
        MatrixFormat::Idf => 0,
        // A zero takes two bytes.
        MatrixFormat::Csv => {
            entries.saturating_mul(digits).saturating_add(2 * all.saturating_sub(entries))
        }
    }
}
