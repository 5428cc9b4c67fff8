//! Which emitters are analytic, and how many shadow rays they are worth.

/// Most shadow rays from a receiver to a group of emitters.
pub const MOST_SHADOW: usize = 4096;

/// How direct light of emitting surfaces is found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DirectOptions {
    /// Which emitters are analytic. Default: those neither too near nor too large.
    pub analytic: Analytic,
    /// Shadow rays from a receiver to a group of emitters that it sees in part, 16 to
    /// [`MOST_SHADOW`]. Default 64.
    pub shadow: usize,
    /// Other seeds give other rays. Default 0.
    pub seed: u32,
}

impl Default for DirectOptions {
    fn default() -> Self {
        Self { analytic: Analytic::default(), shadow: 64, seed: 0 }
    }
}

/// Which emitters light a receiver by an analytic formula and shadow rays, and not through the rays
/// of its row.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Analytic {
    /// Those neither too near nor too large.
    #[default]
    Suitable,
    /// All.
    All,
    /// None: the rays of a row find them.
    None,
}
