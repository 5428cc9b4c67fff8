//! Tries every input that is read with mutants of inputs that are sound, and says what came of it.
//!
//! `cargo run --release --example fuzz -- SECONDS` prints counts by kind of input and a verdict. It
//! fails if anything panicked, if light or form factors were no finite numbers, or if a case took
//! more than 10 s or 2 GB. Case n of a kind follows from n and the seed alone.
//!
//! `--seed S` makes other mutants; `--kind KIND` tries one kind alone; `--case KIND:NUMBER` repeats
//! a case; `--keep FOLDER` keeps the inputs that were too much; `--corpus FOLDER` adds files to
//! start from. The work is done by a second process, so that a case that ends it is named too.

#![allow(clippy::print_stdout, reason = "a program that reports")]

mod after;
mod corpus;
mod kinds;
mod meter;
mod mutate;
mod numbers;
mod options;
mod random;
mod read;
mod shared;
mod tally;

use std::error::Error;
use std::fs;
use std::panic::{self, AssertUnwindSafe};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};
use std::sync::Mutex;
use std::time::Instant;

use corpus::{Input, of_folder};
use kinds::{KINDS, Kind};
use meter::measured;
use mutate::mutate;
use options::Options;
use random::Random;
use tally::Tally;

type Failure = Box<dyn Error>;

fn main() -> Result<ExitCode, Failure> {
    let options = Options::of(std::env::args().skip(1))?;
    let sound = match &options.inside {
        Some(folder) => work(&options, folder)?,
        None => watched(&options)?,
    };
    Ok(if sound { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// Does the work in another process, and says at which case that was if it ends too early.
fn watched(options: &Options) -> Result<bool, Failure> {
    let folder = tempfile::tempdir()?;
    let mut again = Command::new(std::env::current_exe()?);
    let status =
        again.args(std::env::args().skip(1)).arg("--inside").arg(folder.path()).status()?;
    let case = fs::read_to_string(folder.path().join(CASE)).unwrap_or_default();
    if case.is_empty() {
        return Ok(status.success());
    }
    let why = match status.code() {
        Some(meter::ENDED) => "it did not come to an end".into(),
        _ => status.to_string(),
    };
    if let Some(keep) = &options.keep {
        let names = fs::read_dir(folder.path().join(INPUT))?.map(|e| Ok(e?.path()));
        let kept = keep.join(case.replace(':', "-"));
        fs::create_dir_all(&kept)?;
        for path in names.collect::<std::io::Result<Vec<PathBuf>>>()? {
            fs::copy(&path, kept.join(path.file_name().unwrap_or_default()))?;
        }
    }
    println!("verdict: ended by --case {case} --seed {} ({why})", options.seed);
    Ok(false)
}

/// Within the folder of a run: the case under way, and its files.
const CASE: &str = "case";
const INPUT: &str = "input";

/// What the last panic said, and where.
static PANIC: Mutex<String> = Mutex::new(String::new());

fn work(options: &Options, folder: &Path) -> Result<bool, Failure> {
    let mut all = Vec::new();
    for kind in KINDS.iter().filter(|k| options.wants(k.name)) {
        let mut inputs = (kind.sound)()?;
        if let Some(folder) = &options.corpus {
            inputs.extend(of_folder(folder, kind.endings)?);
        }
        // Each is read as it is before any is changed.
        for input in &inputs {
            let name = &input.files[0].0;
            (kind.read)(&input.write(&folder.join(INPUT))?).or_else(|e| {
                if options.corpus.is_some() { Ok(()) } else { Err(format!("{name}: {e}")) }
            })?;
        }
        all.push((kind, inputs));
    }
    panic::set_hook(Box::new(|info| {
        if let Ok(mut said) = PANIC.lock() {
            *said = info.to_string().replace('\n', " ");
        }
    }));
    meter::watch();
    let start = Instant::now();
    let mut tallies: Vec<(&str, Tally)> =
        all.iter().map(|(kind, _)| (kind.name, Tally::default())).collect();
    loop {
        // Kinds get the same time, not the same number of cases.
        let least = |&k: &usize| tallies[k].1.seconds;
        let Some(k) = (0..all.len()).min_by(|a, b| least(a).total_cmp(&least(b))) else {
            return Err("no such kind of input".into());
        };
        let (kind, inputs) = &all[k];
        let tally = &mut tallies[k].1;
        let number = options.case.unwrap_or(tally.cases);
        let input = mutate(inputs, &mut Random::of(options.seed, kind.name, number));
        if let Some(fault) = tried(kind, number, &input, folder, tally)? {
            println!("{}:{number}: {fault}", kind.name);
            if let Some(keep) = &options.keep {
                input.write(&keep.join(format!("{}-{number}", kind.name)))?;
            }
        }
        let seconds = start.elapsed().as_secs_f64();
        if options.case.is_some() || seconds >= options.seconds {
            return Ok(tally::print(&tallies, seconds, options.seed));
        }
    }
}

/// Tries a case; yields what is wrong with it, if that is new.
fn tried(
    kind: &Kind,
    number: u64,
    input: &Input,
    folder: &Path,
    tally: &mut Tally,
) -> Result<Option<String>, Failure> {
    let path = input.write(&folder.join(INPUT))?;
    fs::write(folder.join(CASE), format!("{}:{number}", kind.name))?;
    let measure = || measured(|| panic::catch_unwind(AssertUnwindSafe(|| (kind.read)(&path))));
    let (mut found, mut cost) = measure();
    // The system may have been busy.
    if cost.seconds > meter::MOST_SECONDS {
        (found, cost) = measure();
    }
    fs::write(folder.join(CASE), "")?;
    let found = found.map_err(|_| PANIC.lock().map(|p| p.clone()).unwrap_or_default());
    Ok(tally.count(number, found, cost))
}
