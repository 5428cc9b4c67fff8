//! The statements of an OBJ file, without any other file.

use std::collections::HashMap;
use std::ops::Range;

use glam::{DVec2, DVec3};

use super::labels::{Block, labels};
use crate::scene::Rgb;
use crate::scene::lines::{Statement, number, statements, vector};
use crate::scene::shortened::shortened;
use crate::scene::source::{ImportError, Place, Source};

/// What an OBJ file says.
#[derive(Default)]
pub struct Obj {
    pub positions: Vec<DVec3>,
    /// Of positions, as far as any has one; in the file's scale.
    pub colours: Vec<Option<Rgb>>,
    pub uvs: Vec<DVec2>,
    pub corners: Vec<Corner>,
    pub faces: Vec<Face>,
    /// Objects and groups that have faces.
    pub surfaces: Vec<Named>,
    /// Names that `usemtl` asked for.
    pub materials: Vec<String>,
    /// The rest of each `mtllib` line, and its number.
    pub libraries: Vec<(usize, String)>,
    /// Points, lines, curves and patches that were left out, and the first one's line.
    pub curves: usize,
    pub first_curve: usize,
    /// Groups whose faces stand before their `g` line, in the order of the file, and the line.
    pub labelled: Vec<(usize, String)>,
}

/// A surface: its name, and that of the object that it is of (empty for none).
#[derive(Debug, Clone, PartialEq)]
pub struct Named {
    pub name: String,
    pub object: String,
}

/// A corner of a face: indices from 0, not yet checked.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Corner {
    pub position: u32,
    pub uv: Option<u32>,
}

pub struct Face {
    pub line: usize,
    /// Range in [`Obj::corners`].
    pub corners: Range<usize>,
    pub surface: u32,
    pub material: Option<u32>,
}

/// Where the parser stands.
#[derive(Default)]
struct State {
    obj: Obj,
    /// What came between `g` and `o` lines so far, the one that is open last.
    blocks: Vec<Block>,
    surface: Option<u32>,
    surface_of_name: HashMap<String, u32>,
    material: Option<u32>,
    material_of_name: HashMap<String, u32>,
}

/// Parses an OBJ file. Indices may point forward; the caller checks them.
pub fn parse(source: &Source<'_>) -> Result<Obj, ImportError> {
    let mut state = State { blocks: vec![Block::default()], ..State::default() };
    statements(source.bytes, |s| state.take(source, &s))?;
    state.end_block();
    state.apply_labels();
    Ok(state.obj)
}

impl State {
    fn take(&mut self, source: &Source<'_>, s: &Statement<'_>) -> Result<(), ImportError> {
        match s.keyword {
            "v" => self.vertex(source, s)?,
            "vt" => self.texture_coordinate(source, s)?,
            "f" | "fo" => self.face(source, s)?,
            "o" => self.open_block(s.line, s.rest.into(), String::new()),
            "g" => {
                let object = self.blocks.last().map_or(String::new(), |b| b.object.clone());
                self.open_block(s.line, object, s.rest.into());
            }
            "usemtl" => self.use_material(s.rest),
            "mtllib" => self.obj.libraries.push((s.line, s.rest.into())),
            "p" | "l" | "curv" | "curv2" | "surf" => self.left_out(s.line),
            _ => {}
        }
        Ok(())
    }

    /// A position, which a weight or a colour may follow.
    fn vertex(&mut self, source: &Source<'_>, s: &Statement<'_>) -> Result<(), ImportError> {
        self.obj.positions.push(vector(source, s)?);
        let mut rest = s.words().skip(3).map(|word| word.parse::<f64>().ok());
        if let (Some(Some(r)), Some(Some(g)), Some(Some(b))) =
            (rest.next(), rest.next(), rest.next())
        {
            self.obj.colours.resize(self.obj.positions.len() - 1, None);
            self.obj.colours.push(Some(Rgb::new(r, g, b)));
        }
        Ok(())
    }

    fn left_out(&mut self, line: usize) {
        if self.obj.curves == 0 {
            self.obj.first_curve = line;
        }
        self.obj.curves += 1;
    }

    fn texture_coordinate(
        &mut self,
        source: &Source<'_>,
        s: &Statement<'_>,
    ) -> Result<(), ImportError> {
        let mut uv = DVec2::ZERO;
        for (i, word) in s.words().take(2).enumerate() {
            // Exporters write `nan` for coordinates that do not matter.
            let x = word.parse::<f64>().ok().filter(|x| x.is_nan());
            uv[i] = if x.is_some() { 0.0 } else { number(source, s.line, word)? };
        }
        self.obj.uvs.push(uv);
        Ok(())
    }

    fn face(&mut self, source: &Source<'_>, s: &Statement<'_>) -> Result<(), ImportError> {
        let start = self.obj.corners.len();
        for word in s.words() {
            let corner = self.corner(word).map_err(|problem| {
                source.malformed(Place::Line(s.line), problem, "export the model again")
            })?;
            self.obj.corners.push(corner);
        }
        if self.obj.corners.len() - start < 3 {
            self.obj.corners.truncate(start);
            self.left_out(s.line);
            return Ok(());
        }
        let surface = match self.surface {
            Some(surface) => surface,
            None => self.open_surface(),
        };
        self.obj.faces.push(Face {
            line: s.line,
            corners: start..self.obj.corners.len(),
            surface,
            material: self.material,
        });
        Ok(())
    }

    fn use_material(&mut self, name: &str) {
        let (index, new) = number_of(&mut self.material_of_name, name);
        if new {
            self.obj.materials.push(name.into());
        }
        if self.material != Some(index) {
            self.material = Some(index);
            if let Some(block) = self.blocks.last_mut() {
                block.last_run = self.obj.faces.len();
            }
        }
    }

    fn open_block(&mut self, line: usize, object: String, group: String) {
        self.end_block();
        let start = self.obj.faces.len();
        let faces = start..start;
        self.blocks.push(Block { line, object, group, faces, last_run: start, ..Block::default() });
        self.surface = None;
    }

    fn end_block(&mut self) {
        let material = self.material.map(|m| self.obj.materials[m as usize].clone());
        if let Some(block) = self.blocks.last_mut() {
            block.faces.end = self.obj.faces.len();
            block.material = material.unwrap_or_default();
        }
    }

    /// The surface of the block that is open.
    fn open_surface(&mut self) -> u32 {
        let surface = self.surface_of(self.blocks.len() - 1);
        self.surface = Some(surface);
        surface
    }

    fn surface_of(&mut self, block: usize) -> u32 {
        let Block { object, group, .. } = &self.blocks[block];
        let name = match (object.as_str(), group.as_str()) {
            ("", "") => "default".to_owned(),
            (object, "") => object.to_owned(),
            ("", group) => group.to_owned(),
            (object, group) if object == group => group.to_owned(),
            (object, group) => format!("{object}/{group}"),
        };
        let (index, new) = number_of(&mut self.surface_of_name, &name);
        if new {
            self.obj.surfaces.push(Named { name, object: object.clone() });
        }
        index
    }

    /// Gives faces to the groups that are named after them.
    fn apply_labels(&mut self) {
        let found = labels(&self.blocks);
        if found.is_empty() {
            return;
        }
        for label in found.into_iter().rev() {
            let surface = self.surface_of(label.block);
            self.obj.faces[label.faces].iter_mut().for_each(|f| f.surface = surface);
            let Block { line, group, .. } = &self.blocks[label.block];
            self.obj.labelled.push((*line, group.clone()));
        }
        self.leave_out_empty_surfaces();
    }

    fn leave_out_empty_surfaces(&mut self) {
        let (mut kept, mut number) = (Vec::new(), HashMap::new());
        for face in &mut self.obj.faces {
            face.surface = *number.entry(face.surface).or_insert_with(|| {
                kept.push(self.obj.surfaces[face.surface as usize].clone());
                kept.len() as u32 - 1
            });
        }
        self.obj.surfaces = kept;
    }

    /// `7`, `7/1`, `7//3` or `7/1/3`; normals are not needed.
    fn corner(&self, word: &str) -> Result<Corner, String> {
        let mut parts = word.split('/');
        let position = parts.next().unwrap_or_default();
        let uv = parts.next().filter(|part| !part.is_empty());
        let index = |part: &str, count: usize, what: &str| {
            let fail = || format!("`{}` names no {what}", shortened(word));
            let index = match part.parse::<i64>().map_err(|_| fail())? {
                0 => return Err(format!("`{}`: {what} numbers begin at 1", shortened(word))),
                i if i > 0 => i - 1,
                i => count as i64 + i,
            };
            u32::try_from(index).map_err(|_| format!("{}: the file has {count} so far", fail()))
        };
        Ok(Corner {
            position: index(position, self.obj.positions.len(), "vertex")?,
            uv: uv.map(|uv| index(uv, self.obj.uvs.len(), "texture coordinate")).transpose()?,
        })
    }
}

/// The number of a name, in the order in which names come, and whether it is a new one.
fn number_of(numbers: &mut HashMap<String, u32>, name: &str) -> (u32, bool) {
    if let Some(&known) = numbers.get(name) {
        return (known, false);
    }
    let number = numbers.len() as u32;
    numbers.insert(name.into(), number);
    (number, true)
}
