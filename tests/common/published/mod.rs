//! View factors with published or exact values, as scenes and what is known of them.
//!
//! The tests and the page of the documentation share them. A curved body is a polyhedron here,
//! whose own exact value is what the engine must reach; beside it stands that of the body.

mod bodies;
mod cavities;
pub mod formulas;
mod obstructed;
mod plates;

use std::error::Error;
use std::time::Instant;

use glam::{DMat3, DVec3};
use hemicube::matrix::Rows;
use hemicube::scene::builtin::Mesh;
use hemicube::scene::{Material, Scene, Side, SidesChoice};
use hemicube::{MatrixOptions, Silent};

/// A scene, and what is known of it.
pub struct Case {
    /// What it is.
    pub name: &'static str,
    /// Who published it.
    pub source: &'static str,
    /// The surfaces, which figures speak of by number.
    pub surfaces: Vec<Mesh>,
    /// What is known.
    pub figures: Vec<Figure>,
    /// Whether something stands in between.
    pub obstructed: bool,
    /// Whether backs exchange light too: bodies in the open, whose fronts see nothing else, would
    /// pass for rooms that are turned inside out.
    pub two_sided: bool,
    /// Largest area of a patch where the case is split, m².
    pub patch_size: f64,
}

/// The view factor from some surfaces to others.
pub struct Figure {
    /// Which it is, where a case has several; may be empty.
    pub name: &'static str,
    pub from: Vec<usize>,
    pub to: Vec<usize>,
    /// Exact value of what stands in the scene.
    pub exact: f64,
    /// Exact value of the curved body that it stands for.
    pub curved: Option<f64>,
}

/// What was found of a case.
pub struct Found {
    /// The view factor of each figure.
    pub factors: Vec<f64>,
    /// What the engine says it errs by, as a fraction of the root mean square of all factors.
    pub stated: f64,
    /// Rows of the matrix.
    pub rows: usize,
    pub seconds: f64,
}

/// All cases, in groups of a name.
pub fn groups() -> [(&'static str, Vec<Case>); 4] {
    [
        ("Plane surfaces", plates::cases()),
        ("Plane surfaces with something in between", obstructed::cases()),
        ("Curved bodies, and bodies in enclosures", bodies::cases()),
        ("Cavities: what their walls see of themselves", cavities::cases()),
    ]
}

/// All cases.
pub fn cases() -> Vec<Case> {
    groups().into_iter().flat_map(|g| g.1).collect()
}

impl Case {
    /// A case of one figure, from surface 0 to surface 1, with nothing in between.
    fn pair(name: &'static str, source: &'static str, surfaces: Vec<Mesh>, exact: f64) -> Self {
        Self {
            name,
            source,
            surfaces,
            figures: vec![Figure::new("", 0, 1, exact)],
            obstructed: false,
            two_sided: false,
            patch_size: 0.02,
        }
    }

    /// What a figure may be off by.
    pub fn bound(&self, figure: &Figure) -> f64 {
        /// Where nothing is in between.
        const OPEN: f64 = 1e-5;
        /// Where something is, as a fraction.
        const OBSTRUCTED: f64 = 3e-3;
        if self.obstructed { OBSTRUCTED * figure.exact } else { OPEN }
    }

    /// Has the exact engine make the matrix, by the front door of the library. The scene is turned
    /// by `turn`; `single` rounds it to single precision; `patch_size` splits it, m².
    ///
    /// # Errors
    /// If the scene or the matrix cannot be made.
    pub fn run(
        &self,
        turn: DMat3,
        single: bool,
        patch_size: Option<f64>,
    ) -> Result<Found, Box<dyn Error>> {
        let (mut vertices, mut faces, mut surface_of) = (Vec::new(), Vec::new(), Vec::new());
        for (k, mesh) in self.surfaces.iter().enumerate() {
            let base = vertices.len() as u32;
            vertices.extend(mesh.vertices.iter().map(|&v| {
                let at = turn * v;
                if single { at.as_vec3().as_dvec3().to_array() } else { at.to_array() }
            }));
            faces.extend(mesh.triangles.iter().map(|t| t.map(|v| base + v)));
            surface_of.resize(faces.len(), k);
        }
        let mut scene = Scene::from_arrays(&vertices, &faces, &[Material::default()], &[])?;
        scene.choose_sides(if self.two_sided { SidesChoice::Two } else { SidesChoice::One });
        let start = Instant::now();
        let options = MatrixOptions { patch_size, ..MatrixOptions::default() };
        let matrix = scene.form_factors(&options, &Silent)?;
        let seconds = start.elapsed().as_secs_f64();

        // Exchange between surfaces, of fronts alone.
        let front = |i: usize| matrix.layout.faces[i].side == Side::Front;
        let surface = |i: usize| surface_of[matrix.layout.faces[i].triangle.index()];
        let n = self.surfaces.len();
        let (mut areas, mut exchange) = (vec![0.0; n], vec![vec![0.0; n]; n]);
        let (mut columns, mut values) = (Vec::new(), Vec::new());
        for i in (0..matrix.len()).filter(|&i| front(i)) {
            areas[surface(i)] += matrix.area(i);
            matrix.row(i, &mut columns, &mut values)?;
            for (j, f) in columns.iter().map(|&j| j as usize).zip(&values) {
                if front(j) {
                    exchange[surface(i)][surface(j)] += matrix.area(i) * f;
                }
            }
        }
        let factor = |f: &Figure| {
            let area: f64 = f.from.iter().map(|&i| areas[i]).sum();
            let to = |i: usize| f.to.iter().map(|&j| exchange[i][j]).sum::<f64>();
            f.from.iter().map(|&i| to(i)).sum::<f64>() / area
        };
        Ok(Found {
            factors: self.figures.iter().map(factor).collect(),
            stated: matrix.report.pairs.map_or(0.0, |p| p.error),
            rows: matrix.len(),
            seconds,
        })
    }
}

impl Figure {
    fn new(name: &'static str, from: usize, to: usize, exact: f64) -> Self {
        Self { name, from: vec![from], to: vec![to], exact, curved: None }
    }

    /// A figure of a polyhedron that stands for a curved body.
    fn of_curved(name: &'static str, from: usize, to: usize, exact: f64, curved: f64) -> Self {
        Self { curved: Some(curved), ..Self::new(name, from, to, exact) }
    }
}

/// A rectangle by a corner and two edges; its front is `u` × `v`.
fn rectangle(corner: DVec3, u: DVec3, v: DVec3) -> Mesh {
    Mesh::from_quads(vec![corner, corner + u, corner + u + v, corner + v], &[[0, 1, 2, 3]])
}

/// A rectangle [x0, x1] × [y0, y1] at height `z` that faces up or down.
fn level([x0, x1, y0, y1]: [f64; 4], z: f64, up: bool) -> Mesh {
    let (u, v) = (DVec3::X * (x1 - x0), DVec3::Y * (y1 - y0));
    let mesh = rectangle(DVec3::new(x0, y0, z), u, v);
    if up { mesh } else { mesh.inverted() }
}

/// m².
fn area(mesh: &Mesh) -> f64 {
    polygons(mesh).iter().map(|[a, b, c]| 0.5 * (b - a).cross(c - a).length()).sum()
}

/// The corners of the triangles.
fn polygons(mesh: &Mesh) -> Vec<[DVec3; 3]> {
    mesh.triangles.iter().map(|t| t.map(|v| mesh.vertices[v as usize])).collect()
}
