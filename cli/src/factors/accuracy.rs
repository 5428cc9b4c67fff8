//! Whether form factors are as exact as was asked for.

use hemicube::matrix::MatrixReport;

use crate::args::Factors;
use crate::failure::Failure;
use crate::terminal::say;

/// Of a matrix that has been written: warns if it is less exact than was asked for, or fails with
/// `--strict`.
pub fn verdict(args: &Factors, report: &MatrixReport) -> Result<(), Failure> {
    let Some(text) = shortfall(report, args.parts.is_some()) else { return Ok(()) };
    if args.outcome.strict {
        let path = args.outcome.output.as_ref().map(|path| path.display().to_string());
        let (scene, written) = (args.model.scene.display(), path.as_deref().unwrap_or("the table"));
        let text = format!("{scene}: {text}; {written} is written all the same (--strict)");
        return Err(Failure::Failed(text));
    }
    if !args.run.quiet {
        say(&format!("warning: {text}"));
    }
    Ok(())
}

/// By how much the error that a matrix states exceeds the one asked for, and what would help;
/// `None` if it does not, or if its engine states none.
fn shortfall(report: &MatrixReport, in_parts: bool) -> Option<String> {
    let remedy = match in_parts {
        true => "plan it anew with a smaller --patch-size, or allow a larger --error there",
        false => {
            "use a smaller --patch-size or allow a larger --error, and compare with \
                  --engine rays"
        }
    };
    let asked = report.engine.as_ref()?.error?;
    exceeded(asked, report.pairs?.error).map(|text| format!("{text}; {remedy}"))
}

/// By how much the stated error exceeds the one asked for, if it does.
pub fn exceeded(asked: f64, stated: f64) -> Option<String> {
    // A number that is none keeps no promise.
    let kept = stated <= asked;
    (!kept).then(|| {
        format!(
            "the stated error of the form factors is {}, {:.1} times the {} asked for",
            per_cent(stated),
            stated / asked,
            per_cent(asked)
        )
    })
}

/// To three digits at most.
fn per_cent(share: f64) -> String {
    let percent = 100.0 * share;
    let digits = (2.0 - percent.abs().max(1e-9).log10().floor()).clamp(0.0, 9.0) as usize;
    let text = format!("{percent:.digits$}");
    let short = if digits > 0 { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    format!("{short} %")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_exceeds_the_error_asked_for_is_said() {
        assert_eq!(exceeded(1e-3, 1e-3), None);
        assert_eq!(exceeded(1e-3, 0.0), None);
        assert_eq!(shortfall(&MatrixReport::default(), false), None);
        let said = exceeded(1e-3, 8.42e-3).unwrap_or_default();
        for part in ["0.842 %", "8.4 times the 0.1 %"] {
            assert!(said.contains(part), "{said}");
        }
        assert!(exceeded(1e-3, f64::NAN).is_some());
    }

    #[test]
    fn per_cent_has_three_digits() {
        let all = [0.25, 1.0, 0.001, 1e-6, 0.012_345, 0.0].map(per_cent);
        assert_eq!(all, ["25 %", "100 %", "0.1 %", "0.0001 %", "1.23 %", "0 %"]);
    }
}
