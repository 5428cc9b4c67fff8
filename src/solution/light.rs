//! The conductor: from a scene to its solution.

use std::sync::Arc;

use super::balance::Balance;
use super::error::LightError;
use super::options::{LightOptions, Work};
use super::transport::Transport;
use crate::direct;
use crate::form_factors::{Account, FormFactors, RowsReport};
use crate::patches::{PatchId, Patches, side_index};
use crate::progress::{Cancelled, Progress};
use crate::ranks::RanksError;
use crate::reconstruct::Field;
use crate::report::{Clock, Report};
use crate::scene::{Rgb, Scene};

/// A lit scene: patches and their irradiance.
#[derive(Debug, Clone)]
pub struct Solution {
    /// The patches.
    pub patches: Arc<Patches>,
    /// Irradiance H of each, W/m² or lx.
    pub irradiance: Vec<Rgb>,
    /// Of that, what arrives by way of other surfaces, less an estimate of what lamp-like emitters
    /// reflect, and from the sky.
    pub reflected: Vec<Rgb>,
    /// The same as each of two independent halves of the rays gives it, where rows are sampled.
    pub reflected_halves: Option<[Vec<Rgb>; 2]>,
    /// Whether a patch's value stands for what is seen of it: it has a row and is not covered.
    pub usable: Vec<bool>,
    /// Irradiance as each of two independent halves of the rays alone gives it, where rows are
    /// sampled.
    pub halves: Option<[Vec<Rgb>; 2]>,
    /// How it came about.
    pub report: Report,
}

impl Solution {
    /// Irradiance as a smooth field over the surfaces.
    #[must_use]
    pub fn field<'a>(&'a self, scene: &Scene) -> Field<'a> {
        Field::new(&scene.geometry, &self.patches, &self.irradiance, |i| self.usable[i.index()])
    }

    /// [`field`](Self::field), which `progress` may stop.
    ///
    /// # Errors
    /// If it does.
    pub fn field_heard<'a>(
        &'a self,
        scene: &Scene,
        progress: &dyn Progress,
    ) -> Result<Field<'a>, Cancelled> {
        let usable = |i: PatchId| self.usable[i.index()];
        Field::new_heard(&scene.geometry, &self.patches, &self.irradiance, usable, progress)
    }

    /// What arrives by way of other surfaces as a smooth field, which `progress` may stop.
    ///
    /// # Errors
    /// If it does.
    pub fn reflected_field_heard<'a>(
        &'a self,
        scene: &Scene,
        progress: &dyn Progress,
    ) -> Result<Field<'a>, Cancelled> {
        let usable = |i: PatchId| self.usable[i.index()];
        Field::new_heard(&scene.geometry, &self.patches, &self.reflected, usable, progress)
    }
}

/// Lights a scene once, as the options say ([`LightOptions::error`] is for
/// [`Scene::light`](crate::Scene::light)).
///
/// # Errors
/// If the options do not suit the scene or each other, or the work does not fit in memory.
pub fn light(
    scene: &Scene,
    options: &LightOptions,
    progress: &dyn Progress,
) -> Result<Solution, LightError> {
    light_shared(scene, options, &Work::default(), progress)
}

/// The same where several ranks share the work, or rows are kept for another run.
///
/// # Errors
/// As [`light`]; if ranks are asked for what one process does alone, or cannot reach each other.
pub fn light_shared(
    scene: &Scene,
    options: &LightOptions,
    work: &Work<'_>,
    progress: &dyn Progress,
) -> Result<Solution, LightError> {
    let mut clock = Clock::start();
    let transport = Transport::of(scene, options, work, &mut clock, progress)?;
    light_through(scene, transport, options, clock, progress)
}

/// Lights a scene by the form factors of patches that are there already.
pub fn light_by(
    scene: &Scene,
    patches: Patches,
    factors: FormFactors,
    options: &LightOptions,
    progress: &dyn Progress,
) -> Result<Solution, LightError> {
    let clock = Clock::start();
    let transport = Transport::stored(scene, patches, factors, progress);
    light_through(scene, transport, options, clock, progress)
}

fn light_through(
    scene: &Scene,
    transport: Transport,
    options: &LightOptions,
    mut clock: Clock,
    progress: &dyn Progress,
) -> Result<Solution, LightError> {
    let lamps = &transport.lamps;
    let balance = Balance::of(scene, &transport, lamps, options, &mut clock, progress)?;
    let Transport { patches, factors, .. } = &transport;
    let usable = transport.usable();
    let mut solution = Solution::new(scene, Arc::clone(patches), factors, usable, balance)?;
    let report = &mut solution.report;
    report.patch_size = transport.mesh.patch_size;
    report.rows = Some(rows_report(&transport)?);
    report.engine = Some(transport.engine);
    report.stages = clock.stages;
    report.foretold_memory_bytes = transport.foretold;
    Ok(solution)
}

impl Solution {
    /// Light of a scene on patches. `factors` need know no more than which emitters each sees.
    pub(crate) fn new(
        scene: &Scene,
        patches: Arc<Patches>,
        factors: &FormFactors,
        usable: Vec<bool>,
        balance: Balance,
    ) -> Result<Self, RanksError> {
        let Balance { irradiance, arrived, spread, energy, solved, .. } = balance;
        let reflected = without_lamps(scene, &patches, factors, &irradiance, arrived)?;
        let both = |middle: &[Rgb], off: &dyn Fn(usize) -> Rgb| {
            [1.0, -1.0].map(|sign| {
                middle.iter().enumerate().map(|(i, m)| *m + off(i) * sign).collect::<Vec<Rgb>>()
            })
        };
        let halves = spread.as_ref().map(|[all, _]| both(&irradiance, &|i| all[i]));
        // What halves differ in, but for what arrives straight.
        let reflected_halves =
            spread.as_ref().map(|[all, direct]| both(&reflected, &|i| all[i] - direct[i]));
        let report = Report {
            scene: scene.name.clone(),
            source_triangles: scene.geometry.len(),
            patches: patches.len(),
            clusters: patches.ids().filter(|&i| patches.is_cluster(i)).count(),
            contacts_left_out: patches.contacts_left_out(),
            solve: solved,
            energy: Some(energy),
            ..Report::default()
        };
        Ok(Self { patches, irradiance, reflected, reflected_halves, usable, halves, report })
    }
}

/// What arrived by way of other surfaces, without the estimate of what lamp-like emitters reflect.
fn without_lamps(
    scene: &Scene,
    patches: &Patches,
    factors: &FormFactors,
    irradiance: &[Rgb],
    mut arrived: Vec<Rgb>,
) -> Result<Vec<Rgb>, RanksError> {
    let lamps = direct::reflected_by_emitters(scene, patches, irradiance);
    let of = |i: PatchId| {
        let cell = patches.cell(i);
        lamps[side_index(cell.triangle, cell.side)]
    };
    if lamps.iter().any(|l| *l != Rgb::ZERO) {
        let by_lamps = factors.share_exactly(factors.of_own(|i| factors.gather_by(i, of)))?;
        arrived.iter_mut().zip(by_lamps).for_each(|(arrived, by_lamps)| *arrived -= by_lamps);
    }
    Ok(arrived)
}

/// The account of all rows.
fn rows_report(transport: &Transport) -> Result<RowsReport, RanksError> {
    let Transport { patches, factors, .. } = transport;
    let areas: Vec<f64> = patches.ids().map(|i| patches.own_area(i)).collect();
    let with_row: Vec<PatchId> = patches.ids().filter(|&i| factors.has_row(i)).collect();
    let sampled = factors.halves().is_some();
    let mut account = Account::new(&areas, if sampled { &[] } else { &with_row });
    account.add_all(factors);
    let mut report = account.report();
    // Of other ranks' rows the entries are not here.
    let all = factors.ranks().every([report.entries, report.bytes])?;
    report.entries = all.iter().map(|n| n[0]).sum();
    report.bytes = all.iter().map(|n| n[1]).sum();
    Ok(report)
}
