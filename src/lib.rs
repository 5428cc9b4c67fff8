//! Radiosity: the energy-conserving exchange of diffuse light between surfaces.
//!
//! **scene → patches → form factors → irradiance → picture**
//!
//! ```text
//! H = D + F (ρ H)        irradiance; D is what arrives straight from emitters
//! B = E + ρ H            radiosity, derived where needed, never stored
//! ```
//!
//! | you want | you call |
//! |---|---|
//! | a scene from a file | [`Scene::load`] |
//! | a built-in scene | [`Scene::builtin`] |
//! | a scene from arrays | [`Scene::from_arrays`], [`scene::SceneBuilder`] |
//! | its light | [`Scene::light`] with [`LightOptions`] |
//! | a picture | [`LitScene::look`] with a [`View`], [`Picture::save`] |
//! | irradiance at points (lux) | [`LitScene::probe`] |
//! | form factors (view factors) | [`Scene::form_factors`] with [`MatrixOptions`] |
//! | them in a file | [`Matrix::save`] |
//! | temperatures and net heat fluxes | [`heat::balance`] |
//! | one stage, or an engine of your choice | the modules below |
//!
//! # A picture
//!
//! ```
//! use hemicube::{LightOptions, Scene, Silent, View};
//!
//! let scene = Scene::builtin("cornell-box")?;
//! # let folder = tempfile::tempdir()?;
//! # std::env::set_current_dir(&folder)?;
//! let lit = scene.light(&LightOptions::default(), &Silent)?;
//! let picture = lit.look(&View::of(&scene)?, &Silent)?;
//! picture.save("cornell.png")?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Lux at points
//!
//! Irradiance is in lx where emission is in cd/m², in W/m² where it is in W/(m² sr).
//!
//! ```
//! use glam::DVec3;
//! use hemicube::{GatherOptions, LightOptions, Probe, Scene, Silent};
//!
//! let scene = Scene::builtin("room")?;
//! let lit = scene.light(&LightOptions::default(), &Silent)?;
//! let desk = Probe { point: DVec3::new(2.0, 0.75, 1.0), normal: DVec3::Y };
//! let found = lit.probe(&[desk], GatherOptions::default(), &Silent)?;
//! println!("{} ± {}", found[0].irradiance, found[0].error);
//! # assert!(found[0].irradiance.min_element() > 0.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # The matrix of an enclosure, closed
//!
//! ```
//! use hemicube::{MatrixOptions, Scene, Silent};
//!
//! # let folder = tempfile::tempdir()?;
//! # std::env::set_current_dir(&folder)?;
//! let scene = Scene::builtin("furnace")?;
//! let options = MatrixOptions { enclosure: true, ..MatrixOptions::default() };
//! let matrix = scene.form_factors(&options, &Silent)?;
//! matrix.save("F.npz", &scene.geometry, &Silent)?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # What holds everywhere
//!
//! Lengths are metres, angles radians. Long work takes a [`Progress`] that hears how far it is and
//! may stop it; errors tell by [`is_cancelled`]. Errors say what is wrong and by how much. Results
//! are the same to the bit for any number of threads and any set of instructions.
//!
//! The modules come in the order light travels; each uses only those above it.

pub mod units;
pub mod progress;
pub mod ranks;
pub mod simd;
pub mod scene;
pub mod patches;
pub mod visibility;
pub mod staging;
pub mod form_factors;
pub mod engines;
pub mod direct;
pub mod solve;
pub mod refine;
pub mod reconstruct;
pub mod report;
pub mod solution;
pub mod uncertainty;
pub mod store;
pub mod matrix;
pub mod heat;
pub mod gather;
pub mod render;
pub mod tone;
pub mod bake;
pub mod export;
pub mod lit_scene;

pub use gather::{Estimate, GatherOptions, Place, Probe};
pub use lit_scene::{LitScene, Shot, View};
pub use matrix::{Matrix, MatrixOptions};
pub use progress::{Progress, Silent, is_cancelled};
pub use render::Picture;
pub use scene::{Camera, Scene};
pub use solution::LightOptions;
