//! The flags of all long work.

use std::path::PathBuf;

use clap::Args;

use super::values::{bytes, threads};

/// What work may take, and what it says.
#[derive(Debug, Clone, Args)]
pub struct Run {
    /// Memory that the work may take, like 800M or 4G [default: what is free]
    #[arg(long, value_name = "SIZE", value_parser = bytes, hide_short_help = true)]
    pub memory: Option<u64>,

    /// Number of threads [default: one a core]
    #[arg(
        short = 'j', long, value_name = "N", default_value_t = 0, hide_default_value = true,
        value_parser = threads
    )]
    pub threads: usize,

    /// Write what happened, with timings, as JSON
    #[arg(long, value_name = "FILE", hide_short_help = true)]
    pub report: Option<PathBuf>,

    /// Say nothing but errors
    #[arg(short, long, conflicts_with = "verbose")]
    pub quiet: bool,

    /// Say how long each stage took, and more of where light or form factors went
    #[arg(short, long)]
    pub verbose: bool,
}
