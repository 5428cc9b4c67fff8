//! View3D's files of vertices and surfaces (`.vs3`; Walton 2002, "Calculation of Obstructed View
//! Factors by Adaptive Integration", NISTIR 6925).
//!
//! Surfaces are one-sided triangles and quadrilaterals, counter-clockwise seen from the front.
//! Obstructions only block. A surface that lies in another takes its part of it. Reflectance is 1
//! less the emittance, in the material as it is: it is only what light is computed with that is
//! clamped.
//!
//! # Deviations
//! Quadrilaterals may have dents, and need not be plane. Mask and null surfaces are refused, and so
//! are emittances that are not from 0 to 1.

mod control;
mod parse;
mod shape;
mod subtract;
#[cfg(test)]
mod tests;
mod words;

use std::collections::HashMap;
use std::collections::hash_map::Entry;

use glam::DVec3;

use super::builder::SceneBuilder;
use super::geometry::{Sides, Surface, is_degenerate, position_key};
use super::hash::Mixed;
use super::optics::Material;
use super::polygon::triangulate;
use super::source::{ImportError, Place, Source};
use super::{Rgb, Severity};
use parse::{File, Polygon};
use subtract::{Misfit, Parts};

pub use control::{Control, OutputFormat};

/// A surface that exchanges radiation.
#[derive(Debug, Clone, PartialEq)]
pub struct Radiating {
    /// Its name; its number if it has none.
    pub name: String,
    /// From .001 to .999.
    pub emittance: f64,
    /// Mean of its corners, in the file's unit.
    pub centre: DVec3,
    /// The surface whose row and column its own are added to, from 0.
    pub combined: Option<usize>,
}

/// What a View3D file says beside its geometry, whose surfaces are those of the file in order.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Read {
    pub title: String,
    pub control: Control,
    pub surfaces: Vec<Radiating>,
}

/// Quadrilaterals whose corners are farther from one plane than this share of their size are bent.
const BENT: f64 = 3e-6;

/// Reads a View3D file.
pub(super) fn read(source: &Source<'_>, builder: &mut SceneBuilder) -> Result<Read, ImportError> {
    let file = parse::parse(source, builder)?;
    for (number, polygon) in (1..).zip(&file.surfaces) {
        shape::check(source, number, polygon)?;
    }
    let whole: Vec<Parts> = file.surfaces.iter().map(|p| Parts::new(&p.corners)).collect();
    let within = within(source, &file, &whole)?;
    let mut mesh = Mesh::new(builder);
    let mut parts = 0;
    for (i, (polygon, inside)) in file.surfaces.iter().zip(&within).enumerate() {
        if whole[i].bend() > BENT {
            mesh.builder.finding(
                Severity::Warning,
                format!("line {}", polygon.line),
                "its corners are not in one plane; it is folded along a diagonal",
                "divide it into triangles",
            );
        }
        mesh.begin(i, polygon);
        if inside.is_empty() {
            mesh.polygon(&polygon.corners);
            mesh.end(polygon);
            continue;
        }
        let mut left = Parts::new(&polygon.corners);
        let holes: Vec<&Parts> = inside.iter().map(|&hole| &whole[hole]).collect();
        let most = |parts| source.check_size(parts, "parts", || Place::Line(polygon.line));
        left.subtract(&holes, |more| most(parts + more))?;
        parts += left.convex.len();
        if left.convex.is_empty() && polygon.face.is_some() {
            let problem = format!("surface {} is wholly taken up by what lies in it", i + 1);
            let remedy = "leave it out, and give 0 as the base surface of what lies in it";
            return Err(source.malformed(Place::Line(polygon.line), problem, remedy));
        }
        left.convex.iter().for_each(|part| mesh.polygon(part));
        mesh.end(polygon);
    }
    let (title, control) = (file.title, file.control);
    let surfaces = file.surfaces.into_iter().zip(whole).filter_map(|(polygon, parts)| {
        let face = polygon.face?;
        let (name, emittance, combined) = (face.name, face.emittance, face.combined);
        Some(Radiating { name, emittance, centre: parts.centre, combined })
    });
    Ok(Read { title, control, surfaces: surfaces.collect() })
}

/// The surfaces that lie in each surface.
fn within(
    source: &Source<'_>,
    file: &File,
    whole: &[Parts],
) -> Result<Vec<Vec<usize>>, ImportError> {
    let mut within = vec![Vec::new(); file.surfaces.len()];
    for (i, polygon) in file.surfaces.iter().enumerate() {
        let Some(base) = polygon.face.as_ref().and_then(|f| f.base) else { continue };
        let (own, other) = (i + 1, base + 1);
        if let Err(misfit) = whole[base].holds(&whole[i]) {
            let (problem, remedy) = match misfit {
                Misfit::Plane => (
                    format!("surface {own} is not in the plane of its base surface {other}"),
                    "move it there, or give 0 as its base surface",
                ),
                Misfit::Facing => (
                    format!("surface {own} faces another way than its base surface {other}"),
                    "turn the order of its vertices round",
                ),
                Misfit::Outline => (
                    format!("surface {own} is not wholly within its base surface {other}"),
                    "move or shrink it, or give 0 as its base surface",
                ),
            };
            return Err(source.malformed(Place::Line(polygon.line), problem, remedy));
        }
        within[base].push(i);
    }
    Ok(within)
}

/// What is wrong with triangles of a surface.
#[derive(Default)]
struct Flaws {
    /// They are those of an earlier surface.
    repeated: bool,
    /// Their normals are rounding.
    thin: bool,
}

/// Adds triangles to a scene.
struct Mesh<'a> {
    builder: &'a mut SceneBuilder,
    vertices: HashMap<[u64; 3], u32, Mixed>,
    /// By the bits of their emittance; obstructions have none.
    materials: HashMap<Option<u64>, u32>,
    /// Triangles that exchange radiation, from their least vertex on, and whether they were halved.
    known: HashMap<[u32; 3], bool>,
    /// Why triangles of the surface exchange nothing.
    flaws: Flaws,
    surface: u32,
    material: u32,
    sides: Sides,
}

impl<'a> Mesh<'a> {
    fn new(builder: &'a mut SceneBuilder) -> Self {
        Self {
            builder,
            vertices: HashMap::default(),
            materials: HashMap::new(),
            known: HashMap::new(),
            flaws: Flaws::default(),
            surface: 0,
            material: 0,
            sides: Sides::None,
        }
    }

    /// The triangles that follow are of this surface.
    fn begin(&mut self, index: usize, polygon: &Polygon) {
        let (builder, face) = (&mut *self.builder, polygon.face.as_ref());
        let emittance = face.map(|f| f.emittance);
        let material = || {
            builder.material(Material {
                name: emittance.map_or("obstruction".into(), |e| format!("emittance {e}")),
                reflectance: Rgb::splat(emittance.map_or(0.0, |e| 1.0 - e)),
                ..Material::default()
            })
        };
        self.material = *self.materials.entry(emittance.map(f64::to_bits)).or_insert_with(material);
        let name = face.map_or_else(|| format!("obstruction {}", index + 1), |f| f.name.clone());
        self.surface = builder.surface(Surface { name, node: 0, primitive: 0 });
        self.sides = if face.is_some() { Sides::One } else { Sides::None };
        self.flaws = Flaws::default();
    }

    /// Says what of the surface exchanges nothing.
    fn end(&mut self, polygon: &Polygon) {
        let mut warn = |message: &str, remedy: &str| {
            let place = format!("line {}", polygon.line);
            self.builder.finding(Severity::Warning, place, message, remedy);
        };
        if self.flaws.repeated {
            warn(
                "is an earlier surface again, or a part of one; it exchanges nothing there",
                "leave it out, or turn its vertices round if it faces the other way",
            );
        }
        if self.flaws.thin {
            warn(
                "is so thin, or a part of it, that it exchanges nothing there",
                "leave it out, or join it to its neighbour",
            );
        }
    }

    fn vertex(&mut self, position: DVec3) -> u32 {
        let builder = &mut self.builder;
        *self.vertices.entry(position_key(position)).or_insert_with(|| builder.vertex(position))
    }

    fn polygon(&mut self, corners: &[DVec3]) {
        // From its least vertex on, so that the same surface has the same triangles.
        let numbers = corners.iter().map(|&c| self.vertex(c));
        let mut corners: Vec<(u32, DVec3)> = numbers.zip(corners.iter().copied()).collect();
        let least = corners.iter().enumerate().min_by_key(|(_, c)| c.0).map_or(0, |(i, _)| i);
        corners.rotate_left(least);
        let (numbers, corners): (Vec<u32>, Vec<DVec3>) = corners.into_iter().unzip();
        for triangle in triangulate(&corners).0 {
            let vertices = triangle.map(|i| numbers[i]);
            let corners = triangle.map(|i| corners[i]);
            if self.sides != Sides::One {
                self.triangle(vertices);
                continue;
            }
            self.flaws.thin |= is_degenerate(corners);
            let [a, b, c] = vertices;
            let sheet = self.known.contains_key(&from_least([a, c, b]));
            let halved = match self.known.entry(from_least(vertices)) {
                // Flagged as a duplicate if it is cut as the first is.
                Entry::Occupied(first) => {
                    self.flaws.repeated = true;
                    *first.get()
                }
                Entry::Vacant(new) => *new.insert(sheet),
            };
            if halved {
                self.halves(corners, vertices);
            } else {
                self.triangle(vertices);
            }
        }
    }

    /// Two surfaces back to back are the sides of a sheet. As the same triangle, one of them would
    /// be a duplicate of the other.
    fn halves(&mut self, corners: [DVec3; 3], vertices: [u32; 3]) {
        let length = |k: usize| corners[k].distance_squared(corners[(k + 1) % 3]);
        let longest = (1..3).fold(0, |best, k| if length(k) > length(best) { k } else { best });
        let [i, j, k] = [0, 1, 2].map(|n| (longest + n) % 3);
        let middle = self.vertex(0.5 * (corners[i] + corners[j]));
        self.triangle([vertices[i], middle, vertices[k]]);
        self.triangle([middle, vertices[j], vertices[k]]);
    }

    fn triangle(&mut self, vertices: [u32; 3]) {
        self.builder.triangle(vertices, None, self.surface, self.material, self.sides);
    }
}

/// The same triangle, from its least vertex on.
fn from_least(mut triangle: [u32; 3]) -> [u32; 3] {
    let least = (1..3).fold(0, |best, k| if triangle[k] < triangle[best] { k } else { best });
    triangle.rotate_left(least);
    triangle
}
