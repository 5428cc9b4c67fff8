//! Irradiance on surfaces as a smooth field, from one value a patch.
//!
//! Values move from patch centres to the vertices of a conforming triangulation and are
//! interpolated linearly over it. Surfaces are smooth across an edge that exactly two triangles
//! share at a blunt angle; never across a crease, nor between surfaces that merely touch.

mod blend;
mod field;
mod fit;
mod mesh;
mod normals;
mod topology;

pub use field::Field;
pub use normals::Normals;
