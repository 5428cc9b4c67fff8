//! What a case costs, and an end to those that cost too much.

use std::fs;
use std::path::Path;
use std::sync::Mutex;
use std::thread;
use std::time::{Duration, Instant};

/// A case may take no longer, and no more memory.
pub const MOST_SECONDS: f64 = 10.0;
pub const MOST_BYTES: u64 = 2_000_000_000;

/// One that does not end by then is ended, with the program.
const HUNG: Duration = Duration::from_secs(60);
const SWOLLEN: u64 = 6_000_000_000;

/// Ends the program with this.
pub const ENDED: i32 = 3;

/// When the case under way began.
static STARTED: Mutex<Option<Instant>> = Mutex::new(None);

/// Time and memory of a case.
#[derive(Debug, Default, Clone, Copy)]
pub struct Cost {
    pub seconds: f64,
    /// The most that was resident; none where the system does not say.
    pub bytes: Option<u64>,
}

/// Watches over all cases.
pub fn watch() {
    thread::spawn(|| {
        loop {
            thread::sleep(Duration::from_millis(100));
            let started = STARTED.lock().ok().and_then(|s| *s);
            let hung = started.is_some_and(|s| s.elapsed() > HUNG);
            if hung || resident("VmRSS:").is_some_and(|bytes| bytes > SWOLLEN) {
                std::process::exit(ENDED);
            }
        }
    });
}

/// Measures what `work` costs.
pub fn measured<T>(work: impl FnOnce() -> T) -> (T, Cost) {
    // The most that was resident counts from here on (proc_pid_clear_refs(5)).
    let counted = fs::write("/proc/self/clear_refs", "5").is_ok();
    let (start, worked) = (Instant::now(), processor_seconds());
    note(Some(start));
    let found = work();
    let elapsed = start.elapsed().as_secs_f64();
    note(None);
    // Where other programs are busy, a case waits for them; with several threads it works longer
    // than it takes.
    let worked = worked.zip(processor_seconds()).map(|(before, after)| after - before);
    let seconds = worked.map_or(elapsed, |worked| worked.min(elapsed));
    (found, Cost { seconds, bytes: resident("VmHWM:").filter(|_| counted) })
}

fn note(start: Option<Instant>) {
    if let Ok(mut started) = STARTED.lock() {
        *started = start;
    }
}

/// Processor time of this program so far, where the system tells.
fn processor_seconds() -> Option<f64> {
    /// Linux counts a hundred to the second for programs (proc_pid_stat(5)).
    const TICK: f64 = 0.01;
    let stat = fs::read_to_string("/proc/self/stat").ok()?;
    // Names may have blanks in them.
    let fields: Vec<&str> = stat.rsplit_once(')')?.1.split_whitespace().collect();
    let ticks = |at: usize| fields.get(at)?.parse::<f64>().ok();
    Some(TICK * (ticks(11)? + ticks(12)?))
}

/// A quantity of memory of this program, in bytes.
fn resident(what: &str) -> Option<u64> {
    let status = fs::read_to_string(Path::new("/proc/self/status")).ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix(what))?;
    line.trim().strip_suffix(" kB")?.parse::<u64>().ok().map(|kib| 1024 * kib)
}
