//! Rooms, and simple pieces of furniture to stand in them (metres).
//!
//! Furniture stands on `y = 0` about the `y` axis, its front towards +z. Faces that only touch
//! another surface are left out: see [`Mesh::open_towards`].

use glam::{DAffine3, DVec2, DVec3, dvec2, dvec3};

use super::mesh::Mesh;

/// A plank's cells are at most this many times longer than it is thick, so that no triangle is a
/// sliver.
const LONGEST_CELL: f64 = 16.0;

/// A rectangular room seen from inside, with a rectangular panel flush in its ceiling.
///
/// One corner is the origin; `panel` is the lowest and highest x and z. Nine pieces of two
/// triangles (eight for the ceiling) that share their vertices, in the order floor, ceiling, panel,
/// +z, -x, +x, -z: what [`Stage::add_parts`](super::stage::Stage::add_parts) asks for.
pub(super) fn shell(size: DVec3, panel: [[f64; 2]; 2]) -> Mesh {
    let rectangle = |y: f64, [[x0, x1], [z0, z1]]: [[f64; 2]; 2]| {
        [dvec3(x0, y, z0), dvec3(x0, y, z1), dvec3(x1, y, z1), dvec3(x1, y, z0)]
    };
    let outline = [[0.0, size.x], [0.0, size.z]];
    let vertices =
        [rectangle(0.0, outline), rectangle(size.y, outline), rectangle(size.y, panel)].concat();
    let quads = [
        [0, 1, 2, 3],
        [4, 7, 11, 8],
        [7, 6, 10, 11],
        [6, 5, 9, 10],
        [5, 4, 8, 9],
        [8, 11, 10, 9],
        [1, 5, 6, 2],
        [0, 4, 5, 1],
        [3, 2, 6, 7],
        [0, 3, 7, 4],
    ];
    Mesh::from_quads(vertices, &quads)
}

/// A box without slivers.
pub(super) fn plank(x: f64, y: f64, z: f64) -> Mesh {
    let size = dvec3(x, y, z);
    let longest = LONGEST_CELL * size.min_element();
    Mesh::cuboid(size, size.to_array().map(|edge| (edge / longest).ceil() as u32))
}

/// A post between the floor, or what it stands on, and what it carries.
fn post(edge: f64, height: f64) -> Mesh {
    plank(edge, height, edge).open_towards(DVec3::NEG_Y).open_towards(DVec3::Y)
}

/// Four posts at the corners of a rectangle.
fn legs(x: f64, z: f64, edge: f64, height: f64) -> impl Iterator<Item = Mesh> {
    let (x, z) = (0.5 * (x - edge), 0.5 * (z - edge));
    [[-x, -z], [-x, z], [x, -z], [x, z]]
        .into_iter()
        .map(move |[x, z]| post(edge, height).at(x, 0.0, z))
}

/// A table of the given size.
pub(super) fn table(x: f64, height: f64, z: f64) -> Mesh {
    let (top, leg, inset) = (0.04, 0.06, 0.08);
    let board = plank(x, top, z).at(0.0, height - top, 0.0);
    Mesh::joined(legs(x - inset, z - inset, leg, height - top).chain([board]))
}

/// A chair with a seat at .45 m.
pub(super) fn chair() -> Mesh {
    let (width, seat, leg) = (0.44, 0.45, 0.04);
    let board = plank(width, leg, width).at(0.0, seat - leg, 0.0);
    let side = 0.5 * (width - leg);
    let back_posts =
        [-side, side].map(|x| plank(leg, 0.42, leg).open_towards(DVec3::NEG_Y).at(x, seat, -side));
    let rails = [0.12, 0.29].map(|y| {
        plank(width - 2.0 * leg, 0.09, 0.02).open_towards(DVec3::X).open_towards(DVec3::NEG_X).at(
            0.0,
            seat + y,
            -side,
        )
    });
    Mesh::joined(legs(width, width, leg, seat - leg).chain([board]).chain(back_posts).chain(rails))
}

/// An upholstered box: its edges and corners are rounded by `radius`, in two facets each.
fn upholstered(size: DVec3, radius: f64) -> Mesh {
    let flat = size - 2.0 * radius;
    let longest = 1.5 * LONGEST_CELL * radius;
    let cells = flat.to_array().map(|edge| 2 + (edge / longest).ceil() as u32);
    let mut mesh = Mesh::cuboid(size, cells);
    let low = dvec3(-0.5 * size.x, 0.0, -0.5 * size.z);
    for v in &mut mesh.vertices {
        let (mut inner, mut outwards) = (DVec3::ZERO, DVec3::ZERO);
        for k in 0..3 {
            let last = f64::from(cells[k]);
            let cell = (last * (*v - low)[k] / size[k]).round();
            // The outer cells are as wide as the radius.
            inner[k] = radius + flat[k] * ((cell - 1.0) / (last - 2.0)).clamp(0.0, 1.0);
            outwards[k] = f64::from(u8::from(cell == last)) - f64::from(u8::from(cell == 0.0));
        }
        *v = low + inner + outwards.normalize_or_zero() * radius;
    }
    mesh
}

/// A sofa that looks towards +z, with two cushions to sit on.
pub(super) fn sofa(width: f64) -> Mesh {
    let (deep, seat, arm, gap) = (0.85, 0.26, 0.17, 0.004);
    let (inner, back) = (width - 2.0 * arm, 0.2);
    let base = upholstered(dvec3(inner - 2.0 * gap, seat, deep - 0.02), 0.03);
    let arms = [-1.0, 1.0].map(|side| {
        let arm_rest = upholstered(dvec3(arm, 0.56, deep), 0.04);
        arm_rest.open_towards(DVec3::NEG_Y).at(0.5 * side * (width - arm), 0.0, 0.0)
    });
    let half = 0.5 * (inner - 3.0 * gap);
    let places = [-0.5, 0.5].map(|side| side * (half + gap));
    let seats = places.map(|x| {
        let size = dvec3(half, 0.16, deep - back - 0.01);
        let cushion = upholstered(size, 0.045).open_towards(DVec3::NEG_Y);
        cushion.at(x, seat, 0.5 * back + 0.005)
    });
    let back_rest = upholstered(dvec3(inner - 2.0 * gap, 0.46, back - gap), 0.05);
    let back_rest = back_rest.open_towards(DVec3::NEG_Y).at(0.0, seat, -0.5 * (deep - back));
    let parts = [base.open_towards(DVec3::NEG_Y), back_rest];
    Mesh::joined(parts.into_iter().chain(arms).chain(seats))
}

/// A bookcase with its back to -z, against a wall, and `boards` boards, the lowest at `low` m and
/// the others evenly up to the height.
pub(super) fn bookcase(width: f64, height: f64, depth: f64, boards: u32) -> Mesh {
    let thick = BOARD;
    let side = |x: f64| {
        plank(thick, height, depth).open_towards(DVec3::NEG_Y).open_towards(DVec3::NEG_Z).at(
            x,
            0.0,
            0.5 * depth,
        )
    };
    let reach = 0.5 * (width - thick);
    let board = |i: u32| {
        plank(width - 2.0 * thick, thick, depth)
            .open_towards(DVec3::X)
            .open_towards(DVec3::NEG_X)
            .open_towards(DVec3::NEG_Z)
            .at(0.0, board_height(height, boards, i) - thick, 0.5 * depth)
    };
    Mesh::joined([side(-reach), side(reach)].into_iter().chain((0..boards).map(board)))
}

/// Thickness of the bookcase's boards.
pub(super) const BOARD: f64 = 0.03;

/// Height of the upper face of the `i`-th of a bookcase's boards, the lowest .12 m above the floor.
pub(super) fn board_height(height: f64, boards: u32, i: u32) -> f64 {
    0.12 + (height - 0.12) * f64::from(i) / f64::from(boards - 1)
}

/// A framed picture on a wall behind it (-z), centred on the origin; its last four triangles are
/// the canvas: right, top, left and bottom.
pub(super) fn picture(width: f64, height: f64) -> Mesh {
    // Four segments make a square of which the radius is half the diagonal.
    let half = 0.5_f64.sqrt();
    let profile = [
        DVec2::ZERO,
        dvec2(half, 0.0),
        dvec2(half, 0.06),
        dvec2(0.86 * half, 0.06),
        dvec2(0.86 * half, 0.025),
        dvec2(0.0, 0.025),
    ];
    Mesh::lathe(&profile, 4)
        .turned(45.0)
        .tipped()
        .placed(DAffine3::from_scale(dvec3(width, height, 1.0)))
        .open_towards(DVec3::NEG_Z)
}

/// Something turned on a lathe that stands on what is below it.
pub(super) fn turned_piece(profile: &[[f64; 2]], segments: u32) -> Mesh {
    let profile: Vec<DVec2> = profile.iter().copied().map(DVec2::from_array).collect();
    Mesh::lathe(&profile, segments).open_towards(DVec3::NEG_Y)
}
