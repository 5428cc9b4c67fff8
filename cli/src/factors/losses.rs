//! What is said of rows that lose much: where it goes, why, and what helps.

use hemicube::matrix::{LossesReport, RowLoss};

/// Why a row loses what it loses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Cause {
    /// Most of its view are backs.
    Covered,
    /// A part of its view are backs.
    Backs,
    /// It looks away from a model that is closed for others.
    Outwards,
    /// Its form factors err.
    Error,
}

impl Cause {
    const ALL: [Self; 4] = [Self::Covered, Self::Backs, Self::Outwards, Self::Error];

    /// What most of a row's loss comes from.
    fn of(row: &RowLoss) -> Self {
        /// Of all a row sends out.
        const HALF: f64 = 0.5;
        let error = row.lost.abs();
        if row.back > HALF {
            Self::Covered
        } else if error > row.back && error > row.environment {
            Self::Error
        } else if row.environment > HALF && row.environment > row.back {
            Self::Outwards
        } else {
            Self::Backs
        }
    }

    fn text(self) -> &'static str {
        match self {
            Self::Covered => "another face covers its view",
            Self::Backs => "it sees faces from behind",
            Self::Outwards => "it looks out of the model",
            Self::Error => "its form factors err by so much",
        }
    }

    fn remedy(self) -> &'static str {
        match self {
            Self::Covered => {
                "covered rows: no harm where something stands there; else turn the covering faces \
                 round, or use --sides two"
            }
            Self::Backs => {
                "backs: no harm where something stands on a face; else turn the faces round that \
                 are seen from behind, or use --sides two, which gives backs rows of their own"
            }
            Self::Outwards => "outwards: turn such faces round, or leave them out",
            Self::Error => {
                "errors: ask for less --error or a smaller --patch-size, and compare with --engine \
                 rays"
            }
        }
    }
}

/// In per cent to one digit, without the sign of a negative zero.
fn per_cent(share: f64) -> f64 {
    (1000.0 * share).round() / 10.0 + 0.0
}

/// Where a row goes, in per cent, and why.
fn line(row: &RowLoss) -> String {
    let [back, environment, faces, lost] =
        [row.back, row.environment, row.faces, row.lost].map(per_cent);
    let of = row.backs_of.as_ref().map_or(String::new(), |name| format!(" (most of {name})"));
    format!(
        "  row {} ({}): {back:.1} % to backs{of}, {environment:.1} % to the environment, \
         {faces:.1} % to faces, {lost:.1} % lost numerically: {}",
        row.row,
        row.surface,
        Cause::of(row).text()
    )
}

/// What to say of rows that lose much, `covered` of them most of it to backs.
pub fn lines(found: &LossesReport, covered: usize, verbose: bool) -> Vec<String> {
    let LossesReport { rows, to_backs, numerically, see_hardly_any_face, worst } = found;
    let shown = &worst[..worst.len().min(if verbose { worst.len() } else { 4 })];
    let kinds = [
        (*to_backs, "lose more than 1 % to backs"),
        (covered, "are covered by another face"),
        (*see_hardly_any_face, "see hardly any face"),
        (*numerically, "lose more than 1 % numerically"),
    ];
    let kinds: Vec<String> =
        kinds.iter().filter(|k| k.0 > 0).map(|(n, what)| format!("{n} {what}")).collect();
    let which = if shown.len() < *rows { "the worst:" } else { "these:" };
    let mut lines = vec![format!("rows: {}; {which}", kinds.join(", "))];
    lines.extend(shown.iter().map(line));
    let causes: Vec<Cause> = shown.iter().map(Cause::of).collect();
    let said = Cause::ALL.iter().filter(|cause| causes.contains(cause));
    lines.extend(said.map(|cause| format!("  {}", cause.remedy())));
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row([faces, environment, back]: [f64; 3], backs_of: Option<&str>) -> RowLoss {
        let (backs_of, surface) = (backs_of.map(str::to_owned), "floor2".to_owned());
        let lost = 1.0 - faces - environment - back;
        RowLoss { row: 56, surface, faces, environment, back, lost, backs_of }
    }

    #[test]
    fn each_cause_has_its_words() {
        for (shares, cause) in [
            ([0.1, 0.03, 0.87], Cause::Covered),
            ([0.6, 0.2, 0.2], Cause::Backs),
            ([0.3, 0.65, 0.05], Cause::Outwards),
            ([0.05, 0.95, 0.0], Cause::Outwards),
            ([0.0, 0.0, 0.0], Cause::Error),
            ([0.6, 0.0, 0.0], Cause::Error),
            ([1.2, 0.0, 0.05], Cause::Error),
        ] {
            assert_eq!(Cause::of(&row(shares, None)), cause, "{shares:?}");
        }
    }

    #[test]
    fn a_row_says_where_it_goes_and_what_helps_is_said_once() {
        let covered = row([0.003, 0.127, 0.87], Some("crate"));
        let mut worst = vec![covered.clone(), covered];
        worst.extend([0; 4].map(|_| row([0.9, 0.05, 0.05], None)));
        let found = LossesReport { rows: 40, to_backs: 40, worst, ..LossesReport::default() };
        let lines = lines(&found, 2, false);
        assert_eq!(lines.len(), 1 + 4 + 2, "{lines:#?}");
        assert_eq!(
            lines[0],
            "rows: 40 lose more than 1 % to backs, 2 are covered by another face; the worst:"
        );
        assert_eq!(
            lines[1],
            "  row 56 (floor2): 87.0 % to backs (most of crate), 12.7 % to the environment, 0.3 % \
             to faces, 0.0 % lost numerically: another face covers its view"
        );
        assert!(lines[3].ends_with("it sees faces from behind"), "{}", lines[3]);
        assert!(lines[5].contains("--sides two") && lines[6].contains("--sides two"));
    }
}
