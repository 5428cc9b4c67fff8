//! What sources cannot be.

use thiserror::Error;

use crate::ranks::RanksError;

/// Why a group of sources cannot be.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum GroupError {
    /// It names what is no source.
    #[error("group {group}: the scene has no material and no lamp {name}")]
    Unknown {
        /// The group.
        group: String,
        /// What it names.
        name: String,
    },
    /// It names what another group has.
    #[error("group {group}: {name} is in another group too")]
    Twice {
        /// The group.
        group: String,
        /// What it names.
        name: String,
    },
    /// Its name means something else.
    #[error("group {0}: that is the name of something that is not in it")]
    Name(String),
    /// Something that emits nothing beside what does, or a texture without light.
    #[error("group {group}: {name} emits nothing, so its share of the group's light is not known")]
    Dark {
        /// The group.
        group: String,
        /// What it names.
        name: String,
    },
}

/// Why stored solutions do not add up to the light of a scene.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum MixError {
    /// It is another scene.
    #[error("the solution is of another scene")]
    Foreign,
    /// Something emits that did not when the scene was solved.
    #[error("{0} is not among the sources of the solution")]
    Unsolved(String),
    /// A texture no longer says where a source emits.
    #[error("{0} was solved with the texture that it emits by: it can be made brighter or darker")]
    Texture(String),
    /// A source emits in a channel in which it did not.
    #[error("{0} was solved in its own colour, which lacks a channel that it now emits in")]
    Colour(String),
    /// The members of a group have changed by different factors.
    #[error("what is in {0} was solved together, and can only change together")]
    Apart(String),
    /// Surfaces reflect otherwise.
    #[error("the solution is of other reflectances")]
    Reflectance,
    /// Processes that share its rows cannot go on.
    #[error(transparent)]
    Ranks(#[from] RanksError),
}
