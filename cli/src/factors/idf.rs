//! Whether a matrix can be the view factors of a zone of EnergyPlus (`-o FILE.idf`).

use hemicube::export::{MatrixFormat, check_idf_name, check_idf_names};
use hemicube::matrix::{Rows, SurfaceRow};
use hemicube::scene::Scene;

use crate::args::{FaceSides, Factors};
use crate::failure::Failure;
use crate::terminal::say;

/// The name of the zone; refuses what EnergyPlus would misread, before any work is done.
pub fn zone_of(args: &Factors, format: MatrixFormat, scene: &Scene) -> Result<String, Failure> {
    let zone = args.outcome.zone.as_ref().unwrap_or(&scene.name);
    if format != MatrixFormat::Idf {
        return match args.outcome.zone {
            Some(_) => Err(Failure::input("--zone is used with -o FILE.idf only")),
            None => Ok(zone.clone()),
        };
    }
    let path = args.outcome.output.as_deref().unwrap_or(args.model.scene.as_path()).display();
    let refuse = |text: String| Err(Failure::Input(format!("{path}: {text}")));
    let Some(group) = args.outcome.group else {
        return refuse("EnergyPlus wants named surfaces, not faces; lump them with --group".into());
    };
    if args.sides == FaceSides::Two {
        return refuse("EnergyPlus knows no backs of surfaces; use --sides one".into());
    }
    if let Err(e) = check_idf_name(zone) {
        return refuse(format!("zone: {e}; give another name with --zone"));
    }
    let names = scene.grouping(group.by().0).names;
    match check_idf_names(names.iter().map(String::as_str)) {
        Ok(()) => Ok(zone.clone()),
        Err(e) => refuse(format!("{e}; rename the {} in the model", group.by().1)),
    }
}

/// Warns of a matrix that is not that of an enclosure.
pub fn warn_if_open(args: &Factors, rows: &dyn Rows, surfaces: &[SurfaceRow]) {
    /// What a row may lack unsaid, as share of 1: EnergyPlus scales its sums to within this.
    const SLIGHT: f64 = 1e-3;
    let (mut columns, mut values) = (Vec::new(), Vec::new());
    let lacks = (0..rows.len()).filter_map(|i| {
        rows.row(i, &mut columns, &mut values).ok()?;
        Some((i, 1.0 - values.iter().sum::<f64>()))
    });
    let worst = lacks.max_by(|a, b| a.1.total_cmp(&b.1)).filter(|w| w.1 > SLIGHT);
    if let Some((i, share)) = worst.filter(|_| !args.run.quiet && !args.outcome.enclosure) {
        say(&format!(
            "warning: EnergyPlus expects an enclosure and scales what is none, but {:.1} % of {} \
             goes to no surface; close the model and use --enclosure",
            100.0 * share,
            surfaces[i].name
        ));
    }
}
