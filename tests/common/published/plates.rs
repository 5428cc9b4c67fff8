//! Plane surfaces with nothing in between.

use glam::{DVec3, dvec3};
use hemicube::scene::builtin::Mesh;

use super::{Case, Figure, formulas, level, rectangle};

const UNIT: [f64; 4] = [0.0, 1.0, 0.0, 1.0];

const C_11: &str = "Hamilton & Morgan 1952; Howell C-11";
const C_13: &str = "Ehlert & Smith 1993; Howell C-13";
const C_14: &str = "Hamilton & Morgan 1952; Howell C-14";
const POLYGONS: &str = "integral along the outlines";

pub fn cases() -> Vec<Case> {
    let mut all = vec![parallel("unit squares, distance 1", UNIT, 1.0)];
    all.push(parallel("rectangles 2 × 1, distance 1", [0.0, 2.0, 0.0, 1.0], 1.0));
    all.push(parallel("unit squares, gap .01", UNIT, 0.01));
    all.push(parallel("unit squares, gap 10⁻⁴", UNIT, 1e-4));
    all.push(shifted("unit squares shifted by (1, 0)", C_13, [1.0, 2.0, 0.0, 1.0]));
    all.push(shifted("unit squares shifted by (1, 1)", C_13, [1.0, 2.0, 1.0, 2.0]));
    let coaxial = "coaxial squares of side 1 and 2, distance 1";
    all.push(shifted(coaxial, "Crawford 1972; Howell C-13", [-0.5, 1.5, -0.5, 1.5]));
    all.push(Case::pair(
        "unit squares at a right angle, common edge",
        C_14,
        vec![level(UNIT, 0.0, true), rectangle(DVec3::ZERO, DVec3::Y, DVec3::Z)],
        formulas::perpendicular(1.0, 1.0, 1.0),
    ));
    let rectangles = "rectangles 1 × 2 and 1 × .5 at a right angle, common edge";
    all.push(Case::pair(
        rectangles,
        C_14,
        vec![
            level([0.0, 2.0, 0.0, 1.0], 0.0, true),
            rectangle(DVec3::ZERO, DVec3::Y, DVec3::Z * 0.5),
        ],
        formulas::perpendicular(2.0, 0.5, 1.0),
    ));
    all.push(hinged("unit squares hinged at 30°", 30.0, 0.619_028_323));
    all.push(hinged("unit squares hinged at 60°", 60.0, 0.370_905_321));
    all.push(hinged("unit squares hinged at 120°", 120.0, 0.086_615_001));
    all.extend([tetrahedron(), octahedron(), hexagons(), element_below(), element_beside()]);
    all
}

fn parallel(name: &'static str, sides: [f64; 4], distance: f64) -> Case {
    let surfaces = vec![level(sides, 0.0, true), level(sides, distance, false)];
    Case::pair(name, C_11, surfaces, formulas::parallel(sides, sides, distance))
}

/// A unit square to a rectangle in the plane at distance 1.
fn shifted(name: &'static str, source: &'static str, to: [f64; 4]) -> Case {
    let surfaces = vec![level(UNIT, 0.0, true), level(to, 1.0, false)];
    Case::pair(name, source, surfaces, formulas::parallel(UNIT, to, 1.0))
}

/// Unit squares with a common edge, and so many degrees between their fronts.
fn hinged(name: &'static str, degrees: f64, exact: f64) -> Case {
    let (sin, cos) = degrees.to_radians().sin_cos();
    let other = rectangle(DVec3::ZERO, DVec3::Y, dvec3(cos, 0.0, sin));
    let source = "Feingold 1966; Howell C-16";
    Case::pair(name, source, vec![level(UNIT, 0.0, true), other], exact)
}

/// A triangle; its front is where the corners run counter-clockwise.
fn triangle(corners: [DVec3; 3]) -> Mesh {
    Mesh { vertices: corners.to_vec(), triangles: vec![[0, 1, 2]] }
}

/// The inside of a regular tetrahedron: each face sees the other three alike.
fn tetrahedron() -> Case {
    let corners =
        [dvec3(1., 1., 1.), dvec3(1., -1., -1.), dvec3(-1., 1., -1.), dvec3(-1., -1., 1.)];
    let faces = [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]];
    let inside = faces.map(|f: [usize; 3]| inwards(f.map(|v| corners[v])));
    let case = Case::pair("inside a regular tetrahedron", "symmetry", inside.to_vec(), 1.0 / 3.0);
    Case { patch_size: 0.1, ..case }
}

/// A face of a body about the origin that is seen from inside.
fn inwards([a, b, c]: [DVec3; 3]) -> Mesh {
    let outwards = (b - a).cross(c - a).dot(a) > 0.0;
    triangle(if outwards { [a, c, b] } else { [a, b, c] })
}

/// The inside of a regular octahedron.
fn octahedron() -> Case {
    let faces = (0..8).map(|n| {
        let sign = |k: usize| if n >> k & 1 == 0 { 1.0 } else { -1.0 };
        inwards([DVec3::X * sign(0), DVec3::Y * sign(1), DVec3::Z * sign(2)])
    });
    let figures = vec![
        Figure::new("across an edge", 0, 1, 0.136_854_3),
        Figure::new("across a vertex", 0, 3, 0.148_941_1),
        Figure::new("opposite", 0, 7, 0.142_613_7),
    ];
    let case = Case::pair("inside a regular octahedron", POLYGONS, faces.collect(), 0.0);
    Case { figures, ..case }
}

/// Regular hexagons of side 1 at distance 1.
fn hexagons() -> Case {
    let hexagon = |z: f64, up: bool| {
        let corner = |k: u32| {
            let (sin, cos) = (f64::from(k) * std::f64::consts::FRAC_PI_3).sin_cos();
            dvec3(cos, sin, z)
        };
        let vertices = (0..6).map(corner).collect();
        let mesh = Mesh::from_quads(vertices, &[[0, 1, 2, 3], [0, 3, 4, 5]]);
        if up { mesh } else { mesh.inverted() }
    };
    let surfaces = vec![hexagon(0.0, true), hexagon(1.0, false)];
    let name = "regular hexagons of side 1, distance 1";
    Case { patch_size: 0.05, ..Case::pair(name, POLYGONS, surfaces, 0.348_575_877) }
}

/// Side of a square that stands for a point: it blurs less than 10⁻⁶ of what points see.
const POINT: f64 = 1e-3;

/// A square for a point at the origin, facing up.
fn element() -> Mesh {
    let half = 0.5 * POINT;
    level([-half, half, -half, half], 0.0, true)
}

/// A point under a corner of a luminous ceiling.
fn element_below() -> Case {
    let surfaces = vec![element(), level(UNIT, 1.0, false)];
    let name = "point under the corner of a unit square, distance 1";
    let source = "as in CIE 171:2006, 5.6";
    Case::pair(name, source, surfaces, formulas::corner(1.0, 1.0, 1.0))
}

/// A point on the floor before the foot of a luminous wall.
fn element_beside() -> Case {
    let wall = rectangle(DVec3::X, DVec3::Y, DVec3::Z);
    // Its front looks back at the point.
    let surfaces = vec![element(), wall.inverted()];
    let name = "point before the foot of an upright unit square, distance 1";
    let source = "as in CIE 171:2006, 5.6";
    Case::pair(name, source, surfaces, formulas::upright_corner(1.0, 1.0, 1.0))
}
