//! Counts of cases, and what was wrong with them.

use std::collections::BTreeMap;

use crate::kinds::Found;
use crate::meter::{Cost, MOST_BYTES, MOST_SECONDS};

/// What came of the cases of one kind.
#[derive(Default)]
pub struct Tally {
    pub cases: u64,
    pub seconds: f64,
    read: u64,
    slowest: (f64, u64),
    largest: Option<(u64, u64)>,
    /// By what was wrong: how often, and the first case.
    faults: BTreeMap<String, (u64, u64)>,
}

impl Tally {
    /// Counts a case, `Err` if it panicked; yields what was wrong if that is new.
    pub fn count(
        &mut self,
        number: u64,
        found: Result<Found, String>,
        cost: Cost,
    ) -> Option<String> {
        /// Longer messages are no help.
        const MOST_TEXT: usize = 1000;
        self.cases += 1;
        self.seconds += cost.seconds;
        if cost.seconds > self.slowest.0 {
            self.slowest = (cost.seconds, number);
        }
        if cost.bytes > self.largest.map(|l| l.0) {
            self.largest = cost.bytes.map(|bytes| (bytes, number));
        }
        let fault = match found {
            Err(panic) => Some(panic),
            Ok(Err(message)) if message.len() > MOST_TEXT => Some("a message too long".into()),
            _ if cost.seconds > MOST_SECONDS => Some("takes too long".into()),
            _ if cost.bytes > Some(MOST_BYTES) => Some("takes too much memory".into()),
            Ok(found) => {
                self.read += u64::from(found.is_ok());
                None
            }
        }?;
        let known = self.faults.entry(fault.clone()).or_insert((0, number));
        known.0 += 1;
        (known.0 == 1).then_some(fault)
    }

    pub fn faults(&self) -> u64 {
        self.faults.values().map(|f| f.0).sum()
    }
}

/// Prints all counts, and the verdict; yields whether nothing was wrong.
pub fn print(tallies: &[(&str, Tally)], seconds: f64, seed: u64) -> bool {
    println!("kind        cases     read  refused   faults  slowest s (case)  most MB (case)");
    for (kind, t) in tallies.iter().filter(|t| t.1.cases > 0) {
        let refused = t.cases - t.read - t.faults();
        let most = t.largest.map_or("not measured".into(), |(bytes, number)| {
            format!("{:.0} ({number})", bytes as f64 / 1e6)
        });
        let slowest = format!("{:.3} ({})", t.slowest.0, t.slowest.1);
        println!(
            "{kind:8} {:8} {:8} {refused:8} {:8}  {slowest:>16}  {most:>14}",
            t.cases,
            t.read,
            t.faults()
        );
    }
    for (kind, t) in tallies {
        for (fault, (times, first)) in &t.faults {
            println!("{times} x {fault}\n    --case {kind}:{first} --seed {seed}");
        }
    }
    let cases: u64 = tallies.iter().map(|t| t.1.cases).sum();
    let faults: u64 = tallies.iter().map(|t| t.1.faults()).sum();
    let verdict = if faults == 0 { "nothing wrong".into() } else { format!("{faults} faults") };
    println!("verdict: {verdict} in {cases} cases of seed {seed}, {seconds:.0} s");
    faults == 0
}
