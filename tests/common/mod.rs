//! What several tests use.

#![allow(dead_code, unused_imports, reason = "each test file uses a part of it")]

pub mod baked;
pub mod compare;
pub mod contour;
pub mod engines;
pub mod furnished;
pub mod hard;
pub mod judge;
pub mod known;
pub mod meshes;
pub mod paths;
pub mod published;
pub mod random;
pub mod reference;
pub mod scenes;
pub mod shapes;
