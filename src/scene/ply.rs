//! PLY (Stanford, Turk 1994), as text and binary of either byte order.
//!
//! Read are the positions of `vertex` and the corners of `face`; other elements and properties are
//! passed over. PLY as commonly written knows neither materials nor sidedness: both sides reflect.

mod header;
#[cfg(test)]
mod tests;
mod values;

use glam::DVec3;

use super::Severity;
use super::builder::SceneBuilder;
use super::polygon;
use super::soup::Soup;
use super::source::{EXPORT_AGAIN, ImportError, Source};
use header::{Element, Header, Property};
use values::Values;

/// Names of the list of a face's corners.
const CORNERS: [&str; 2] = ["vertex_indices", "vertex_index"];

/// Reads a PLY file.
pub(super) fn read(source: &Source<'_>, builder: &mut SceneBuilder) -> Result<(), ImportError> {
    let header = Header::read(source)?;
    let mut values = Values::new(source, &header);
    let mut mesh = Mesh {
        source,
        soup: Soup::new(builder, "PLY"),
        positions: Vec::new(),
        vertices: Vec::new(),
        small: 0,
    };
    for element in &header.elements {
        match element.name.as_str() {
            "vertex" => mesh.read_vertices(element, &mut values)?,
            "face" => mesh.read_faces(element, &mut values)?,
            "tristrips" => {
                let problem = "strips of triangles are not read";
                return Err(source.malformed(element.place(), problem, "export faces instead"));
            }
            _ if element.properties.is_empty() => {}
            _ => (0..element.count).try_for_each(|i| pass(element, i, &mut values, |_, _| ()))?,
        }
    }
    if mesh.small > 0 {
        let message = format!("{} faces of fewer than three corners are left out", mesh.small);
        mesh.soup.builder.finding(Severity::Note, "whole model", message, "");
    }
    Ok(())
}

/// Reads one item of an element; `take` hears of each number which property it is of.
fn pass(
    element: &Element,
    item: u64,
    values: &mut Values<'_>,
    mut take: impl FnMut(usize, f64),
) -> Result<(), ImportError> {
    values.begin(element, item);
    for (p, property) in element.properties.iter().enumerate() {
        let count = match property.count {
            Some(kind) => values.count(kind)?,
            None => 1,
        };
        for _ in 0..count {
            take(p, values.number(property.kind)?);
        }
    }
    values.end()
}

struct Mesh<'a, 'b> {
    source: &'a Source<'a>,
    soup: Soup<'b>,
    positions: Vec<DVec3>,
    /// The scene's vertex of each.
    vertices: Vec<u32>,
    small: usize,
}

impl Mesh<'_, '_> {
    fn read_vertices(
        &mut self,
        element: &Element,
        values: &mut Values<'_>,
    ) -> Result<(), ImportError> {
        let limit = usize::try_from(element.count).unwrap_or(usize::MAX);
        self.source.check_size(limit, "vertices", || element.place())?;
        let mut axis_of = vec![None; element.properties.len()];
        for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
            let scalar = |p: &Property| p.name == name && p.count.is_none();
            let Some(at) = element.properties.iter().position(scalar) else {
                let problem = format!("has no property {name}");
                return Err(self.source.malformed(element.place(), problem, EXPORT_AGAIN));
            };
            axis_of[at] = Some(axis);
        }
        for i in 0..element.count {
            let mut position = DVec3::ZERO;
            pass(element, i, values, |p, number| {
                if let Some(axis) = axis_of[p] {
                    position[axis] = number;
                }
            })?;
            if !position.is_finite() {
                return Err(values.wrong("a coordinate is not a finite number"));
            }
            self.positions.push(position);
            self.vertices.push(self.soup.vertex(position));
        }
        Ok(())
    }

    fn read_faces(
        &mut self,
        element: &Element,
        values: &mut Values<'_>,
    ) -> Result<(), ImportError> {
        let is_corners = |p: &Property| CORNERS.contains(&p.name.as_str()) && p.count.is_some();
        let Some(list) = element.properties.iter().position(is_corners) else {
            let problem = "has no list vertex_indices";
            return Err(self.source.malformed(element.place(), problem, EXPORT_AGAIN));
        };
        let surface = self.soup.surface("default");
        let mut corners = Vec::new();
        for i in 0..element.count {
            corners.clear();
            pass(element, i, values, |p, number| {
                if p == list {
                    corners.push(number);
                }
            })?;
            self.add_face(&corners, surface, values)?;
            self.source.check_size(self.soup.triangles(), "triangles", || values.place())?;
        }
        Ok(())
    }

    fn add_face(
        &mut self,
        corners: &[f64],
        surface: u32,
        values: &Values<'_>,
    ) -> Result<(), ImportError> {
        let known = self.positions.len();
        let mut indices = Vec::with_capacity(corners.len());
        for &corner in corners {
            if !(0.0..known as f64).contains(&corner) || corner.fract() != 0.0 {
                let problem =
                    format!("vertex {corner} does not exist: the file has {known}, from 0");
                return Err(values.wrong(problem));
            }
            indices.push(corner as usize);
        }
        if indices.len() < 3 {
            self.small += 1;
            return Ok(());
        }
        let positions: Vec<DVec3> = indices.iter().map(|&i| self.positions[i]).collect();
        let (triangles, tiled) = polygon::triangulate(&positions);
        if !tiled {
            self.soup.builder.finding(
                Severity::Warning,
                values.place().to_string(),
                format!("a face of {} corners that is not convex was fanned", indices.len()),
                "triangulate the model when exporting it",
            );
        }
        for triangle in triangles {
            self.soup.triangle(triangle.map(|k| self.vertices[indices[k]]), surface);
        }
        Ok(())
    }
}
