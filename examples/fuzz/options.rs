//! What the command line asks for.

use std::error::Error;
use std::path::PathBuf;

const USAGE: &str = "usage: fuzz SECONDS [--seed S] [--kind KIND] [--keep FOLDER] \
                     [--corpus FOLDER]\n       fuzz --case KIND:NUMBER [--seed S] ...";

#[derive(Default)]
pub struct Options {
    pub seconds: f64,
    pub seed: u64,
    kind: Option<String>,
    /// The number of the one case that is wanted.
    pub case: Option<u64>,
    pub keep: Option<PathBuf>,
    pub corpus: Option<PathBuf>,
    /// The folder of a run, in the process that does the work.
    pub inside: Option<PathBuf>,
}

impl Options {
    pub fn of(mut arguments: impl Iterator<Item = String>) -> Result<Self, Box<dyn Error>> {
        let mut options = Self::default();
        let mut asked = false;
        while let Some(argument) = arguments.next() {
            let mut value = || arguments.next().ok_or(USAGE);
            match argument.as_str() {
                "--seed" => options.seed = value()?.parse()?,
                "--kind" => options.kind = Some(value()?),
                "--case" => {
                    let text = value()?;
                    let (kind, number) = text.split_once(':').ok_or(USAGE)?;
                    options.case = Some(number.parse()?);
                    options.kind = Some(kind.into());
                    asked = true;
                }
                "--keep" => options.keep = Some(value()?.into()),
                "--corpus" => options.corpus = Some(value()?.into()),
                "--inside" => options.inside = Some(value()?.into()),
                seconds => {
                    options.seconds = seconds.parse().map_err(|_| USAGE)?;
                    asked = true;
                }
            }
        }
        if asked { Ok(options) } else { Err(USAGE.into()) }
    }

    /// Whether a kind of input is to be tried.
    pub fn wants(&self, kind: &str) -> bool {
        self.kind.as_ref().is_none_or(|wanted| wanted == kind)
    }
}
