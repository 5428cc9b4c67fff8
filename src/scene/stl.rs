//! STL, ASCII and binary.
//!
//! STL knows neither materials nor sidedness: both sides reflect. Corners run counter-clockwise
//! seen from the front; the normals that facets carry beside them are only compared.

#[cfg(test)]
mod tests;

use glam::DVec3;

use super::Severity;
use super::builder::SceneBuilder;
use super::lines::{Statement, statements, vector};
use super::shortened::shortened;
use super::soup::Soup;
use super::source::{EXPORT_AGAIN, ImportError, Place, Source};

/// Bytes before the facets of a binary file: a title, and how many facets there are.
const HEADER: usize = 84;

/// Bytes of a facet: its normal, three corners and two bytes that mean nothing.
const FACET: usize = 50;

/// Reads an STL file of either kind.
pub(super) fn read(source: &Source<'_>, builder: &mut SceneBuilder) -> Result<(), ImportError> {
    let mut soup = Soup::new(builder, "STL", false);
    let mut facets = Facets { soup: &mut soup, source, against: 0 };
    // Binary files may begin with `solid` too, but no text has just the length that its bytes 80 to
    // 83 say.
    let bytes = source.bytes;
    let claimed = bytes
        .get(HEADER - 4..HEADER)
        .and_then(|b| b.first_chunk())
        .map(|b| u32::from_le_bytes(*b) as usize * FACET + HEADER);
    let is_text =
        || bytes.trim_ascii_start().get(..5).is_some_and(|w| w.eq_ignore_ascii_case(b"solid"));
    if claimed == Some(bytes.len()) || !is_text() {
        facets.binary(claimed)?;
    } else {
        facets.ascii()?;
    }
    let against = facets.against;
    if against > 0 {
        soup.builder.finding(
            Severity::Warning,
            "whole model",
            format!(
                "{against} facets carry a normal against the winding of their corners; the \
                 winding counts"
            ),
            "recalculate the normals in the modeller",
        );
    }
    Ok(())
}

struct Facets<'a, 'b> {
    soup: &'a mut Soup<'b>,
    source: &'a Source<'a>,
    /// Facets whose normal contradicts their winding.
    against: usize,
}

impl Facets<'_, '_> {
    fn binary(&mut self, claimed: Option<usize>) -> Result<(), ImportError> {
        let bytes = self.source.bytes;
        let header = || Place::Element("header".into());
        let Some(claimed) = claimed else {
            let problem = "is neither text that begins with `solid` nor a binary STL file";
            return Err(self.source.malformed(header(), problem, EXPORT_AGAIN));
        };
        let count = (claimed - HEADER) / FACET;
        if bytes.len() < claimed {
            let whole = (bytes.len() - HEADER) / FACET;
            let problem = format!(
                "says {count} facets, but the file holds {whole}: it is cut off, or no STL file"
            );
            return Err(self.source.malformed(header(), problem, EXPORT_AGAIN));
        }
        self.source.check_size(3 * count, "vertices", header)?;
        let surface = self.soup.surface("default");
        for (i, facet) in bytes[HEADER..claimed].as_chunks::<FACET>().0.iter().enumerate() {
            let mut vectors = [DVec3::ZERO; 4];
            let numbers = facet[..48].as_chunks::<4>().0;
            for (k, number) in numbers.iter().enumerate() {
                vectors[k / 3][k % 3] = f64::from(f32::from_le_bytes(*number));
            }
            let [normal, corners @ ..] = vectors;
            if !corners.iter().all(|c| c.is_finite()) {
                let place = Place::Element(format!("facet {i}"));
                let problem = "has a coordinate that is not a finite number";
                return Err(self.source.malformed(place, problem, EXPORT_AGAIN));
            }
            self.add(normal, corners, surface);
        }
        if bytes.len() > claimed {
            self.soup.builder.finding(
                Severity::Note,
                "end of the file",
                format!("{} bytes after the last facet are left out", bytes.len() - claimed),
                "",
            );
        }
        Ok(())
    }

    fn ascii(&mut self) -> Result<(), ImportError> {
        let mut state = Ascii::default();
        statements(self.source.bytes, |s| state.take(self, &s))?;
        match state.solid {
            None => Ok(()),
            Some(_) => {
                let problem = "the file ends before `endsolid`: it is cut off";
                Err(self.source.malformed(Place::Line(state.line), problem, EXPORT_AGAIN))
            }
        }
    }

    fn add(&mut self, normal: DVec3, corners: [DVec3; 3], surface: u32) {
        let [a, b, c] = corners;
        self.against += usize::from((b - a).cross(c - a).dot(normal) < 0.0);
        let indices = corners.map(|c| self.soup.vertex(c));
        self.soup.triangle(indices, surface);
    }
}

/// Where the reader of text stands.
#[derive(Default)]
struct Ascii {
    line: usize,
    /// Surface of the solid that is open.
    solid: Option<u32>,
    /// Normal and corners of the facet that is open.
    facet: Option<(DVec3, Vec<DVec3>)>,
}

impl Ascii {
    fn take(&mut self, facets: &mut Facets<'_, '_>, s: &Statement<'_>) -> Result<(), ImportError> {
        self.line = s.line;
        let source = facets.source;
        let wrong = |problem: String| source.malformed(Place::Line(s.line), problem, EXPORT_AGAIN);
        let unexpected = || wrong(format!("`{}` is not expected here", shortened(s.keyword)));
        match s.keyword.to_ascii_lowercase().as_str() {
            "solid" if self.solid.is_none() => {
                let name = if s.rest.is_empty() { "default" } else { s.rest };
                self.solid = Some(facets.soup.surface(name));
            }
            "facet" if self.solid.is_some() && self.facet.is_none() => {
                // Many write zeros or `nan` where they know no normal.
                let number = |w: &str| w.parse().unwrap_or(0.0);
                let mut words = s.words().skip(1).map(number);
                let normal = [0; 3].map(|_| words.next().unwrap_or(0.0));
                self.facet = Some((DVec3::from(normal), Vec::new()));
            }
            "outer" | "endloop" if self.facet.is_some() => {}
            "vertex" => match &mut self.facet {
                Some((_, corners)) => corners.push(vector(source, s)?),
                None => return Err(unexpected()),
            },
            "endfacet" => {
                let (Some((normal, corners)), Some(surface)) = (self.facet.take(), self.solid)
                else {
                    return Err(unexpected());
                };
                let corners = <[DVec3; 3]>::try_from(corners)
                    .map_err(|c| wrong(format!("a facet of {} corners instead of 3", c.len())))?;
                facets.add(normal, corners, surface);
                source.check_size(facets.soup.triangles(), "triangles", || Place::Line(s.line))?;
            }
            "endsolid" if self.solid.is_some() && self.facet.is_none() => self.solid = None,
            _ => return Err(unexpected()),
        }
        Ok(())
    }
}
