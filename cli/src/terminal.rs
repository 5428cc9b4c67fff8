//! The one place that prints, and shows progress on a terminal.

use std::borrow::Cow;
use std::collections::BTreeSet;
use std::io::{self, IsTerminal, Write};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, LazyLock, Mutex};
use std::thread;
use std::time::Duration;

use hemicube::progress::{Cancelled, Progress};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;

/// Says something to the user, on stderr. Nothing happens if nobody listens.
pub fn say(message: &str) {
    let _ = writeln!(io::stderr(), "{}", harmless(message));
}

/// Prints a result on stdout, for people.
pub fn print(text: &str) {
    print_data(&harmless(text));
}

/// Prints a result on stdout as it is. Nothing happens if nobody listens; other errors are kept
/// for [`finish_printing`].
pub fn print_data(text: &str) {
    keep(writeln!(io::stdout(), "{text}"));
}

/// What went wrong with stdout, if anything did.
pub fn finish_printing() -> io::Result<()> {
    keep(io::stdout().flush());
    UNPRINTED.lock().map_or(Ok(()), |mut error| error.take().map_or(Ok(()), Err))
}

static UNPRINTED: Mutex<Option<io::Error>> = Mutex::new(None);

fn keep(printed: io::Result<()>) {
    if let (Err(error), Ok(mut kept)) = (printed, UNPRINTED.lock())
        && error.kind() != io::ErrorKind::BrokenPipe
    {
        kept.get_or_insert(error);
    }
}

/// A text in which names from files cannot command the terminal.
fn harmless(text: &str) -> Cow<'_, str> {
    let harms = |c: char| c.is_control() && c != '\n' && c != '\t';
    if !text.contains(harms) {
        return text.into();
    }
    let shown = |c: char| if harms(c) { c.escape_default().to_string() } else { c.to_string() };
    text.chars().map(shown).collect::<String>().into()
}

static INTERRUPTED: LazyLock<Arc<AtomicBool>> = LazyLock::new(Arc::default);

/// Whether work has heard that it is to stop.
static HEARD: AtomicBool = AtomicBool::new(false);

/// The exit code of a program that was told to end.
const CANCELLED: i32 = 130;

/// From now on Ctrl-C, and being asked to end, stop the work in an orderly way, or soon where no
/// work hears of it. For commands that have no file open while they work.
pub fn catch_interrupts() {
    hear_interrupts();
    let _ = thread::Builder::new().name("interrupts".into()).spawn(end_unheard);
}

/// From now on Ctrl-C, and being asked to end, stop the work in an orderly way; the second time, at
/// once.
pub fn hear_interrupts() {
    for signal in [SIGINT, SIGTERM] {
        // Without a handler a signal ends the process at once; the next run cleans up.
        let _ = flag::register_conditional_shutdown(signal, CANCELLED, Arc::clone(&INTERRUPTED));
        let _ = flag::register(signal, Arc::clone(&INTERRUPTED));
    }
}

/// Ends the program soon after it was told to stop, unless work hears of it.
fn end_unheard() {
    const LOOK: Duration = Duration::from_millis(50);
    const PATIENCE: Duration = Duration::from_millis(300);
    while !INTERRUPTED.load(Ordering::Relaxed) {
        thread::sleep(LOOK);
    }
    thread::sleep(PATIENCE);
    if !HEARD.load(Ordering::Relaxed) {
        say("error: cancelled");
        std::process::exit(CANCELLED);
    }
}

/// From now on a file that outgrows its limit is an error of writing, and not the end.
pub fn catch_file_limit() {
    #[cfg(unix)]
    let _ = flag::register(signal_hook::consts::SIGXFSZ, Arc::default());
}

/// A bar with the time left, on a terminal; silent in a pipe.
pub struct Bar {
    bar: Mutex<ProgressBar>,
    visible: bool,
    quiet: bool,
    warned: Mutex<BTreeSet<String>>,
}

impl Bar {
    /// `quiet` shows nothing even on a terminal.
    pub fn new(quiet: bool) -> Self {
        let visible = !quiet && io::stderr().is_terminal();
        let bar = Mutex::new(ProgressBar::hidden());
        Self { bar, visible, quiet, warned: Mutex::default() }
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
        if INTERRUPTED.load(Ordering::Relaxed) {
            HEARD.store(true, Ordering::Relaxed);
            return Err(Cancelled);
        }
        Ok(())
    }

    /// Says it once.
    fn warn(&self, message: &str) {
        let new = self.warned.lock().is_ok_and(|mut warned| warned.insert(message.to_owned()));
        if new && !self.quiet {
            let warn = || say(&format!("warning: {message}"));
            self.bar.lock().map_or_else(|_| warn(), |bar| bar.suspend(warn));
        }
    }
}
