//! Why no heat balance comes about.

use std::io;

use crate::progress::Cancelled;
use crate::units::Bytes;

/// Why no heat balance comes about. Rows and nodes are numbers of the arrays that were given.
#[derive(Debug, thiserror::Error)]
pub enum HeatError {
    /// An emissivity or absorptance is not from 0 to 1.
    #[error("{what} {value} is not from 0 to 1")]
    Share {
        /// Emissivity or absorptance.
        what: &'static str,
        /// Whose.
        row: usize,
        /// What was given.
        value: f64,
    },
    /// A temperature is negative or not finite.
    #[error("a temperature of {0} K is not 0 K or more")]
    Temperature(f64),
    /// A heat or an irradiance is not finite.
    #[error("{0} is no heat or irradiance")]
    Flux(f64),
    /// Heat is supplied to a node whose sides neither emit nor absorb.
    #[error("heat is supplied to what has an emissivity of 0: nothing takes it away")]
    White {
        /// The node.
        node: usize,
    },
    /// Heat is supplied to surfaces that exchange with nothing of a known temperature.
    #[error(
        "no temperature settles: {supplied:.3e} W are supplied to surfaces that see neither the \
         environment nor anything of a given temperature"
    )]
    Unbounded {
        /// One of these surfaces.
        row: usize,
        /// W.
        supplied: f64,
    },
    /// What leaves the model goes to an environment whose temperature is not given.
    #[error(
        "{:.1} % of what the surfaces send out leaves the model, and the temperature of what \
         surrounds it is not known", 100.0 * share
    )]
    Open {
        /// The share of what all surfaces send out, 0..1.
        share: f64,
    },
    /// More heat is taken away than arrives: something would be colder than 0 K. Named is where
    /// most is taken.
    #[error(
        "more heat is taken away than arrives, {:.3e} W: no temperature is low enough", -supplied
    )]
    BelowZero {
        /// One of its rows.
        row: usize,
        /// Heat that is supplied to its node, sunlight included, W; negative.
        supplied: f64,
    },
    /// It does not fit in memory.
    #[error("{what} take {}; {} are allowed", Bytes(*needed), Bytes(*allowed))]
    Memory {
        /// What does not.
        what: &'static str,
        /// Bytes.
        needed: u64,
        /// Bytes.
        allowed: u64,
    },
    /// The iteration does not come to an end.
    #[error(
        "the balance is not reached after {iterations} iterations (residual {residual:.1e}): what \
         has a temperature hardly exchanges with the rest"
    )]
    Stalled {
        /// How many.
        iterations: u32,
        /// Of the equations, relative.
        residual: f64,
    },
    /// The dense equations have no solution in double precision.
    #[error("Gebhart factors cannot be found: some surfaces absorb next to nothing")]
    Singular,
    /// A row cannot be read.
    #[error("a row of the matrix cannot be read ({0})")]
    Row(#[from] io::Error),
    /// The caller cancelled.
    #[error("cancelled")]
    Cancelled(#[from] Cancelled),
}
