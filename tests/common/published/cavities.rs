//! Cavities with an open mouth: what their walls see of themselves.
//!
//! A plane mouth sees nothing but the walls, so by reciprocity and closure
//!
//! ```text
//! F = 1 - A mouth / A walls
//! ```
//!
//! whatever the cavity's shape.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};
use hemicube::scene::builtin::Mesh;

use super::{Case, Figure, area};

const MOUTH: &str = "reciprocity and closure: 1 - A mouth / A walls";

/// Corners of circles.
const ROUND: u32 = 12;

pub fn cases() -> Vec<Case> {
    let [r, h] = [0.5, 1.0];
    let cone = Mesh::cone(r, h, ROUND, 2);
    let slant = f64::hypot(r, h);
    let cylinder = Mesh::cylinder(r, h, ROUND, 2);
    vec![
        cavity("conical cavity of radius ½, depth 1", cone, DVec3::NEG_Y, 1.0 - r / slant),
        cavity(
            "cylindrical cavity of radius ½, depth 1",
            cylinder,
            DVec3::Y,
            1.0 - r / (2.0 * h + r),
        ),
        cavity("hemispherical cavity", bowl(90.0), DVec3::Y, 0.5),
        cavity(
            "spherical cavity with a mouth of 60°",
            bowl(150.0),
            DVec3::Y,
            1.0 - mouth_share(150.0),
        ),
        trench(),
    ]
}

/// A sphere of radius 1 up to an angle from its lowest point, closed by a plane.
fn bowl(degrees: f64) -> Mesh {
    let steps = (degrees / 30.0).round() as u32;
    let at = |k: u32| {
        let (sin, cos) = (degrees.to_radians() * f64::from(k) / f64::from(steps)).sin_cos();
        DVec2::new(if k == 0 { 0.0 } else { sin }, -cos)
    };
    let mut profile: Vec<DVec2> = (0..=steps).map(at).collect();
    profile.push(DVec2::new(0.0, profile[steps as usize].y));
    Mesh::lathe(&profile, ROUND)
}

/// Area of the mouth of a bowl of radius 1 over that of its wall.
fn mouth_share(degrees: f64) -> f64 {
    let (sin, cos) = degrees.to_radians().sin_cos();
    PI * sin * sin / (2.0 * PI * (1.0 - cos))
}

/// A body seen from inside, without the face that lies farthest in `mouth`.
fn cavity(name: &'static str, body: Mesh, mouth: DVec3, curved: f64) -> Case {
    let all = area(&body);
    let walls = body.open_towards(mouth).inverted();
    let exact = 1.0 - (all - area(&walls)) / area(&walls);
    let case = Case::pair(name, MOUTH, vec![walls], exact);
    Case { figures: vec![Figure::of_curved("", 0, 0, exact, curved)], patch_size: 0.1, ..case }
}

/// A trench whose floor is a ridge: its walls hide each other.
fn trench() -> Case {
    let section =
        [[-1.0, 1.0], [-0.6, 0.0], [-0.2, 0.0], [0.0, 0.7], [0.2, 0.0], [0.6, 0.0], [1.0, 1.0]];
    let depth = 2.0;
    let mut vertices = Vec::new();
    for z in [0.0, depth] {
        vertices.extend(section.map(|[x, y]| DVec3::new(x, y, z)));
    }
    let quads: Vec<[u32; 4]> = (0..6).map(|k| [k, k + 7, k + 8, k + 1]).collect();
    let mut walls = Mesh::from_quads(vertices, &quads);
    // The ends, as fans that keep within the section.
    for (base, turn) in [(0_u32, false), (7, true)] {
        for [a, b, c] in [[0, 1, 2], [0, 2, 3], [0, 3, 6], [3, 4, 6], [4, 5, 6]] {
            let [b, c] = if turn { [c, b] } else { [b, c] };
            walls.triangles.push([a + base, b + base, c + base]);
        }
    }
    let mouth = 2.0 * depth;
    let exact = 1.0 - mouth / area(&walls);
    let case = Case::pair("trench with a ridge", MOUTH, vec![walls], exact);
    Case { figures: vec![Figure::new("", 0, 0, exact)], obstructed: true, patch_size: 0.1, ..case }
}
