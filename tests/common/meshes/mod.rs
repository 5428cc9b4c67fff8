//! The project's own meshes that are hard on form factors, each a function of its size.
//!
//! All are one-sided and face where they should: bodies outwards, rooms inwards. The same arguments
//! make the same mesh, to the bit.

mod blended;
mod bodies;
mod rooms;

pub use blended::head;
pub use bodies::{fins, honeycomb, inside_sphere, thread, torus};
pub use rooms::{gaps, large_faces, nested, room_with_boxes, sealed, spheres_in_room, stacked};

use glam::{DAffine3, DMat3, DVec3};
use hemicube::scene::builtin::Mesh;
use hemicube::scene::{Material, Scene, SidesChoice};

use super::random::Random;

/// A mesh turned by any angles, of that seed.
pub fn turned(mesh: Mesh, seed: u64) -> Mesh {
    let turn = Random::new(seed).rotation();
    mesh.placed(DAffine3::from_mat3(turn))
}

/// A mesh whose positions are those that a file of single precision keeps.
pub fn rounded(mut mesh: Mesh) -> Mesh {
    for v in &mut mesh.vertices {
        *v = v.as_vec3().as_dvec3();
    }
    mesh
}

/// A scene of a one-sided mesh.
pub fn scene_of(mesh: &Mesh) -> Scene {
    let vertices: Vec<[f64; 3]> = mesh.vertices.iter().map(|v| v.to_array()).collect();
    let mut scene =
        Scene::from_arrays(&vertices, &mesh.triangles, &[Material::default()], &[]).unwrap();
    scene.choose_sides(SidesChoice::One);
    scene
}

/// A body in a box of twelve triangles that is half as large again: what the body does not see of
/// itself ends there.
pub fn in_box(body: Mesh) -> Mesh {
    let (low, high) = body
        .vertices
        .iter()
        .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), &v| (low.min(v), high.max(v)));
    let size = 1.5 * (high - low);
    let middle = 0.5 * (low + high);
    let room = boxed(size, f64::INFINITY).at(middle.x, middle.y, middle.z).inverted();
    Mesh::joined([room, body])
}

/// A body turned by `turn` whose lowest corner rests at the height of `place`, with its middle
/// above it.
fn resting(body: Mesh, turn: DMat3, place: DVec3) -> Mesh {
    body.placed(DAffine3::from_mat3(turn)).resting_on(place.y).at(place.x, 0.0, place.z)
}

/// A box about the origin, cut into squares of about that size (m), each two triangles.
fn boxed(size: DVec3, square: f64) -> Mesh {
    let cells = size.to_array().map(|x| (x / square).round().max(1.0) as u32);
    Mesh::cuboid(size, cells).at(0.0, -0.5 * size.y, 0.0)
}

/// Size of the squares (m) that cut `area` m² into `n` triangles, two a square.
fn square_for(area: f64, n: usize) -> f64 {
    (2.0 * area / n as f64).sqrt()
}
