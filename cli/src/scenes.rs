//! `hemicube scenes`: what is built in.

use hemicube::scene::builtin;

use crate::failure::Failure;
use crate::terminal::print;

/// Lists the built-in scenes.
pub fn run() -> Result<(), Failure> {
    for b in builtin::list() {
        print(&format!("{:14} {}", b.name, b.summary));
    }
    Ok(())
}
