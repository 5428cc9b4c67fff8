//! What several tests use.

#![allow(dead_code, reason = "each test file uses a part of it")]

pub mod engines;
pub mod paths;
pub mod scenes;
