//! Plane surfaces with something in between.

use glam::DVec3;
use hemicube::scene::builtin::Mesh;

use super::{Case, Figure, formulas, level, rectangle};

const UNIT: [f64; 4] = [0.0, 1.0, 0.0, 1.0];

pub fn cases() -> Vec<Case> {
    let half = [0.25, 0.75];
    vec![
        // As in the example of View3D (Walton 2002). Of four lines that mirror each other in the
        // axes of the squares, one is hidden: F = ¾ F₀.
        squares("unit squares, a quarter of the middle plane hidden", [0.0, 0.5], 0.5),
        squares("unit squares, square of side ½ at height ½", half, 0.5),
        squares("unit squares, square of side ½ at height ¼", half, 0.25),
        squares("unit squares, square of side ¼ at height ½", [0.375, 0.625], 0.5),
        squares("unit squares, square of side ¾ at height ½", [0.125, 0.875], 0.5),
        masked_element(),
        l_shaped_room(),
    ]
}

/// Unit squares at distance 1 behind a square that covers x and y from one number to another.
fn squares(name: &'static str, [low, high]: [f64; 2], height: f64) -> Case {
    let blocker = level([low, high, low, high], height, true);
    let surfaces = vec![level(UNIT, 0.0, true), level(UNIT, 1.0, false), blocker];
    let exact = formulas::behind([low, high], [low, high], height);
    Case {
        obstructed: true,
        patch_size: 0.01,
        ..Case::pair(name, "double integral", surfaces, exact)
    }
}

/// A point under the corner of a luminous ceiling, and between them a screen that hides a quarter
/// of it, and beyond its edges nothing else.
fn masked_element() -> Case {
    const HALF: f64 = 5e-4;
    let element = level([-HALF, HALF, -HALF, HALF], 0.0, true);
    let screen = level([-0.25, 0.25, -0.25, 0.25], 0.5, true);
    let exact = formulas::corner(1.0, 1.0, 1.0) - formulas::corner(0.5, 0.5, 1.0);
    let name = "point under the corner of a unit square, a quarter of it masked";
    let source = "as in CIE 171:2006, 5.7";
    let surfaces = vec![element, level(UNIT, 1.0, false), screen];
    Case { obstructed: true, ..Case::pair(name, source, surfaces, exact) }
}

/// Walls 1 to 6 of an L-shaped room 3 high, its floor and its ceiling; walls 1 and 6 meet in the
/// outer corner, 3 and 4 in the inner one.
fn l_shaped_room() -> Case {
    let at = [[0., 0.], [3., 0.], [3., 1.], [1., 1.], [1., 3.], [0., 3.]];
    let point = |k: usize, z: f64| DVec3::new(at[k % 6][0], at[k % 6][1], z);
    let mut surfaces: Vec<Mesh> = (0..6)
        .map(|k| {
            // Counter-clockwise about the room: the inside is on the left.
            let (from, to) = (point(k, 0.0), point(k + 1, 0.0));
            rectangle(from, DVec3::Z * 3.0, to - from)
        })
        .collect();
    for (z, up) in [(0.0, true), (3.0, false)] {
        let wings = [level([0., 1., 0., 3.], z, up), level([1., 3., 0., 1.], z, up)];
        surfaces.push(Mesh::joined(wings));
    }
    let three = [0.0, 3.0, 0.0, 3.0];
    let figures = vec![
        Figure::new("1 to 6, past the inner corner", 0, 5, formulas::l_shaped()),
        Figure::new("1 to 2", 0, 1, formulas::perpendicular(3.0, 1.0, 3.0)),
        Figure::new("1 to 3", 0, 2, formulas::parallel(three, [1.0, 3.0, 0.0, 3.0], 1.0)),
    ];
    let case = Case::pair("L-shaped room", "Pinney & Bean 1988; single integral", surfaces, 0.0);
    Case { figures, obstructed: true, patch_size: 0.3, ..case }
}
