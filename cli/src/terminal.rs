//! The one place that prints, and shows progress on a terminal.

use std::io::{IsTerminal, Write};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

use hemicube::progress::{Cancelled, Progress};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Says something to the user, on stderr. Nothing happens if nobody listens.
pub fn say(message: &str) {
    let _ = writeln!(std::io::stderr(), "{message}");
}

/// Prints a result on stdout. Nothing happens if nobody listens.
pub fn print(text: &str) {
    let _ = writeln!(std::io::stdout(), "{text}");
}

static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// From now on Ctrl-C stops the work in an orderly way.
pub fn catch_interrupts() {
    // Without a handler Ctrl-C ends the process at once, which leaves nothing half-written either.
    let _ = ctrlc::set_handler(|| INTERRUPTED.store(true, Ordering::Relaxed));
}

/// A bar with the time left, on a terminal; silent in a pipe.
pub struct Bar {
    bar: Mutex<ProgressBar>,
    visible: bool,
}

impl Bar {
    /// `quiet` shows nothing even on a terminal.
    pub fn new(quiet: bool) -> Self {
        let visible = !quiet && std::io::stderr().is_terminal();
        Self { bar: Mutex::new(ProgressBar::hidden()), visible }
    }

    /// Takes the bar away.
    pub fn finish(&self) {
        if let Ok(bar) = self.bar.lock() {
            bar.finish_and_clear();
        }
    }
}

impl Progress for Bar {
    fn stage(&self, name: &str, total: u64) {
        let target =
            if self.visible { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() };
        let (bar, template) = if total > 0 {
            let bar = ProgressBar::with_draw_target(Some(total), target);
            (bar, "{msg:14} {bar:32} {percent:>3} %  {eta} left")
        } else {
            (ProgressBar::with_draw_target(None, target), "{msg:14} {spinner} {pos}")
        };
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style);
        }
        bar.set_message(name.to_owned());
        if let Ok(mut current) = self.bar.lock() {
            current.finish_and_clear();
            *current = bar;
        }
    }

    fn advance(&self, n: u64) -> Result<(), Cancelled> {
        if let Ok(bar) = self.bar.lock() {
            bar.inc(n);
        }
        if INTERRUPTED.load(Ordering::Relaxed) { Err(Cancelled) } else { Ok(()) }
    }
}
