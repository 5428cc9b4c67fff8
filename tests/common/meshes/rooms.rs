//! Rooms with bodies in them.

use glam::{DAffine3, DMat3, DVec3, dvec3};
use hemicube::scene::builtin::Mesh;

use super::super::random::Random;
use super::{boxed, resting, square_for};

/// What all rooms measure, m. They stand on y = 0, about the axis y.
const ROOM: DVec3 = dvec3(4.0, 2.5, 3.0);

/// The room itself.
fn walls(square: f64) -> Mesh {
    boxed(ROOM, square).at(0.0, 0.5 * ROOM.y, 0.0).inverted()
}

/// A point at least `clear` metres from all walls.
fn somewhere(random: &mut Random, clear: f64) -> DVec3 {
    let half = dvec3(0.5 * ROOM.x, 0.0, 0.5 * ROOM.z) - dvec3(clear, -clear, clear);
    random.inside(dvec3(-half.x, clear, -half.z), dvec3(half.x, ROOM.y - clear, half.z))
}

/// A room with `boxes` boxes that float in it, of about `n` triangles.
pub fn room_with_boxes(n: usize, boxes: usize, seed: u64) -> Mesh {
    let mut random = Random::new(seed);
    let square = square_for(59.0 + 3.0 * boxes as f64, n);
    let mut parts = vec![walls(square)];
    for _ in 0..boxes {
        let size = random.inside(DVec3::splat(0.4), DVec3::splat(1.0));
        let place = somewhere(&mut random, 0.9);
        let body = boxed(size, square);
        let turn = DAffine3::from_mat3(random.rotation());
        parts.push(body.placed(turn).at(place.x, place.y, place.z));
    }
    Mesh::joined(parts)
}

/// A room with three spheres that do not touch, of about `n` triangles.
pub fn spheres_in_room(n: usize) -> Mesh {
    let square = square_for(59.0, n / 2);
    let frequency = (n as f64 / 120.0).sqrt().round().max(1.0) as u32;
    let sphere = |radius: f64| Mesh::geodesic(radius, frequency);
    Mesh::joined([
        walls(square),
        sphere(0.6).at(-1.1, 0.9, 0.3),
        sphere(0.5).at(0.2, 1.6, -0.4),
        sphere(0.4).at(1.2, 0.7, 0.5),
    ])
}

/// A ball in an open chest with walls of 4 cm, in a room; of about `n` triangles.
pub fn nested(n: usize) -> Mesh {
    const THICK: f64 = 0.04;
    let square = square_for(72.0, n);
    let slab = |size: DVec3, at: DVec3| boxed(size, square).at(at.x, at.y, at.z);
    let (side, half) = (dvec3(THICK, 0.8, 1.0), 0.5 * THICK);
    let end = dvec3(1.0 + 2.0 * THICK, 0.8, THICK);
    let chest = Mesh::joined([
        slab(dvec3(1.0, THICK, 1.0), dvec3(0.0, half, 0.0)),
        slab(side, dvec3(-0.5 - half, 0.4, 0.0)),
        slab(side, dvec3(0.5 + half, 0.4, 0.0)),
        slab(end, dvec3(0.0, 0.4, -0.5 - half)),
        slab(end, dvec3(0.0, 0.4, 0.5 + half)),
        Mesh::geodesic(0.25, (n as f64 / 300.0).sqrt().round().max(1.0) as u32).at(0.1, 0.4, 0.0),
    ]);
    let turn = DMat3::from_rotation_y(0.5) * DMat3::from_rotation_z(0.2);
    Mesh::joined([walls(square), resting(chest, turn, dvec3(0.3, 0.3, -0.2))])
}

/// A room with a hollow box in it, and a ball in that: nobody sees from one to the other. Returns
/// the number of triangles outside too, which come first; of about `n` triangles.
pub fn sealed(n: usize) -> (Mesh, usize) {
    let square = square_for(75.0, n);
    let outer = boxed(DVec3::splat(1.2), square);
    let inner = boxed(DVec3::splat(1.16), square).inverted();
    let ball = Mesh::geodesic(0.4, (n as f64 / 300.0).sqrt().round().max(1.0) as u32);
    let place = |mesh: Mesh| {
        let turn = DMat3::from_rotation_y(0.4) * DMat3::from_rotation_x(0.3);
        mesh.placed(DAffine3::from_mat3(turn)).at(0.3, 1.2, 0.1)
    };
    let outside = Mesh::joined([walls(square), place(outer)]);
    let count = outside.triangles.len();
    (Mesh::joined([outside, place(inner), place(ball)]), count)
}

/// A room with a box that stands on another, each with corners beyond the other's; of about `n`
/// triangles, at least 34.
pub fn stacked(n: usize) -> Mesh {
    let square = square_for(64.0, n);
    let lower = boxed(dvec3(0.8, 0.7, 0.8), square).resting_on(0.0);
    let upper = boxed(dvec3(0.75, 0.5, 0.83), square).resting_on(0.7);
    Mesh::joined([
        walls(square),
        lower.open_towards(DVec3::NEG_Y).turned(5.0).at(-1.05, 0.0, -0.16),
        upper.turned(12.0).at(-0.95, 0.0, -0.21),
    ])
}

/// A room with plates, a box and a ball a tenth of a millimetre apart, and the box as far from a
/// wall; of about `n` triangles.
pub fn gaps(n: usize) -> Mesh {
    const GAP: f64 = 1e-4;
    let square = square_for(71.0, n);
    let plate = dvec3(1.2, 0.1, 0.8);
    let first = 0.8;
    let second = first + plate.y + GAP;
    let ball = 0.3;
    let cube = DVec3::splat(0.6);
    Mesh::joined([
        walls(square),
        boxed(plate, square).at(0.2, first, 0.1),
        boxed(plate, square).at(0.3, second, 0.0),
        Mesh::geodesic(ball, (n as f64 / 300.0).sqrt().round().max(1.0) as u32)
            .resting_on(second + 0.5 * plate.y + GAP)
            .at(0.3, 0.0, 0.0),
        boxed(cube, square).at(0.5 * (cube.x - ROOM.x) + GAP, 1.0, -0.3),
    ])
}

/// A body of few large faces about the origin, in a ball of .87 m.
fn body(random: &mut Random) -> Mesh {
    let size = random.inside(DVec3::splat(0.4), DVec3::splat(1.0));
    let sides = 3 + random.below(5) as u32;
    let body = match random.below(4) {
        0 | 1 => Mesh::cuboid(size, [1; 3]),
        2 => Mesh::cone(0.5 * size.x, size.y, sides, 1),
        _ => Mesh::cylinder(0.5 * size.x, size.y, sides, 1),
    };
    body.at(0.0, -0.5 * size.y, 0.0)
}

/// A room of some `faces` large faces, 20 to 200, most of them of bodies that stand, float, lie on
/// one another and pass through one another.
pub fn large_faces(faces: usize, seed: u64) -> Mesh {
    let mut random = Random::new(seed);
    let mut parts = vec![walls(10.0)];
    let mut count = parts[0].triangles.len();
    // Where the last body that stands has its middle, and its top.
    let mut last: Option<(DVec3, f64)> = None;
    while count < faces {
        let body = body(&mut random);
        let place = somewhere(&mut random, 0.9);
        let upright = DMat3::from_rotation_y(random.between(0.0, 6.0));
        let part = match (random.below(4), last) {
            // On top of another, exactly.
            (0, Some((below, top))) if top < 1.5 => {
                let at = dvec3(below.x + 0.1, top, below.z - 0.05);
                last = None;
                resting(body, upright, at)
            }
            // Through another.
            (1, Some((below, top))) => {
                let turn = DAffine3::from_mat3(random.rotation());
                body.placed(turn).at(below.x, 0.7 * top + 0.15, below.z)
            }
            // Anywhere.
            (2, _) => {
                let turn = DAffine3::from_mat3(random.rotation());
                body.placed(turn).at(place.x, place.y, place.z)
            }
            // On the floor, without the face that nobody sees.
            _ => {
                let top = 2.0 * body.vertices.iter().map(|v| v.y).fold(0.0, f64::max);
                last = Some((place, top));
                resting(body.open_towards(DVec3::NEG_Y), upright, dvec3(place.x, 0.0, place.z))
            }
        };
        count += part.triangles.len();
        parts.push(part);
    }
    Mesh::joined(parts)
}
