//! A furnished room as strangers model it, with all that is hard at contacts: thin legs, books that
//! stand close together, a sofa without a bottom, balls that touch floor and table, a panel that
//! hangs just under the ceiling, and a small lamp that stands on a table. Surfaces are two-sided,
//! as those of a file that does not say.

use std::fmt::Write;

use glam::{DVec3, dvec3};
use hemicube::scene::builtin::Mesh;
use hemicube::scene::{Camera, Material, Rgb, Scene, SceneBuilder, Sides};

/// Width, height and depth (m); one corner is the origin.
const SIZE: DVec3 = dvec3(4.4, 2.6, 3.8);

/// Height of the table's top and of the side table's (m).
const TABLE: f64 = 0.74;
const SIDE_TABLE: f64 = 0.5;

/// Pieces of the shelf are that thick (m).
const BOARD: f64 = 0.022;

/// The room; balls have 20 `detail`² triangles and more, so 8 makes about 8,000 in all.
pub fn furnished(detail: u32) -> Scene {
    let mut b = Build { builder: SceneBuilder::new("furnished") };
    b.room();
    b.table(detail);
    b.shelf();
    b.sofa(detail);
    b.balls(detail);
    let name = "main".into();
    let camera = Camera::at(dvec3(0.35, 1.55, 3.5), dvec3(2.6, 0.75, 1.0));
    b.builder.camera(Camera { name, vfov: 62_f64.to_radians(), aspect: Some(4.0 / 3.0), ..camera });
    b.builder.finish()
}

struct Build {
    builder: SceneBuilder,
}

/// A box by its size, standing on y = 0.
fn block(x: f64, y: f64, z: f64) -> Mesh {
    Mesh::cuboid(dvec3(x, y, z), [1; 3])
}

impl Build {
    fn paint(&mut self, name: &str, reflectance: [f64; 3], radiance: [f64; 3]) -> u32 {
        self.builder.material(Material {
            name: name.into(),
            reflectance: Rgb::from_array(reflectance),
            radiance: Rgb::from_array(radiance),
            ..Material::default()
        })
    }

    fn add(&mut self, name: &str, paint: u32, mesh: &Mesh) {
        self.builder.mesh(name, &mesh.vertices, &mesh.triangles, paint, Sides::Two);
    }

    /// The walls, the panel and its housing.
    fn room(&mut self) {
        let plaster = self.paint("plaster", [0.78, 0.76, 0.72], [0.0; 3]);
        let floor = self.paint("floor", [0.45, 0.34, 0.24], [0.0; 3]);
        let shell = Mesh::cuboid(SIZE, [1; 3]).inverted().at(0.5 * SIZE.x, 0.0, 0.5 * SIZE.z);
        let flat = |t: &[u32; 3]| t.iter().all(|&v| shell.vertices[v as usize].y < 1e-9);
        let (down, up) = shell.triangles.iter().partition(|t| flat(t));
        self.add("floor", floor, &Mesh { vertices: shell.vertices.clone(), triangles: down });
        self.add("walls", plaster, &Mesh { vertices: shell.vertices.clone(), triangles: up });

        let metal = self.paint("metal", [0.5; 3], [0.0; 3]);
        let glow = self.paint("panel", [0.6; 3], [30.0, 28.0, 25.0]);
        let [x, y, z] = [2.2, SIZE.y - 0.05 - 0.02, 1.9];
        let housing = block(1.2, 0.02, 0.3).open_towards(DVec3::NEG_Y);
        self.add("panel housing", metal, &housing.at(x, y, z));
        let [u, v] = [0.6, 0.15];
        let corners = [[-u, -v], [u, -v], [u, v], [-u, v]].map(|[u, v]| dvec3(x + u, y, z + v));
        self.add("panel", glow, &Mesh::from_quads(corners.to_vec(), &[[0, 1, 2, 3]]));
    }

    /// The table on four thin legs, its chairs, and what stands on it.
    fn table(&mut self, detail: u32) {
        let oak = self.paint("oak", [0.5, 0.36, 0.22], [0.0; 3]);
        let red = self.paint("red lacquer", [0.6, 0.15, 0.1], [0.0; 3]);
        let clay = self.paint("clay", [0.6, 0.4, 0.3], [0.0; 3]);
        let [x, z] = [2.75, 1.75];
        let top = 0.03;
        let mut parts = vec![block(1.4, top, 0.8).at(0.0, TABLE - top, 0.0)];
        for [u, v] in [[-1.0, -1.0], [-1.0, 1.0], [1.0, -1.0], [1.0, 1.0]] {
            parts.push(block(0.025, TABLE - top, 0.025).at(u * 0.65, 0.0, v * 0.35));
        }
        self.add("table", oak, &Mesh::joined(parts).at(x, 0.0, z));
        for (k, (u, v, turn)) in
            [(-0.35, 0.5, 180.0), (0.35, 0.55, 172.0), (-0.3, -0.5, 5.0), (0.4, -0.55, -4.0)]
                .into_iter()
                .enumerate()
        {
            self.add(&format!("chair {}", k + 1), red, &chair().turned(turn).at(x + u, 0.0, z + v));
        }
        let profile = [[0.0, 0.0], [0.05, 0.0], [0.08, 0.09], [0.03, 0.2], [0.045, 0.24]]
            .into_iter()
            .chain([[0.035, 0.24], [0.02, 0.2], [0.06, 0.09], [0.0, 0.02]])
            .map(glam::DVec2::from_array);
        let vase = Mesh::lathe(&profile.collect::<Vec<_>>(), 2 * detail.max(4));
        self.add("vase", clay, &vase.at(x + 0.5, TABLE, z - 0.2));
    }

    /// A shelf with a back against the wall, and books with gaps of 1 to 4 mm between them.
    fn shelf(&mut self) {
        let birch = self.paint("birch", [0.66, 0.56, 0.42], [0.0; 3]);
        let covers = [
            self.paint("linen", [0.7, 0.65, 0.52], [0.0; 3]),
            self.paint("burgundy", [0.4, 0.12, 0.14], [0.0; 3]),
            self.paint("navy", [0.16, 0.2, 0.4], [0.0; 3]),
        ];
        let (wide, deep, rise) = (1.2, 0.28, 0.36);
        // Its back is to -z.
        let place = |mesh: Mesh| mesh.at(1.3, 0.0, 0.0);
        let side = |x: f64| block(BOARD, 5.0 * rise + BOARD, deep).at(x, 0.0, 0.5 * deep);
        let inner = wide - 2.0 * BOARD;
        let mut parts = vec![side(0.5 * (BOARD - wide)), side(0.5 * (wide - BOARD))];
        parts.extend(
            (0..=5).map(|k| block(inner, BOARD, deep).at(0.0, f64::from(k) * rise, 0.5 * deep)),
        );
        self.add("shelf", birch, &place(Mesh::joined(parts)));
        let mut number = 0_u32;
        for board in 0..5 {
            let mut left = -0.5 * inner;
            for _ in 0..[16, 12, 18, 9, 14][board as usize] {
                // Whole steps of a fixed pattern stand in for chance.
                let step = |modulus: u32, factor: u32| f64::from(number * factor % modulus);
                let (x, y, z) =
                    (0.02 + 0.006 * step(5, 3), 0.2 + 0.02 * step(7, 4), 0.15 + 0.01 * step(6, 5));
                left += 0.001 + 0.001 * step(4, 3);
                let floor = f64::from(board) * rise + BOARD;
                let book = block(x, y, z).at(left + 0.5 * x, floor, 0.05 + 0.5 * z);
                let cover = covers[(number * number + number / 3) as usize % covers.len()];
                self.add(&format!("book {}", number + 1), cover, &place(book));
                left += x;
                number += 1;
            }
        }
    }

    /// A sofa without a bottom, and a side table with a small lamp.
    fn sofa(&mut self, detail: u32) {
        let cloth = self.paint("cloth", [0.3, 0.4, 0.45], [0.0; 3]);
        let steel = self.paint("steel", [0.45; 3], [0.0; 3]);
        let glow = self.paint("small lamp", [0.6; 3], [80.0, 66.0, 48.0]);
        // It looks towards -x.
        let place = |mesh: Mesh| mesh.turned(-90.0).at(SIZE.x - 0.4, 0.0, 1.5);
        let body = block(1.7, 0.4, 0.75).open_towards(DVec3::NEG_Y);
        let back = block(1.7, 0.4, 0.18).open_towards(DVec3::NEG_Y).at(0.0, 0.4, -0.285);
        let arm = |x: f64| block(0.16, 0.2, 0.57).open_towards(DVec3::NEG_Y).at(x, 0.4, 0.09);
        let sofa = Mesh::joined([body, back, arm(-0.77), arm(0.77)]);
        self.add("sofa", cloth, &place(sofa));
        for x in [-0.35, 0.35] {
            let cushion = Mesh::geodesic(0.5, detail.div_ceil(2));
            let flat = glam::DAffine3::from_scale(dvec3(0.6, 0.14, 0.5));
            let cushion = cushion.placed(flat).resting_on(0.4).at(x, 0.0, 0.09);
            self.add("cushion", cloth, &place(cushion));
        }
        let profile = [[0.0, 0.0], [0.14, 0.0], [0.14, 0.012], [0.012, 0.02], [0.012, 0.48]]
            .into_iter()
            .chain([[0.2, 0.48], [0.2, SIDE_TABLE], [0.0, SIDE_TABLE]])
            .map(glam::DVec2::from_array);
        let table = Mesh::lathe(&profile.collect::<Vec<_>>(), 2 * detail.max(4));
        let [x, z] = [3.95, 2.85];
        self.add("side table", steel, &table.at(x, 0.0, z));
        self.add("small lamp", glow, &block(0.06, 0.06, 0.06).turned(20.0).at(x, SIDE_TABLE, z));
    }

    fn balls(&mut self, detail: u32) {
        let white = self.paint("white ball", [0.8; 3], [0.0; 3]);
        let orange = self.paint("orange", [0.75, 0.4, 0.1], [0.0; 3]);
        for (k, ([x, z], radius)) in
            [([1.2, 2.3], 0.2), ([1.62, 2.1], 0.12), ([3.3, 3.2], 0.3)].into_iter().enumerate()
        {
            let ball = Mesh::geodesic(radius, detail).resting_on(0.0);
            self.add(&format!("ball {}", k + 1), white, &ball.at(x, 0.0, z));
        }
        for (k, [x, z]) in [[2.6, 1.7], [2.683, 1.7], [2.64, 1.775]].into_iter().enumerate() {
            let ball = Mesh::geodesic(0.04, detail.div_ceil(2)).resting_on(TABLE);
            self.add(&format!("orange {}", k + 1), orange, &ball.at(x, 0.0, z));
        }
    }
}

/// A chair with a seat at .45 m and its back to -z, on four thin legs.
fn chair() -> Mesh {
    let (width, seat, thick, leg) = (0.42, 0.45, 0.03, 0.025);
    let side = 0.5 * (width - leg);
    let mut parts = vec![block(width, thick, width).at(0.0, seat - thick, 0.0)];
    for [u, v] in [[-1.0, -1.0], [-1.0, 1.0], [1.0, -1.0], [1.0, 1.0]] {
        parts.push(block(leg, seat - thick, leg).at(u * side, 0.0, v * side));
    }
    for u in [-1.0, 1.0] {
        parts.push(block(leg, 0.4, leg).at(u * side, seat, -side));
    }
    for y in [0.14, 0.3] {
        parts.push(block(width - 2.0 * leg, 0.08, 0.015).at(0.0, seat + y, -side));
    }
    Mesh::joined(parts)
}

/// A scene as OBJ, and its materials as MTL in a file of the name given; textures and lamps are
/// left out.
pub fn as_obj(scene: &Scene, materials: &str) -> (String, String) {
    let (g, optics) = (&scene.geometry, &scene.optics);
    let (mut obj, mut mtl) = (format!("mtllib {materials}\n"), String::new());
    for v in &g.vertices {
        let _ = writeln!(obj, "v {:.6} {:.6} {:.6}", v.x, v.y, v.z);
    }
    let mut last = None;
    for t in g.ids().map(|t| t.index()) {
        let (surface, material) = (g.surface_of[t], optics.material_of[t]);
        if last != Some((surface, material)) {
            last = Some((surface, material));
            let name = g.surfaces[surface as usize].name.replace(' ', "_");
            let paint = optics.materials[material as usize].name.replace(' ', "_");
            let _ = writeln!(obj, "o {name}\nusemtl {paint}");
        }
        let [a, b, c] = g.triangles[t].map(|v| v + 1);
        let _ = writeln!(obj, "f {a} {b} {c}");
    }
    for m in &optics.materials {
        let (kd, ke) = (m.reflectance, m.radiance);
        let _ = writeln!(
            mtl,
            "newmtl {}\nKd {} {} {}\nKe {} {} {}",
            m.name.replace(' ', "_"),
            kd.x,
            kd.y,
            kd.z,
            ke.x,
            ke.y,
            ke.z
        );
    }
    (obj, mtl)
}
