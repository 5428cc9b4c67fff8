//! A model as its file has it, for results that keep the model: a document in the terms of glTF,
//! and what its meshes hold.

use std::collections::HashMap;
use std::sync::Arc;

use serde_json::{Map, Value};

/// A model in the terms of glTF.
pub(crate) struct Original {
    /// The document without buffers, accessors and meshes' primitives; nodes name meshes.
    pub json: Map<String, Value>,
    /// Of each surface of the scene: its mesh.
    pub surfaces: Vec<SurfaceMesh>,
    /// Encoded images, by their number in the document.
    pub images: Vec<Option<Arc<[u8]>>>,
}

/// What a surface of a scene is in the document.
pub(crate) struct SurfaceMesh {
    /// The node that places it.
    pub node: usize,
    pub mesh: Arc<Mesh>,
    /// The material of all of it; by triangle where that is `None` and the document is made of the
    /// scene, or none.
    pub material: Option<usize>,
    /// Number of the file's triangle that the mesh's first is.
    pub first_face: FirstFace,
    /// Whether the node mirrors: then corners 1 and 2 are exchanged in the scene.
    pub mirrored: bool,
}

/// How triangles of a mesh are found by the number of the file's triangle.
pub(crate) enum FirstFace {
    /// They follow each other from this one on.
    At(u32),
    /// Anywhere.
    Listed(HashMap<u32, u32>),
}

/// Vertices and triangles.
#[derive(Debug, Default)]
pub(crate) struct Mesh {
    pub attributes: Vec<Attribute>,
    pub triangles: Vec<[u32; 3]>,
}

/// What each vertex has.
#[derive(Debug)]
pub(crate) struct Attribute {
    /// As glTF calls it.
    pub name: String,
    /// Components of a vertex.
    pub width: usize,
    pub values: Vec<f32>,
}

impl SurfaceMesh {
    /// The vertices of a triangle of the file, in the order of the scene's corners.
    pub fn corners(&self, face: u32) -> Option<[u32; 3]> {
        let index = match &self.first_face {
            FirstFace::At(first) => face.checked_sub(*first)?,
            FirstFace::Listed(faces) => *faces.get(&face)?,
        };
        let [a, b, c] = *self.mesh.triangles.get(index as usize)?;
        Some(if self.mirrored { [a, c, b] } else { [a, b, c] })
    }
}
