//! The control values of a View3D file: what is to be computed, and how it is written.

use crate::scene::lines::number;
use crate::scene::shortened::shortened;
use crate::scene::source::{ImportError, Place, Source};
use crate::scene::{SceneBuilder, Severity};

/// How View3D writes its result.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum OutputFormat {
    /// `out=0`: a dense table as text, with areas and emittances.
    #[default]
    Text,
    /// `out=1`: the same in single precision.
    Binary,
    /// `out=2`: a list of rows, columns and factors (of the fork that uDALES keeps).
    Sparse,
}

/// What the `C` lines of a View3D file ask for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Control {
    /// The convergence criterion of View3D's integration, if the file gives one.
    pub eps: Option<f64>,
    /// How much is listed; 0: nothing.
    pub list: u32,
    /// How the result is written.
    pub out: OutputFormat,
    /// Whether the surfaces form an enclosure, whose rows sum to 1.
    pub enclosure: bool,
    /// Whether reflection between grey surfaces is part of the factors.
    pub emittances: bool,
    /// The only surface that factors are wanted of, from 0.
    pub row: Option<usize>,
    /// The only surface that factors are wanted to, from 0; never without `row`.
    pub col: Option<usize>,
    /// Surfaces whose centroids are farther apart exchange nothing, in the file's unit.
    pub max_distance: f64,
}

impl Default for Control {
    fn default() -> Self {
        Self {
            eps: None,
            list: 0,
            out: OutputFormat::Text,
            enclosure: false,
            emittances: false,
            row: None,
            col: None,
            max_distance: f64::INFINITY,
        }
    }
}

/// What to do about a word that has no sense.
const REMEDY: &str = "write it like `C encl=1 out=0`";

impl Control {
    /// Takes the words of a `C` line in. Words that nobody knows are named and passed over.
    pub(super) fn take(
        &mut self,
        source: &Source<'_>,
        line: usize,
        text: &str,
        builder: &mut SceneBuilder,
    ) -> Result<(), ImportError> {
        let parting = |c: char| c.is_ascii_whitespace() || c == '=' || c == ',';
        let mut words = text.split(parting).filter(|word| !word.is_empty()).peekable();
        while let Some(word) = words.next() {
            let name = word.to_ascii_lowercase();
            if !KNOWN.contains(&name.as_str()) {
                builder.finding(
                    Severity::Warning,
                    format!("line {line}"),
                    format!("nobody knows the control word `{}`", shortened(word)),
                    format!("the words are {}", KNOWN.join(", ")),
                );
                words.next_if(|value| value.parse::<f64>().is_ok());
                continue;
            }
            let wrong = |problem: String| Err(source.malformed(Place::Line(line), problem, REMEDY));
            let Some(value) = words.next() else {
                return wrong(format!("`{word}` has no value"));
            };
            let float = || number(source, line, value);
            if name == "eps" || name == "maxd" {
                let x = float()?;
                if x <= 0.0 {
                    return wrong(format!("`{word}` is to be more than 0, not {value}"));
                }
                if name == "eps" {
                    self.eps = Some(x)
                } else {
                    self.max_distance = x
                }
                continue;
            }
            let Ok(n) = value.parse::<i32>() else {
                return wrong(format!(
                    "`{word}` is to be a whole number, not {}",
                    shortened(value)
                ));
            };
            let surface = (n > 0).then(|| n as usize - 1);
            match name.as_str() {
                "list" => self.list = n.max(0) as u32,
                "out" => match n {
                    0 => self.out = OutputFormat::Text,
                    1 => self.out = OutputFormat::Binary,
                    2 => self.out = OutputFormat::Sparse,
                    _ => return wrong(format!("`out` is to be 0, 1 or 2, not {n}")),
                },
                "encl" => self.enclosure |= n != 0,
                "emit" => self.emittances |= n != 0,
                "row" => self.row = surface,
                "col" => self.col = surface,
                // Recursions and buffers of View3D's own integration.
                _ => {}
            }
        }
        if self.col.is_some() && self.row.is_none() {
            let problem = "has a `col` without a `row` before it";
            return Err(source.malformed(Place::Line(line), problem, "give the `row` too"));
        }
        Ok(())
    }
}

/// The words that View3D knows.
const KNOWN: &[&str] = &[
    "eps", "list", "out", "encl", "emit", "row", "col", "maxd", "maxu", "maxo", "mino", "prjd",
    "maxv",
];
