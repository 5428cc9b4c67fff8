//! A head of blended spheres.

use std::collections::HashMap;

use glam::{DVec3, dvec3};
use hemicube::scene::builtin::Mesh;

/// A sphere that adds to the field, or takes away from it.
struct Blob {
    weight: f64,
    centre: DVec3,
    radius: f64,
}

/// Skull, jaw, nose, ears and neck; two sockets and a mouth.
fn blobs() -> Vec<Blob> {
    let blob = |weight: f64, x: f64, y: f64, z: f64, radius: f64| Blob {
        weight,
        centre: dvec3(x, y, z),
        radius,
    };
    vec![
        blob(1.0, 0.0, 0.25, -0.05, 0.62),
        blob(0.9, 0.0, -0.25, 0.12, 0.42),
        blob(1.1, 0.0, -0.02, 0.62, 0.15),
        blob(1.0, 0.66, 0.05, -0.1, 0.17),
        blob(1.0, -0.66, 0.05, -0.1, 0.17),
        blob(1.0, 0.0, -0.8, -0.12, 0.3),
        blob(-1.6, 0.24, 0.2, 0.62, 0.15),
        blob(-1.6, -0.24, 0.2, 0.62, 0.15),
        blob(-1.3, 0.0, -0.3, 0.6, 0.14),
    ]
}

/// How fast a blob falls off beyond its radius.
const FALL: f64 = 1.6;

/// Positive inside (Blinn 1982, "A generalization of algebraic surface drawing").
fn field(blobs: &[Blob], p: DVec3) -> f64 {
    let sum: f64 = blobs
        .iter()
        .map(|b| {
            let r = p.distance_squared(b.centre) / (b.radius * b.radius);
            b.weight * (FALL * (1.0 - r)).exp()
        })
        .sum();
    sum - 1.0
}

/// A head of about `n` triangles, some 500 to 20,000, many of them slivers.
pub fn head(n: usize) -> Mesh {
    let blobs = blobs();
    // The number of triangles goes as the inverse square of the cells' size.
    let mut size = 0.12;
    let mut mesh = surface(&blobs, size);
    for _ in 0..3 {
        size *= (mesh.triangles.len() as f64 / n as f64).sqrt();
        mesh = surface(&blobs, size);
    }
    mesh
}

/// The surface where the field vanishes, by tetrahedra, six a cell of that size (Doi & Koide 1991,
/// "An efficient method of triangulating equi-valued surfaces by using tetrahedral cells").
fn surface(blobs: &[Blob], size: f64) -> Mesh {
    /// The field is negative all over this box.
    const HALF: f64 = 1.4;
    let n = (2.0 * HALF / size).ceil() as u32;
    let step = 2.0 * HALF / f64::from(n);
    let at = |l: [u32; 3]| {
        let [x, y, z] = l.map(|k| f64::from(k) * step - HALF);
        dvec3(x, y, z)
    };
    let side = n as usize + 1;
    let index = |[x, y, z]: [u32; 3]| (x as usize * side + y as usize) * side + z as usize;
    let mut values = vec![0.0; side * side * side];
    for x in 0..=n {
        for y in 0..=n {
            for z in 0..=n {
                values[index([x, y, z])] = field(blobs, at([x, y, z]));
            }
        }
    }
    let mut made = Made { mesh: Mesh::default(), known: HashMap::new() };
    // The six orders in which one goes from a corner of a cell to the opposite one.
    const ORDERS: [[usize; 3]; 6] =
        [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
    for (x, y, z) in (0..n).flat_map(|x| (0..n).flat_map(move |y| (0..n).map(move |z| (x, y, z)))) {
        for order in ORDERS {
            let mut corner = [x, y, z];
            let mut corners = [corner; 4];
            for (k, axis) in order.into_iter().enumerate() {
                corner[axis] += 1;
                corners[k + 1] = corner;
            }
            let ends = corners.map(|l| (index(l), at(l), values[index(l)]));
            made.tetrahedron(ends);
        }
    }
    made.mesh
}

/// A corner of the lattice: its number, its place, and the field there.
type End = (usize, DVec3, f64);

/// A surface in the making, and its vertices by the two corners that they lie between.
struct Made {
    mesh: Mesh,
    known: HashMap<(usize, usize), u32>,
}

impl Made {
    fn tetrahedron(&mut self, ends: [End; 4]) {
        let (inside, outside): (Vec<End>, Vec<End>) = ends.into_iter().partition(|e| e.2 > 0.0);
        let mut cut = |a: usize, b: usize| self.vertex(inside[a], outside[b]);
        let polygon = match inside.len() {
            1 => vec![cut(0, 0), cut(0, 1), cut(0, 2)],
            2 => vec![cut(0, 0), cut(0, 1), cut(1, 1), cut(1, 0)],
            3 => vec![cut(0, 0), cut(1, 0), cut(2, 0)],
            _ => return,
        };
        let middle = |e: &[End]| e.iter().map(|e| e.1).sum::<DVec3>() / e.len() as f64;
        let outwards = middle(&outside) - middle(&inside);
        let corners: Vec<DVec3> = polygon.iter().map(|&v| self.mesh.vertices[v as usize]).collect();
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        for k in 1..polygon.len() - 1 {
            let [a, b, c] = [polygon[0], polygon[k], polygon[k + 1]];
            self.mesh.triangles.push(if normal.dot(outwards) > 0.0 {
                [a, b, c]
            } else {
                [a, c, b]
            });
        }
    }

    /// The vertex between a corner inside and one outside.
    fn vertex(&mut self, a: End, b: End) -> u32 {
        /// Vertices stay this far from corners, so that no triangle vanishes.
        const CLEAR: f64 = 0.04;
        *self.known.entry((a.0, b.0)).or_insert_with(|| {
            let t = (a.2 / (a.2 - b.2)).clamp(CLEAR, 1.0 - CLEAR);
            self.mesh.vertices.push(a.1.lerp(b.1, t));
            (self.mesh.vertices.len() - 1) as u32
        })
    }
}
