//! What `hemicube heat` says of a balance.

use hemicube::heat::{Condition, HeatBalance};
use hemicube::matrix::MatrixReport;
use hemicube::units::significant;

use super::given::{OfRows, listed};
use crate::args::Heat;
use crate::terminal::say;

/// Backs that more of what is sent out than this meets are worth a warning.
const MUCH: f64 = 1e-3;

/// Says how the balance came about, and whether it adds up.
pub fn summary(args: &Heat, report: &MatrixReport, rows: &OfRows, found: &HeatBalance) {
    let count = |temperature: bool| {
        let is = |c: &&Condition| matches!(c, Condition::Temperature(_)) == temperature;
        rows.conditions.iter().filter(is).count()
    };
    say(&format!(
        "{}: {} rows, {} nodes: {} of given temperature, {} whose temperature is found ({} \
         iterations)",
        report.scene,
        rows.emissivity.len(),
        rows.conditions.len(),
        count(true),
        count(false),
        found.iterations
    ));
    let adiabatic = rows.surfaces.iter().zip(&rows.adiabatic).filter(|s| *s.1);
    let adiabatic: Vec<&str> = adiabatic.map(|s| s.0.as_str()).collect();
    if !adiabatic.is_empty() {
        say(&format!(
            "adiabatic, as neither --temperature nor --flux is given: {}",
            listed(adiabatic.into_iter())
        ));
    }
    let (watts, count) = found.left_out;
    if count > 0 {
        say(&format!(
            "warning: {count} rows lie on something and exchange with nothing: the {} W that were \
             to be supplied to them are left out",
            significant(watts)
        ));
    }
    let unsettled = found.sides.iter().zip(&rows.emissivity);
    let unsettled = unsettled.filter(|(s, e)| s.temperature.is_none() && **e > 0.0).count();
    if unsettled > 0 {
        say(&format!(
            "warning: {unsettled} rows exchange with nothing of a given temperature: theirs is \
             left open"
        ));
    }
    if let Some(account) = report.account.filter(|a| a.back > MUCH) {
        say(&format!(
            "warning: {:.1} % of what rows send out meets backs that have no temperature, and is \
             taken to come back; use --sides two if both sides exchange heat",
            100.0 * account.back
        ));
    }
    // What rounding leaves is nothing.
    let exchanged = found.supplied.max(found.removed).max(found.to_environment.abs());
    /// More than rounding leaves unaccounted for, where emissivities are not tiny.
    const MUCH_MISSING: f64 = 1e-9;
    let watt = |w: f64| match w.abs() > 1e-12 * exchanged {
        true => format!("{} W", significant(w)),
        false => String::from("0 W"),
    };
    let [received, escaped, absorbed] = found.sunlight;
    let environment = match args.environment {
        Some(_) => format!(", {} to the environment", watt(found.to_environment)),
        None => String::new(),
    };
    let sunlight = match received > 0.0 {
        true => format!(
            "; sunlight: {} come in, {} leave again, {} are absorbed",
            watt(received),
            watt(escaped),
            watt(absorbed)
        ),
        false => String::new(),
    };
    say(&format!(
        "energy: {} supplied, {} taken away{environment}{sunlight}; {} unaccounted for",
        watt(found.supplied),
        watt(found.removed),
        match found.imbalance > 0.0 {
            true => format!("{:.0e} of it", found.imbalance),
            false => String::from("nothing"),
        }
    ));
    if found.imbalance > MUCH_MISSING {
        say("warning: more than 1e-9 of the energy is unaccounted for, as emissivities are so \
             small that nearly all is reflected");
    }
    if (args.sun.is_some() || args.diffuse_sun.is_some()) && received == 0.0 {
        say(
            "warning: no sunlight arrives: the sun is hidden from all faces, and what is from all \
             around comes through an --environment alone",
        );
    }
    if let Some(pairs) = report.pairs {
        say(&format!(
            "errors: form factors to about {:.2} % (RMS), carried through to first order",
            100.0 * pairs.error
        ));
    }
    if args.run.verbose {
        for stage in &report.stages {
            say(&format!("{:14} {:8.3} s", stage.name, stage.seconds));
        }
    }
}
