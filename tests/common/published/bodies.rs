//! Curved bodies, as polyhedra, and convex bodies in enclosures.

use std::f64::consts::{PI, TAU};

use glam::{DAffine3, DMat3, DVec3, dvec3};
use hemicube::scene::builtin::Mesh;

use super::super::contour::exchange;
use super::{Case, Figure, area, formulas, polygons};

/// Corners of circles.
const ROUND: u32 = 24;

pub fn cases() -> Vec<Case> {
    vec![
        discs("coaxial discs of radius 1, distance 1", 1.0, 1.0, 1.0),
        discs("coaxial discs of radius 1 and 2, distance 1.5", 1.0, 2.0, 1.5),
        cylinders(),
        sphere_to_disc(),
        sphere_in_a_cube(),
        cylinder_in_a_sphere(),
        brick_in_a_tetrahedron(),
    ]
}

/// A mesh about the origin, scaled to an area, m²: with that of the curved body a polyhedron comes
/// nearest to it.
fn of_area(mesh: Mesh, wanted: f64) -> Mesh {
    let scale = (wanted / area(&mesh)).sqrt();
    mesh.placed(DAffine3::from_scale(DVec3::splat(scale)))
}

fn sphere(radius: f64) -> Mesh {
    of_area(Mesh::geodesic(radius, 2), 4.0 * PI * radius * radius)
}

/// A disc of the axis y at that height, facing up or down, as a regular polygon of its area.
fn disc(radius: f64, y: f64, up: bool) -> (Mesh, Vec<DVec3>) {
    let step = TAU / f64::from(ROUND);
    let radius = radius * (step / step.sin()).sqrt();
    let corner = |k: u32| {
        let (sin, cos) = (step * f64::from(k)).sin_cos();
        dvec3(radius * cos, y, -radius * sin)
    };
    let mut corners: Vec<DVec3> = (0..ROUND).map(corner).collect();
    let mut vertices = corners.clone();
    vertices.push(DVec3::Y * y);
    let triangles = (0..ROUND).map(|k| [ROUND, k, (k + 1) % ROUND]).collect();
    let mesh = Mesh { vertices, triangles };
    if up {
        return (mesh, corners);
    }
    corners.reverse();
    (mesh.inverted(), corners)
}

fn discs(name: &'static str, r: f64, s: f64, h: f64) -> Case {
    let ((a, outline), (b, other)) = (disc(r, 0.0, true), disc(s, h, false));
    let exact = exchange(&outline, &other) / area(&a);
    let source = "Hamilton & Morgan 1952; Howell C-41";
    curved(Case::pair(name, source, vec![a, b], exact), formulas::discs(r, s, h))
}

/// A case of one figure of a polyhedron that stands for a curved body.
fn curved(mut case: Case, curved: f64) -> Case {
    case.figures[0].curved = Some(curved);
    Case { patch_size: 0.1, ..case }
}

/// What two convex bodies, or the insides of such, exchange if nothing else is in between.
fn between(a: &Mesh, b: &Mesh) -> f64 {
    let (a, b) = (polygons(a), polygons(b));
    a.iter().flat_map(|p| b.iter().map(move |q| exchange(p, q))).sum()
}

/// The inside of an open cylinder of radius 2 to the outside of a coaxial one of radius 1, both 2
/// long.
fn cylinders() -> Case {
    const ROUND: u32 = 16;
    let mantle = |radius: f64| {
        let prism = Mesh::cylinder(radius, 2.0, ROUND, 1);
        prism.open_towards(DVec3::NEG_Y).open_towards(DVec3::Y)
    };
    let (outer, inner) = (mantle(2.0).inverted(), mantle(1.0));
    let exact = between(&outer, &inner) / area(&outer);
    let name = "coaxial cylinders of radius 2 and 1, length 2: outer to inner";
    let case = Case::pair(name, "Rea 1975", vec![outer, inner], exact);
    let case = curved(case, formulas::cylinders(2.0, 1.0, 2.0));
    Case { two_sided: true, patch_size: 0.3, ..case }
}

/// A sphere of radius .5 to a disc of radius 1 at distance 1 from its centre.
fn sphere_to_disc() -> Case {
    let sphere = sphere(0.5);
    let (disc, outline) = disc(1.0, -1.0, true);
    let exact =
        polygons(&sphere).iter().map(|p| exchange(p, &outline)).sum::<f64>() / area(&sphere);
    let name = "sphere to a coaxial disc of radius 1, distance 1";
    let case = Case::pair(name, "Feingold & Gupta 1970", vec![sphere, disc], exact);
    curved(Case { two_sided: true, ..case }, formulas::sphere_to_disc(1.0, 1.0))
}

const CONVEX: &str = "reciprocity and closure: A body / A enclosure";

/// An enclosure to a convex body in it, and to itself.
fn enclosed(name: &'static str, enclosure: Mesh, body: Mesh, ratio: Option<f64>) -> Case {
    let exact = area(&body) / area(&enclosure);
    let curved = |x: f64| ratio.map(|r| x + (1.0 - 2.0 * x) * r);
    let figure = |name, to, exact, curved| Figure { curved, ..Figure::new(name, 0, to, exact) };
    let figures = vec![
        figure("enclosure to body", 1, exact, curved(0.0)),
        figure("enclosure to itself", 0, 1.0 - exact, curved(1.0)),
    ];
    let case = Case::pair(name, CONVEX, vec![enclosure, body], exact);
    Case { figures, obstructed: true, patch_size: 0.25, ..case }
}

fn sphere_in_a_cube() -> Case {
    let cube = Mesh::cuboid(DVec3::splat(2.0), [1; 3]).at(0.0, -1.0, 0.0).inverted();
    let sphere = sphere(0.6).at(0.1, -0.2, 0.15);
    let ratio = 4.0 * PI * 0.36 / 24.0;
    enclosed("sphere of radius .6 in a cube of side 2", cube, sphere, Some(ratio))
}

fn cylinder_in_a_sphere() -> Case {
    let sphere = sphere(1.5).inverted();
    let turn = DAffine3::from_mat3(DMat3::from_rotation_x(0.7) * DMat3::from_rotation_z(0.4));
    let whole = TAU * 0.4 * (1.0 + 0.4);
    let cylinder = of_area(Mesh::cylinder(0.4, 1.0, 16, 1), whole).placed(turn).at(0.2, -0.3, 0.1);
    let ratio = whole / (4.0 * PI * 2.25);
    enclosed(
        "cylinder of radius .4, length 1, in a sphere of radius 1.5",
        sphere,
        cylinder,
        Some(ratio),
    )
}

fn brick_in_a_tetrahedron() -> Case {
    let turn = DAffine3::from_mat3(DMat3::from_rotation_y(0.5) * DMat3::from_rotation_x(0.3));
    let tetrahedron = Mesh::cone(3.0, 4.0, 3, 1).inverted();
    let brick = Mesh::cuboid(dvec3(0.8, 0.5, 0.6), [1; 3]).placed(turn).at(0.1, 0.6, 0.0);
    enclosed("brick in a pyramid", tetrahedron, brick, None)
}
