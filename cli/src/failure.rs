//! How a command ends badly: one message, one exit code.

use std::error::Error;
use std::fmt;
use std::process::ExitCode;

use hemicube::progress::{Cancelled, is_cancelled};

/// Why a command ended without its result.
#[derive(Debug)]
pub enum Failure {
    /// Exit code 1: it failed, or did not converge.
    Failed(String),
    /// Exit code 2: bad input or usage.
    Input(String),
    /// Exit code 130: the user cancelled.
    Cancelled,
}

impl Failure {
    /// The exit code.
    pub fn code(&self) -> ExitCode {
        ExitCode::from(match self {
            Self::Failed(_) => 1,
            Self::Input(_) => 2,
            Self::Cancelled => 130,
        })
    }

    /// Bad input or usage.
    pub fn input(error: impl fmt::Display) -> Self {
        Self::Input(error.to_string())
    }

    /// A failure.
    pub fn failed(error: impl fmt::Display) -> Self {
        Self::Failed(error.to_string())
    }

    /// What an error of the library means: cancelled, or what `otherwise` makes of it.
    pub fn of<E: Error + 'static>(error: E, otherwise: impl FnOnce(E) -> Self) -> Self {
        if is_cancelled(&error) { Self::Cancelled } else { otherwise(error) }
    }
}

impl From<Cancelled> for Failure {
    fn from(_: Cancelled) -> Self {
        Self::Cancelled
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Failed(message) | Self::Input(message) => f.write_str(message),
            Self::Cancelled => f.write_str("cancelled"),
        }
    }
}
