//! Bodies that see themselves.

use std::f64::consts::TAU;

use glam::{DVec3, dvec3};
use hemicube::scene::builtin::Mesh;

use super::{boxed, square_for};

/// The inside of a sphere of radius 1, of about `n` triangles: 20 times a square.
pub fn inside_sphere(n: usize) -> Mesh {
    Mesh::geodesic(1.0, (n as f64 / 20.0).sqrt().round().max(1.0) as u32).inverted()
}

/// A torus of radii 1 and .4, of about `n` triangles.
pub fn torus(n: usize) -> Mesh {
    let sides = (n as f64 / 4.0).sqrt().round().max(3.0) as u32;
    Mesh::torus(1.0, 0.4, 2 * sides, sides)
}

/// A bolt of radius 1 with a thread of 60° that winds twice, of about `n` triangles.
pub fn thread(n: usize) -> Mesh {
    const PITCH: f64 = 0.5;
    const DEPTH: f64 = 0.4;
    const TURNS: f64 = 2.0;
    let height = PITCH * (TURNS + 2.0);
    let rows = (n as f64 / 4.0).sqrt().round().max(8.0) as u32;
    let round = 2 * rows;
    let mut mesh = Mesh::default();
    for k in 0..=rows {
        let y = height * f64::from(k) / f64::from(rows);
        for i in 0..round {
            let turn = f64::from(i) / f64::from(round);
            // The groove winds; towards the ends it runs out.
            let phase = (y / PITCH - turn).rem_euclid(1.0);
            let groove = 1.0 - (2.0 * phase - 1.0).abs();
            let end = (y.min(height - y) / PITCH).clamp(0.0, 1.0);
            let radius = 1.0 - DEPTH * groove * end;
            let (sin, cos) = (TAU * turn).sin_cos();
            mesh.vertices.push(dvec3(radius * cos, y, -radius * sin));
        }
    }
    let at = |k: u32, i: u32| k * round + i % round;
    for (k, i) in (0..rows).flat_map(|k| (0..round).map(move |i| (k, i))) {
        let [a, b, c, d] = [at(k, i), at(k, i + 1), at(k + 1, i + 1), at(k + 1, i)];
        mesh.triangles.extend([[a, b, c], [a, c, d]]);
    }
    let [low, high] = [0.0, height].map(|y| {
        mesh.vertices.push(dvec3(0.0, y, 0.0));
        (mesh.vertices.len() - 1) as u32
    });
    for i in 0..round {
        mesh.triangles.push([low, at(0, i + 1), at(0, i)]);
        mesh.triangles.push([high, at(rows, i), at(rows, i + 1)]);
    }
    mesh
}

/// A plate of 1 × 1 m with eight thin fins that stand on it, of about `n` triangles.
pub fn fins(n: usize) -> Mesh {
    const FINS: u32 = 8;
    let fin = dvec3(1.0, 0.4, 0.02);
    let plate = dvec3(1.0, 0.05, 1.0);
    let square = square_for(f64::from(FINS) * 2.0 * fin.x * fin.y + 2.0 * plate.x * plate.z, n);
    let mut parts = vec![boxed(plate, square).at(0.0, -0.5 * plate.y, 0.0)];
    for k in 0..FINS {
        let z = (f64::from(k) + 0.5) / f64::from(FINS) - 0.5;
        let standing = boxed(fin, square).resting_on(0.0).open_towards(DVec3::NEG_Y);
        parts.push(standing.at(0.0, 0.0, z));
    }
    Mesh::joined(parts)
}

/// Seven hexagonal cells of side .5 and depth 1 under a plate, of about `n` triangles. Between the
/// walls of two cells are 2 cm.
pub fn honeycomb(n: usize) -> Mesh {
    const SIDE: f64 = 0.5;
    const DEPTH: f64 = 1.0;
    const WALL: f64 = 0.02;
    let square = square_for(7.0 * (6.0 * SIDE * DEPTH + 2.6 * SIDE * SIDE) + 9.0, n);
    // Walls are stacks of squares, which all are cut alike.
    let cuts = (SIDE / square).round().max(1.0) as u32;
    let cell = || {
        let stacks = (DEPTH / SIDE) as u32;
        Mesh::cylinder(SIDE, DEPTH, 6, stacks).inverted().open_towards(DVec3::Y)
    };
    let apart = 3.0_f64.sqrt() * SIDE + WALL;
    let mut parts = vec![cell()];
    for k in 0..6 {
        let (sin, cos) = (TAU * (f64::from(k) + 0.5) / 6.0).sin_cos();
        parts.push(cell().at(apart * cos, 0.0, apart * sin));
    }
    let cells = split(Mesh::joined(parts), cuts);
    let plate = boxed(dvec3(3.0, 0.1, 3.0), square).at(0.0, DEPTH + 0.15, 0.0);
    Mesh::joined([cells, plate])
}

/// Each triangle cut into `cuts`² by lines parallel to its edges.
fn split(mesh: Mesh, cuts: u32) -> Mesh {
    let mut fine = Mesh::default();
    for t in &mesh.triangles {
        let [a, b, c] = t.map(|v| mesh.vertices[v as usize]);
        let at = |i: u32, j: u32| {
            let [u, v] = [i, j].map(|x| f64::from(x) / f64::from(cuts));
            a * (1.0 - u - v) + b * u + c * v
        };
        let mut index = vec![vec![0; cuts as usize + 1]; cuts as usize + 1];
        for (i, column) in (0..).zip(&mut index) {
            for j in 0..=cuts - i {
                column[j as usize] = fine.vertices.len() as u32;
                fine.vertices.push(at(i, j));
            }
        }
        for i in 0..cuts as usize {
            for j in 0..cuts as usize - i {
                let [p, q, r] = [index[i][j], index[i + 1][j], index[i][j + 1]];
                fine.triangles.push([p, q, r]);
                if i + j + 1 < cuts as usize {
                    fine.triangles.push([q, index[i + 1][j + 1], r]);
                }
            }
        }
    }
    fine
}
