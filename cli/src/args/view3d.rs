//! `hemicube view3d` on the command line.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use clap::{Args, CommandFactory, Error, FromArgMatches};

use super::Arguments;
use super::run::Run;
use super::values::percent;

pub const EXAMPLES: &str = "Examples:
  hemicube view3d room.vs3 room.out
  hemicube view3d street.vs3 street.out --error 1% --threads 8
  ln -s $(command -v hemicube) view3d; ./view3d room.vs3 room.out

Called by the name view3d or View3D, the program is this command. The control values encl, emit, out
(0, 1, 2), list, row, col, eps and maxD of the file are heard; those of View3D's own integration
are not needed. No View3D.log is written: messages go to stderr.";

/// `hemicube view3d`.
#[derive(Debug, Args)]
pub struct View3d {
    /// View3D's input: vertices and surfaces (.vs3)
    #[arg(value_name = "INPUT")]
    pub input: PathBuf,

    /// The result, in the format that the input asks for
    #[arg(value_name = "OUTPUT")]
    pub output: PathBuf,

    /// Error aimed at in per cent, like .1 or .1%: RMS of the factors' errors over their own
    /// [default: .1 for the eps of 1e-4, and in proportion to it; less for fewer than 1000
    /// triangles]
    #[arg(long, value_name = "PERCENT", value_parser = percent, allow_negative_numbers = true)]
    pub error: Option<f64>,

    /// How it is run.
    #[command(flatten)]
    pub run: Run,
}

/// The name of the command, and of the program that it stands in for.
const NAME: &str = "view3d";

/// The command alone, where the program itself is called by its name; `None` where it is not.
pub fn called_view3d(arguments: &[OsString]) -> Option<Result<View3d, Error>> {
    let stem = arguments.first().and_then(|program| Path::new(program).file_stem());
    stem.filter(|stem| stem.eq_ignore_ascii_case(NAME))?;
    let command = Arguments::command().find_subcommand(NAME)?.clone();
    let command = command.version(env!("CARGO_PKG_VERSION"));
    let matches = command.try_get_matches_from(arguments);
    Some(matches.and_then(|matches| View3d::from_arg_matches(&matches)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_name_of_the_program_is_the_command() {
        let called = |program: &str| called_view3d(&[program, "in.vs3", "out"].map(OsString::from));
        for program in ["view3d", "View3D", "/opt/bin/VIEW3D", "./view3d.exe", "View3D.EXE"] {
            let read = called(program).unwrap().unwrap();
            assert_eq!((read.input, read.output), ("in.vs3".into(), "out".into()), "{program}");
        }
        for program in ["hemicube", "/view3d/hemicube", "view3dn", ""] {
            assert!(called(program).is_none(), "{program}");
        }
        assert!(called_view3d(&[]).is_none());
    }

    #[test]
    fn its_usage_names_it_once() {
        let usage = called_view3d(&["/opt/view3d".into()]).unwrap().unwrap_err().to_string();
        assert!(usage.contains("Usage: view3d <INPUT> <OUTPUT>"), "{usage}");
        let help = ["view3d", "--help"].map(OsString::from);
        let help = called_view3d(&help).unwrap().unwrap_err().to_string();
        assert!(help.contains("Usage: view3d [OPTIONS] <INPUT> <OUTPUT>"), "{help}");
        assert!(help.contains(EXAMPLES), "{help}");
    }
}
