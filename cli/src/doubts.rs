//! What is doubtful about a picture, and the flag that helps.

use hemicube::render::Shares;
use hemicube::report::{Cause, ErrorReport, Report};

/// Less of a picture than this is nothing to see.
const EMPTY: f64 = 2e-3;

/// Below this share of lit surfaces a picture is black.
const DARK: f64 = 0.05;

/// Above this share of backs in what is in view it is seen from the wrong side.
const BACKS: f64 = 0.5;

/// Exposures beyond this, in stops, show more of the noise than of the light.
const STOPS: f64 = 12.0;

/// The same downwards in sunlight: 100,000 lx on white paper are exposed by -17.
const STOPS_IN_SUN: f64 = 18.0;

/// Errors above this are worth a warning.
const ERROR: f64 = 0.1;

/// Errors above this are as large as irradiance itself, and a number means nothing.
const UNKNOWN: f64 = 1.0;

/// What lights a solution.
const BRIGHTEN: &str = "let its sources emit more with --emission; hemicube info lists them";

/// How a picture was taken.
#[derive(Debug, Clone, Copy, Default)]
pub struct Taken {
    /// Its exposure in stops, if that was chosen.
    pub stops: Option<f64>,
    /// Whether a sun shines.
    pub sunlit: bool,
    /// Whether `--stage off` forbids a light of its own.
    pub stage_off: bool,
    /// Whether `--flip` turns all faces round.
    pub flipped: bool,
    /// Whether the scene is a solution, whose faces and lamps stay where they are.
    pub solved: bool,
}

/// Warnings about what a picture shows; `lamp` is the flag that lights what is in view.
pub fn of_picture(shares: &Shares, taken: &Taken, lamp: &dyn Fn() -> String) -> Vec<String> {
    let Shares { surface, lit, back } = *shares;
    if surface + back < EMPTY {
        return vec![
            "nothing of the model is in view; leave --eye and --target out, and a point of view \
             is chosen"
                .to_owned(),
        ];
    }
    let off = if taken.stage_off { "--stage off, " } else { "" };
    let mut doubts = Vec::new();
    if back > BACKS * (surface + back) {
        doubts.push(format!(
            "{:.0} % of what is in view are backs, which reflect nothing; {}",
            100.0 * back / (surface + back),
            match (taken.solved, taken.flipped) {
                (true, _) => "solve the model again with --sides two",
                (_, true) => "use --sides two, or leave --flip out",
                (_, false) => "use --sides two, or --flip if all faces are turned round",
            }
        ));
    } else if lit < DARK * surface {
        let remedy = match taken.solved {
            true => BRIGHTEN.to_owned(),
            false => format!(
                "leave {off}--sky and --emission out, and a light is chosen, or hang a lamp, for \
                 example by {}",
                lamp()
            ),
        };
        doubts.push(format!("the picture is black: no light reaches what is in view; {remedy}"));
    }
    let usual = -if taken.sunlit { STOPS_IN_SUN } else { STOPS }..=STOPS;
    if let Some(stops) = taken.stops.filter(|stops| !usual.contains(stops)) {
        let text = format!("what is in view is exposed by {stops:+.0} stops: the light is very");
        doubts.push(match stops > 0.0 {
            true if taken.solved => {
                format!("{text} faint; little of it gets here, and noise shows: {BRIGHTEN}")
            }
            true => format!(
                "{text} faint; little of it gets here, and noise shows: {}hang a lamp, for \
                 example by {}, or choose the brightness with --exposure",
                if taken.stage_off { "leave --stage off out, or " } else { "" },
                lamp()
            ),
            false => format!(
                "{text} strong; check the unit of what emits (--emission, --lamp), or choose the \
                 brightness with --exposure"
            ),
        });
    }
    doubts
}

/// A warning about irradiance that is hardly known.
pub fn of_error(error: &ErrorReport, sampled: bool) -> Option<String> {
    let remedy = if sampled {
        "use more --samples and a smaller --patch-size, or --error 5%"
    } else {
        "use a smaller --patch-size"
    };
    if error.total > UNKNOWN {
        return Some(format!(
            "on a fifth of the surface or more irradiance is not known: its error may be as large \
             as irradiance itself ({}); {remedy}",
            parts(error)
        ));
    }
    (error.total > ERROR).then(|| {
        format!(
            "on 80 % of the surface irradiance is known to {:.0} % only ({}); {remedy}",
            100.0 * error.total,
            parts(error)
        )
    })
}

/// A warning about a picture that is hardly known, or not as well as was asked for: `known` is the
/// error on most of it, and what of that is the solution's.
pub fn of_pixels([all, of_solution]: [f64; 2], wanted: Option<f64>) -> Option<String> {
    let limit = wanted.unwrap_or(ERROR);
    if all <= limit {
        return None;
    }
    let known = match all > UNKNOWN {
        true => "on a fifth of the picture or more light is not known".to_owned(),
        false => format!("on 80 % of the picture light is known to {:.1} % only", 100.0 * all),
    };
    let why = if of_solution > 0.7 * all {
        "patches are too large for it, or their rays too few; use a smaller --patch-size and more \
         --samples"
    } else if wanted.is_some() {
        "rays are as many as they can be, as half-shadows or contacts fill the picture; allow a \
         larger error"
    } else {
        "ask for less with --error 5%, and see --error-map"
    };
    Some(format!("{known}: {why}"))
}

/// What an error is due to.
fn parts(error: &ErrorReport) -> String {
    let share = |e: f64| match e > UNKNOWN {
        true => "more than irradiance".to_owned(),
        false => format!("{:.0} %", 100.0 * e),
    };
    format!("noise {}, size of patches {}", share(error.noise), share(error.refinement))
}

/// How well irradiance is known, as details say it: errors beyond irradiance itself are words.
pub fn known_to(error: &ErrorReport) -> String {
    let share = |e: f64| match e > UNKNOWN {
        true => "more than irradiance itself".to_owned(),
        false => format!("{:.2} %", 100.0 * e),
    };
    let most = match error.total > UNKNOWN {
        true => "on a fifth of the surface or more irradiance is not known".to_owned(),
        false => format!("on 80 % of the surface irradiance is known to {}", share(error.total)),
    };
    let half = match error.half > UNKNOWN {
        true => "on half of it neither".to_owned(),
        false => format!("on half of it to {}", share(error.half)),
    };
    format!(
        "{most} (noise {}, size of patches {}), {half}",
        share(error.noise),
        share(error.refinement)
    )
}

/// A warning about light that comes from nowhere or goes there.
pub fn of_balance(report: &Report) -> Option<String> {
    let imbalance = report.imbalance()?;
    let (percent, more) = (100.0 * imbalance.share.abs(), imbalance.share > 0.0);
    let what = match more {
        true => format!("{percent:.1} % more light arrives than is sent out"),
        false => format!("{percent:.1} % of all light is lost"),
    };
    let why = match imbalance.cause {
        Cause::Lost => {
            "form factors leave out much of what patches see; use --engine rays, or a smaller \
             --patch-size"
        }
        Cause::Samples if report.engine.as_ref().is_some_and(|e| e.samples.is_some()) => {
            "rays are too few for how unlike patches are; use more --samples, or --error 1%"
        }
        Cause::Samples => "form factors are too rough; use a smaller --error",
        Cause::Patches => {
            "the view from the middle of a patch does not stand for all of it; use a smaller \
             --patch-size, or --engine rays"
        }
        Cause::Stored => {
            "the stored form factors do not balance; make them with more --samples or a smaller \
             --patch-size, or leave --factors out"
        }
    };
    Some(format!("{what}: {why}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_that_shows_nothing_says_why() {
        let doubts = |surface, lit, back, stops| {
            let taken = Taken { stops: Some(stops), ..Taken::default() };
            let lamp = || "--lamp lamp=1,2,3,400".to_owned();
            of_picture(&Shares { surface, lit, back }, &taken, &lamp).join(" | ")
        };
        assert_eq!(doubts(0.8, 0.7, 0.1, 3.0), "");
        assert!(doubts(0.0, 0.0, 0.001, 0.0).contains("--eye"));
        assert!(doubts(0.1, 0.1, 0.4, 0.0).contains("80 % of what is in view are backs"));
        assert!(doubts(1.0, 0.0, 0.0, 0.0).contains("--lamp"));
        assert!(doubts(1.0, 1.0, 0.0, 24.0).contains("+24 stops"));
        assert!(doubts(1.0, 1.0, 0.0, -24.0).contains("-24 stops"));
        assert!(doubts(1.0, 1.0, 0.0, -16.0).contains("-16 stops"));
        let shares = Shares { surface: 1.0, lit: 1.0, back: 0.0 };
        let taken = Taken { stops: Some(-16.0), sunlit: true, ..Taken::default() };
        assert!(of_picture(&shares, &taken, &String::new).is_empty());
        assert!(of_picture(&shares, &Taken::default(), &String::new).is_empty());
    }

    #[test]
    fn an_error_beyond_irradiance_is_said_in_words() {
        let error =
            |total: f64| ErrorReport { total, noise: 0.5 * total, refinement: 0.04, half: 0.02 };
        let said = |total| of_error(&error(total), true).unwrap_or_default();
        assert_eq!(said(0.09), "");
        assert!(said(0.3).contains("known to 30 % only (noise 15 %, size of patches 4 %)"));
        let unknown = said(4.58);
        assert!(unknown.contains("not known") && !unknown.contains("458"), "{unknown}");
        assert!(unknown.contains("noise more than irradiance, size of patches 4 %"), "{unknown}");
        let details = known_to(&error(0.02));
        let exact = "on 80 % of the surface irradiance is known to 2.00 % (noise 1.00 %, size of \
                     patches 4.00 %), on half of it to 2.00 %";
        assert_eq!(details, exact);
        assert!(!known_to(&error(4.58)).contains("458"));
    }

    #[test]
    fn an_imbalance_is_said_with_what_helps() {
        let energy = |imbalance: f64| hemicube::solve::EnergyBalance {
            emitted: [1.0; 3],
            imbalance,
            ..Default::default()
        };
        let said = |imbalance: f64| {
            let energy = Some(energy(imbalance));
            of_balance(&Report { energy, ..Report::default() }).unwrap_or_default()
        };
        assert_eq!(said(0.005), "");
        assert!(said(0.023).starts_with("2.3 % more light arrives"), "{}", said(0.023));
        assert!(said(-0.04).starts_with("4.0 % of all light is lost"), "{}", said(-0.04));
        assert!(said(-0.04).contains("--factors"));
    }
}
