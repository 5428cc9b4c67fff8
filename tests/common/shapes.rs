//! Models of plain shapes in one grey material, both of whose sides reflect.

use std::f64::consts::{PI, TAU};

use glam::DVec3;
use hemicube::Scene;
use hemicube::scene::builtin::Mesh;
use hemicube::scene::{Camera, Material, SceneBuilder, Sides};
use hemicube::visibility::Bvh;

/// A model in the making.
pub struct Shapes {
    builder: SceneBuilder,
    material: u32,
}

impl Shapes {
    /// Nothing yet.
    pub fn new(name: &str) -> Self {
        let mut builder = SceneBuilder::new(name);
        let material = builder.material(Material::default());
        Self { builder, material }
    }

    /// The model.
    pub fn scene(self) -> Scene {
        self.builder.finish()
    }

    fn mesh(mut self, vertices: &[DVec3], triangles: &[[u32; 3]]) -> Self {
        self.builder.mesh("shape", vertices, triangles, self.material, Sides::Two);
        self
    }

    fn quads(self, vertices: Vec<DVec3>, quads: &[[u32; 4]]) -> Self {
        let mesh = Mesh::from_quads(vertices, quads);
        self.mesh(&mesh.vertices, &mesh.triangles)
    }

    /// A box about a centre; a negative size turns its faces inwards.
    pub fn cuboid(self, centre: DVec3, size: DVec3) -> Self {
        self.quads(corners(centre, size), &FACES)
    }

    /// A sphere; a negative radius turns its faces inwards.
    pub fn sphere(self, centre: DVec3, radius: f64) -> Self {
        const N: u32 = 16;
        let at = |i: u32, j: u32| {
            let (theta, phi) =
                (f64::from(i) / f64::from(N) * PI, f64::from(j) / f64::from(2 * N) * TAU);
            let ring = DVec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin());
            centre + radius * ring
        };
        let mut vertices = Vec::new();
        let mut quads = Vec::new();
        for i in 0..N {
            for j in 0..2 * N {
                let first = vertices.len() as u32;
                vertices.extend([at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)]);
                quads.push([first, first + 1, first + 2, first + 3]);
            }
        }
        self.quads(vertices, &quads)
    }

    /// A quad with one corner and two edges.
    pub fn quad(self, corner: DVec3, x: DVec3, y: DVec3) -> Self {
        self.quads(vec![corner, corner + x, corner + x + y, corner + y], &[[0, 1, 2, 3]])
    }

    /// A square cup with thick walls, open above.
    pub fn cup(self, size: f64, wall: f64) -> Self {
        let outer = corners(DVec3::ZERO, DVec3::splat(size));
        let inner =
            corners(DVec3::Y * wall, DVec3::new(size - 2.0 * wall, size, size - 2.0 * wall));
        let inner = inner.into_iter().map(|v| v.min(DVec3::splat(0.5 * size)));
        let mut quads: Vec<[u32; 4]> = FACES.iter().filter(|f| **f != TOP).copied().collect();
        let within = FACES.iter().filter(|f| **f != TOP).map(|[a, b, c, d]| [d, c, b, a]);
        quads.extend(within.map(|f| f.map(|v| v + 8)));
        let [a, b, c, d] = TOP;
        for (p, q) in [(a, b), (b, c), (c, d), (d, a)] {
            quads.push([p, q, q + 8, p + 8]);
        }
        self.quads(outer.into_iter().chain(inner).collect(), &quads)
    }

    /// A room of 2 m whose side towards `front` is missing.
    pub fn open_room(self, front: DVec3) -> Self {
        let all = corners(DVec3::ZERO, DVec3::splat(-2.0));
        let is_front = |f: &&[u32; 4]| {
            let middle = f.iter().map(|&v| all[v as usize]).sum::<DVec3>() / 4.0;
            middle.dot(front) < 0.9
        };
        let quads: Vec<[u32; 4]> = FACES.iter().filter(is_front).copied().collect();
        self.quads(all, &quads)
    }

    /// A room of that size with a window in the middle of its wall towards +x.
    pub fn room_with_window(self, size: DVec3) -> Self {
        let all = corners(DVec3::ZERO, -size);
        let wall = FACES.iter().position(|f| f.iter().all(|&v| all[v as usize].x > 0.0));
        let Some(wall) = wall else { return self };
        let outline = FACES[wall];
        let hole = outline.map(|v| all[v as usize] * DVec3::new(1.0, 0.5, 0.5));
        let mut quads: Vec<[u32; 4]> =
            FACES.iter().enumerate().filter(|f| f.0 != wall).map(|f| *f.1).collect();
        for k in 0..4_u32 {
            let next = (k + 1) % 4;
            quads.push([outline[k as usize], outline[next as usize], 8 + next, 8 + k]);
        }
        self.quads(all.into_iter().chain(hole).collect(), &quads)
    }
}

const TOP: [u32; 4] = [2, 6, 7, 3];
const FACES: [[u32; 4]; 6] =
    [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], TOP, [0, 4, 6, 2], [1, 3, 7, 5]];

fn corners(centre: DVec3, size: DVec3) -> Vec<DVec3> {
    let at = |i: u32, n: u32| if i >> n & 1 == 1 { 0.5 } else { -0.5 };
    (0..8).map(|i| centre + size * DVec3::new(at(i, 0), at(i, 1), at(i, 2))).collect()
}

/// Share of the frame of a camera in which neither the model (its first triangles) nor the front of
/// anything else is seen.
pub fn outdoors_share(scene: &Scene, camera: &Camera, model: usize) -> f64 {
    const N: i32 = 24;
    let bvh = Bvh::new(&scene.geometry);
    let right = camera.forward.cross(camera.up).normalize();
    let above = right.cross(camera.forward);
    let edge = (0.5 * camera.vfov).tan();
    let at = |k: i32| (2.0 * f64::from(k) + 1.0) / f64::from(N) - 1.0;
    let missed = (0..N * N).filter(|k| {
        let (x, y) = (at(k % N) * edge * 4.0 / 3.0, at(k / N) * edge);
        let met = bvh.see(camera.eye, camera.forward + right * x + above * y, None);
        met.is_none_or(|m| m.triangle.index() >= model && m.side == hemicube::scene::Side::Back)
    });
    missed.count() as f64 / f64::from(N * N)
}
