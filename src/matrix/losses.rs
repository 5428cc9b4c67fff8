//! Rows that lose much of what they send out, and where it goes.

use std::collections::HashSet;

use glam::DVec2;

use super::names::Names;
use super::report::{LossesReport, RowLoss};
use crate::engines::sampling::cosine;
use crate::form_factors::RowAccount;
use crate::form_factors::closure::OPEN;
use crate::patches::PatchId;
use crate::scene::Side;
use crate::visibility::{Bvh, Frame};

/// A row that loses more than this to backs or numerically loses much: what closing a matrix does
/// not forgive.
pub const MUCH: f64 = OPEN;

/// A row that sends less than this to faces, and [`MOST`] to the environment, sees hardly any face,
/// where rows on average send [`MOST`] to them.
const HARDLY_ANY: f64 = 0.1;

/// More than half.
const MOST: f64 = 0.5;

/// Rows that are named.
const NAMED: usize = 32;

/// Rays that tell whose backs a row sees: a tenth of it is then known to about one per cent.
const RAYS: u32 = 512;

/// What the rows of all patches lose, where that is much; `mean` is the area-weighted mean share
/// that they send to faces.
pub fn losses(
    named: &Names<'_>,
    accounts: impl Iterator<Item = (PatchId, f64, RowAccount)>,
    mean: f64,
    bvh: &Bvh,
) -> Option<LossesReport> {
    let mut report = LossesReport::default();
    let mut found = Vec::new();
    for (id, faces, account) in accounts {
        let RowAccount { environment, back, lost } = account;
        let (to_backs, numerically) = (back > MUCH, lost.abs() > MUCH);
        // Of two sides that take part one may well look out of the model.
        let alone = !named.geometry.exchanges(named.patches.cell(id).triangle, Side::Back);
        let looks_out = alone && mean > MOST && faces < HARDLY_ANY && environment > MOST;
        report.to_backs += usize::from(to_backs);
        report.numerically += usize::from(numerically);
        report.see_hardly_any_face += usize::from(looks_out);
        if to_backs || numerically || looks_out {
            let escapes = if looks_out { environment } else { 0.0 };
            let row = named.row(id, faces);
            let (row, surface, backs_of) = (row.row, row.surface, None);
            let row = RowLoss { row, surface, faces, environment, back, lost, backs_of };
            found.push((back.max(lost.abs()).max(escapes), id, row));
        }
    }
    report.rows = found.len();
    for (id, mut row) in worst(found) {
        row.backs_of = (row.back > MUCH).then(|| backs_of(named, id, bvh)).flatten();
        report.worst.push(row);
    }
    (report.rows > 0).then_some(report)
}

/// Of rows with what they lose, the worst: first that of each surface, so that one bad surface does
/// not hide the others.
fn worst(mut found: Vec<(f64, PatchId, RowLoss)>) -> impl Iterator<Item = (PatchId, RowLoss)> {
    found.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let mut seen = HashSet::new();
    let (first, others): (Vec<_>, Vec<_>) =
        found.into_iter().partition(|(_, _, row)| seen.insert(row.surface.clone()));
    first.into_iter().chain(others).take(NAMED).map(|(_, id, row)| (id, row))
}

/// The surface of most of the backs without a row that a patch sees.
fn backs_of(named: &Names<'_>, id: PatchId, bvh: &Bvh) -> Option<String> {
    let geometry = named.geometry;
    let mut seen = vec![0_u32; geometry.surfaces.len()];
    for k in 0..RAYS {
        let [x, y, z, w] = sobol_burley::sample_4d(k, 0, 0);
        let from = named.patches.sample_own(id, DVec2::new(f64::from(x), f64::from(y)));
        let normal = geometry.normal(from.triangle, from.side);
        let Frame { origin, axes: [t, u, n] } = Frame::on_surface(from.position(geometry), normal);
        // In proportion to the cosine with the normal, as a row weighs what it sees.
        let [x, y, z] = cosine(z, w).map(f64::from);
        let direction = t * x + u * y + n * z;
        let Some(met) = bvh.see(origin, direction, Some(from.triangle)) else { continue };
        let surface = geometry.surface_of[met.triangle.index()] as usize;
        if met.side == Side::Back
            && !geometry.exchanges(met.triangle, Side::Back)
            && let Some(count) = seen.get_mut(surface)
        {
            *count += 1;
        }
    }
    // Of equal ones the first.
    let most = (0..seen.len()).rev().max_by_key(|&s| seen[s]).filter(|&s| seen[s] > 0)?;
    Some(geometry.surfaces[most].name.clone())
}
