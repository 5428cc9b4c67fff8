//! PLY (Stanford, Turk 1994), as text and binary of either byte order.
//!
//! Read are the positions and colours of `vertex` and the corners of `face` and `tristrips`; other
//! elements and properties are passed over. PLY as commonly written knows neither materials nor
//! sidedness: both sides reflect.

mod header;
#[cfg(test)]
mod tests;
mod values;

use glam::DVec3;

use super::builder::SceneBuilder;
use super::lines::shown;
use super::polygon;
use super::soup::Soup;
use super::source::{EXPORT_AGAIN, ImportError, Source};
use super::texture::linear_from_srgb;
use super::{Rgb, Severity};
use header::{Element, Header, Kind, Property};
use values::Values;

/// Names of the list of a face's corners.
const CORNERS: [&str; 2] = ["vertex_indices", "vertex_index"];

/// Reads a PLY file.
pub(super) fn read(source: &Source<'_>, builder: &mut SceneBuilder) -> Result<(), ImportError> {
    let header = Header::read(source)?;
    let mut values = Values::new(source, &header);
    let coloured = header.elements.iter().any(|e| e.name == "vertex" && channels(e).is_some());
    let mut mesh = Mesh {
        source,
        soup: Soup::new(builder, "PLY", coloured),
        positions: Vec::new(),
        vertices: Vec::new(),
        tints: Vec::new(),
        small: 0,
    };
    for element in &header.elements {
        match element.name.as_str() {
            "vertex" => mesh.read_vertices(element, &mut values)?,
            "face" => mesh.read_faces(element, &mut values)?,
            "tristrips" => mesh.read_strips(element, &mut values)?,
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
    /// What each multiplies reflectance with; empty without colours.
    tints: Vec<Rgb>,
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
        let channels = channels(element);
        for i in 0..element.count {
            let (mut position, mut colour) = (DVec3::ZERO, Rgb::ZERO);
            pass(element, i, values, |p, number| {
                if let Some(axis) = axis_of[p] {
                    position[axis] = number;
                }
                if let Some((of, scale)) = channels
                    && let Some(channel) = of.iter().position(|&at| at == p)
                {
                    colour[channel] = number / scale;
                }
            })?;
            if channels.is_some() {
                self.tints.push(linear_from_srgb(colour));
            }
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
        let surface = self.soup.surface("default");
        self.read_corners(element, values, |me, corners, values| {
            me.add_face(corners, surface, values)
        })
    }

    /// Hands over the corners that each item of an element lists.
    fn read_corners(
        &mut self,
        element: &Element,
        values: &mut Values<'_>,
        mut each: impl FnMut(&mut Self, &[f64], &Values<'_>) -> Result<(), ImportError>,
    ) -> Result<(), ImportError> {
        let list = self.corner_list(element)?;
        let mut corners = Vec::new();
        for i in 0..element.count {
            corners.clear();
            pass(element, i, values, |p, number| {
                if p == list {
                    corners.push(number);
                }
            })?;
            each(self, &corners, values)?;
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
        let indices = self.indices(corners, values)?;
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
            self.add_triangle(triangle.map(|k| indices[k]), surface);
        }
        Ok(())
    }

    fn add_triangle(&mut self, corners: [usize; 3], surface: u32) {
        self.soup.triangle(corners.map(|i| self.vertices[i]), surface);
        if !self.tints.is_empty() {
            self.soup.builder.tint(corners.iter().map(|&i| self.tints[i]).sum::<Rgb>() / 3.0);
        }
    }

    /// Strips of triangles, every other one turned; -1 ends a strip.
    fn read_strips(
        &mut self,
        element: &Element,
        values: &mut Values<'_>,
    ) -> Result<(), ImportError> {
        let surface = self.soup.surface("default");
        self.read_corners(element, values, |me, corners, values| {
            for strip in corners.split(|&corner| corner == -1.0) {
                let strip = me.indices(strip, values)?;
                for (k, w) in strip.windows(3).enumerate() {
                    let [a, b, c] = [w[0], w[1], w[2]];
                    me.add_triangle(if k % 2 == 0 { [a, b, c] } else { [b, a, c] }, surface);
                }
            }
            Ok(())
        })
    }

    /// The property that lists the corners of an element's items.
    fn corner_list(&self, element: &Element) -> Result<usize, ImportError> {
        let is_corners = |p: &Property| CORNERS.contains(&p.name.as_str()) && p.count.is_some();
        element.properties.iter().position(is_corners).ok_or_else(|| {
            let problem = "has no list vertex_indices";
            self.source.malformed(element.place(), problem, EXPORT_AGAIN)
        })
    }

    fn indices(&self, corners: &[f64], values: &Values<'_>) -> Result<Vec<usize>, ImportError> {
        let known = self.positions.len();
        let index = |&corner: &f64| {
            if (0.0..known as f64).contains(&corner) && corner.fract() == 0.0 {
                return Ok(corner as usize);
            }
            let corner = shown(corner);
            let problem = format!("vertex {corner} does not exist: the file has {known}, from 0");
            Err(values.wrong(problem))
        };
        corners.iter().map(index).collect()
    }
}

/// Which properties of a vertex are its colour, and what is white in them.
fn channels(element: &Element) -> Option<([usize; 3], f64)> {
    let at =
        |name: &str| element.properties.iter().position(|p| p.name == name && p.count.is_none());
    let of = [at("red")?, at("green")?, at("blue")?];
    let white = match element.properties[of[0]].kind {
        Kind::F32 | Kind::F64 => 1.0,
        Kind::U16 | Kind::I16 => 65_535.0,
        _ => 255.0,
    };
    Some((of, white))
}
