//! What is doubtful about a picture, and the flag that helps.

use hemicube::render::Shares;
use hemicube::report::ErrorReport;

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
            match taken.flipped {
                true => "use --sides two, or leave --flip out",
                false => "use --sides two, or --flip if all faces are turned round",
            }
        ));
    } else if lit < DARK * surface {
        doubts.push(format!(
            "the picture is black: no light reaches what is in view; leave {off}--sky and \
             --emission out, and a light is chosen, or hang a lamp, for example by {}",
            lamp()
        ));
    }
    let usual = -if taken.sunlit { STOPS_IN_SUN } else { STOPS }..=STOPS;
    if let Some(stops) = taken.stops.filter(|stops| !usual.contains(stops)) {
        let text = format!("what is in view is exposed by {stops:+.0} stops: the light is very");
        doubts.push(match stops > 0.0 {
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
    (error.total > ERROR).then(|| {
        format!(
            "on 80 % of the surface irradiance is known to {:.0} % only (noise {:.0} %, size of \
             patches {:.0} %); {remedy}",
            100.0 * error.total,
            100.0 * error.noise,
            100.0 * error.refinement
        )
    })
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
}
