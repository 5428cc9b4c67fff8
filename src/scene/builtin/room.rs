//! A furnished room, 6 × 3 × 5 m: a sculpture of 4,000 triangles on a pedestal, a table laid for
//! two, books, a sofa, a tree in a pot, lit by a panel in the ceiling and a floor lamp.

use glam::{DVec3, dvec3};

use super::furniture::{
    BOARD, board_height, bookcase, chair, picture, plank, shell, sofa, table, turned_piece,
};
use super::mesh::Mesh;
use super::stage::Stage;
use crate::scene::Scene;

/// Width, height and depth (m); one corner is the origin.
const SIZE: DVec3 = dvec3(6.0, 3.0, 5.0);

/// Lowest and highest x and z (m) of the luminous panel in the ceiling.
const PANEL: [[f64; 2]; 2] = [[2.2, 4.2], [2.0, 3.0]];

/// Thickness of the rug (m) under the table and its chairs.
const RUG: f64 = 0.02;

/// Middle of the table's top (m).
const TABLE: DVec3 = dvec3(3.3, RUG + 0.74, 2.65);

/// The furnished room.
pub(super) fn room() -> Scene {
    let mut stage = Stage::new("room");
    walls(&mut stage);
    lamp(&mut stage);
    sculpture(&mut stage);
    dining(&mut stage);
    library(&mut stage);
    lounge(&mut stage);
    plant(&mut stage);
    stage.camera("main", dvec3(0.35, 1.6, 4.7), dvec3(3.5, 0.95, 1.75), 60.0, 4.0 / 3.0);
    stage.camera("sculpture", dvec3(2.75, 1.55, 2.3), dvec3(1.75, 1.18, 0.85), 45.0, 4.0 / 3.0);
    stage.finish()
}

fn walls(stage: &mut Stage) {
    let plaster = stage.paint("plaster", [0.76, 0.74, 0.69]);
    let white = stage.paint("ceiling white", [0.8, 0.8, 0.78]);
    let oak = stage.paint("oak floor", [0.47, 0.33, 0.21]);
    let ochre = stage.paint("ochre", [0.72, 0.48, 0.2]);
    let teal = stage.paint("teal", [0.16, 0.38, 0.4]);
    let panel = stage.glow("ceiling panel", [0.7; 3], [9.0, 8.6, 7.8]);
    stage.add_parts(
        &shell(SIZE, PANEL),
        &[
            ("floor", oak, 2),
            ("ceiling", white, 8),
            ("ceiling panel", panel, 2),
            ("wall by the camera", plaster, 2),
            ("left wall", teal, 2),
            ("right wall", ochre, 2),
            ("far wall", plaster, 2),
        ],
    );
    let wool = stage.paint("wool", [0.42, 0.16, 0.15]);
    let rug = Mesh::cuboid(dvec3(2.7, RUG, 2.5), [6, 1, 6]).open_towards(DVec3::NEG_Y);
    stage.add("rug", wool, &rug.at(TABLE.x, 0.0, TABLE.z));
}

fn lamp(stage: &mut Stage) {
    let steel = stage.paint("steel", [0.35; 3]);
    let globe = stage.glow("lamp globe", [0.7; 3], [20.0, 15.0, 9.0]);
    let (foot, rod, top) = (0.16, 0.018, 1.45);
    let mut profile = vec![[0.0, 0.0], [foot, 0.0], [foot, 0.02], [rod, 0.04]];
    profile.extend((1..=8).map(|i| [rod, 0.04 + (top - 0.04) * f64::from(i) / 8.0]));
    profile.push([0.0, top]);
    let [x, z] = [5.3, 0.6];
    stage.add("lamp stand", steel, &turned_piece(&profile, 12).at(x, 0.0, z));
    stage.add("lamp globe", globe, &Mesh::geodesic(0.17, 3).resting_on(top).at(x, 0.0, z));
}

fn sculpture(stage: &mut Stage) {
    let stone = stage.paint("stone", [0.55, 0.54, 0.52]);
    let glaze = stage.paint("blue glaze", [0.16, 0.3, 0.62]);
    let [x, z, height] = [1.75, 0.85, 0.85];
    let pedestal = Mesh::cuboid(dvec3(0.46, height, 0.46), [1, 2, 1]).open_towards(DVec3::NEG_Y);
    let knot = Mesh::torus_knot((2, 3), 0.25, 0.11, 0.062, 200, 10)
        .tipped()
        .resting_on(height)
        .turned(25.0);
    stage.add("pedestal", stone, &pedestal.turned(25.0).at(x, 0.0, z));
    stage.add("sculpture", glaze, &knot.at(x, 0.0, z));
}

/// Table, two chairs, and what stands on the table.
fn dining(stage: &mut Stage) {
    let walnut = stage.paint("walnut", [0.36, 0.22, 0.14]);
    let red = stage.paint("red lacquer", [0.6, 0.14, 0.1]);
    let green = stage.paint("green glaze", [0.25, 0.5, 0.28]);
    let porcelain = stage.paint("porcelain", [0.78, 0.77, 0.74]);
    let orange = stage.paint("orange", [0.75, 0.38, 0.08]);
    let DVec3 { x, y: top, z } = TABLE;

    stage.add("table", walnut, &table(1.5, top - RUG, 0.85).at(x, RUG, z));
    stage.add("near chair", red, &chair().turned(168.0).at(x - 0.3, RUG, z + 0.75));
    stage.add("far chair", red, &chair().turned(-8.0).at(x + 0.3, RUG, z - 0.72));

    let vase = [
        [0.0, 0.0],
        [0.05, 0.0],
        [0.085, 0.08],
        [0.08, 0.15],
        [0.035, 0.23],
        [0.05, 0.28],
        [0.042, 0.28],
        [0.028, 0.235],
        [0.0, 0.22],
    ];
    let bowl =
        [[0.0, 0.0], [0.06, 0.0], [0.15, 0.075], [0.14, 0.075], [0.055, 0.012], [0.0, 0.012]];
    stage.add("vase", green, &turned_piece(&vase, 16).at(x + 0.45, top, z - 0.1));
    stage.add("bowl", porcelain, &turned_piece(&bowl, 24).at(x - 0.15, top, z));
    for (i, [dx, dz]) in [[-0.05, 0.03], [0.045, 0.035], [0.0, -0.05]].into_iter().enumerate() {
        let fruit = Mesh::geodesic(0.04, 2).resting_on(top + 0.0125);
        stage.add(&format!("fruit {}", i + 1), orange, &fruit.at(x - 0.15 + dx, 0.0, z + dz));
    }
}

/// A bookcase on the right wall, its books, and a picture on the far wall.
fn library(stage: &mut Stage) {
    const WIDTH: f64 = 1.05;
    const HEIGHT: f64 = 1.75;
    const BOARDS: u32 = 5;
    let birch = stage.paint("birch", [0.66, 0.55, 0.4]);
    let covers = [
        stage.paint("linen", [0.7, 0.64, 0.5]),
        stage.paint("burgundy", [0.36, 0.1, 0.13]),
        stage.paint("navy", [0.15, 0.19, 0.36]),
        stage.paint("moss", [0.26, 0.36, 0.18]),
    ];
    // The bookcase looks towards -x.
    let against_wall = |mesh: Mesh| mesh.turned(-90.0).at(SIZE.x, 0.0, 2.1);
    stage.add("bookcase", birch, &against_wall(bookcase(WIDTH, HEIGHT, 0.3, BOARDS)));

    let mut number = 0_u32;
    for board in 0..BOARDS - 1 {
        let mut left = -0.5 * WIDTH + BOARD + 0.01;
        // Fewer books on some boards, so that the wall shows.
        for _ in 0..[12, 8, 11, 6][board as usize] {
            // Whole steps of a fixed pattern stand in for chance.
            let step = |modulus: u32, factor: u32| f64::from(number * factor % modulus);
            let (thick, high, deep) =
                (0.03 + 0.007 * step(5, 3), 0.2 + 0.02 * step(7, 4), 0.17 + 0.01 * step(6, 5));
            let book = plank(thick, high, deep).open_towards(DVec3::NEG_Y).at(
                left + 0.5 * thick,
                board_height(HEIGHT, BOARDS, board),
                0.08 + 0.5 * deep,
            );
            let cover = covers[(number * number + number / 3) as usize % covers.len()];
            stage.add(&format!("book {}", number + 1), cover, &against_wall(book));
            left += thick + 0.004;
            number += 1;
        }
    }

    let frame = stage.paint("black frame", [0.15; 3]);
    let colours = [covers[1], covers[0], covers[2], stage.paint("chrome yellow", [0.8, 0.6, 0.12])];
    let mesh = picture(1.3, 0.95).at(3.6, 1.65, 0.0);
    let rim = mesh.triangles.len() - 4;
    let names = ["canvas right", "canvas top", "canvas left", "canvas bottom"];
    let canvas = [0, 1, 2, 3].map(|i| (names[i], colours[i], 1));
    stage.add_parts(&mesh, &[&[("picture frame", frame, rim)], &canvas[..]].concat());
}

/// A sofa below the picture, 3 cm before the wall, with a ball of wool on it and one before it.
fn lounge(stage: &mut Stage) {
    let linen = stage.paint("grey linen", [0.42, 0.45, 0.44]);
    let yarn = stage.paint("yarn", [0.7, 0.55, 0.2]);
    let [x, z] = [3.6, 0.455];
    stage.add("sofa", linen, &sofa(1.9).at(x, 0.0, z));
    let ball = |radius: f64, y: f64| Mesh::geodesic(radius, 3).resting_on(y);
    stage.add("ball on the sofa", yarn, &ball(0.07, 0.42).at(x - 0.45, 0.0, z + 0.08));
    stage.add("ball on the floor", yarn, &ball(0.11, 0.0).at(x - 1.15, 0.0, z + 0.75));
}

/// A clipped tree in a pot.
fn plant(stage: &mut Stage) {
    let clay = stage.paint("clay", [0.58, 0.3, 0.2]);
    let leaves = stage.paint("leaves", [0.18, 0.36, 0.15]);
    let [x, z] = [5.5, 3.6];
    let pot = [
        [0.0, 0.0],
        [0.14, 0.0],
        [0.2, 0.36],
        [0.17, 0.36],
        [0.165, 0.32],
        [0.03, 0.32],
        [0.03, 0.45],
        [0.0, 0.45],
    ];
    stage.add("pot", clay, &turned_piece(&pot, 16).at(x, 0.0, z));
    let tree = Mesh::cone(0.27, 1.1, 20, 5).at(x, 0.45, z);
    stage.add("tree", leaves, &tree);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn about_seven_and_a_half_thousand_triangles_inside_the_walls() {
        let g = room().geometry;
        assert!((7_000..=8_000).contains(&g.len()), "{}", g.len());
        let (low, high) = g.bounds().expect("a room has walls");
        assert_eq!((low, high), (DVec3::ZERO, SIZE));
        let knot = g.surfaces.iter().position(|s| s.name == "sculpture").expect("a sculpture");
        assert_eq!(g.surface_of.iter().filter(|&&s| s as usize == knot).count(), 4000);
    }
}
