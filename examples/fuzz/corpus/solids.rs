//! Models of triangles and little else: STL and PLY.

use std::fmt::Write;

use glam::DVec3;
use hemicube::Scene;

use super::{Input, Sound};

pub fn stl() -> Sound {
    let scene = Scene::builtin("furnace")?;
    let (mut text, mut bytes) = (String::from("solid box\n"), vec![b' '; 80]);
    bytes.extend((scene.geometry.len() as u32).to_le_bytes());
    for id in scene.geometry.ids() {
        let [a, b, c] = scene.geometry.corners(id);
        let normal = (b - a).cross(c - a).normalize();
        let DVec3 { x, y, z } = normal;
        writeln!(text, " facet normal {x} {y} {z}\n  outer loop")?;
        for p in [a, b, c] {
            writeln!(text, "   vertex {} {} {}", p.x, p.y, p.z)?;
        }
        text += "  endloop\n endfacet\n";
        for p in [normal, a, b, c] {
            p.as_vec3().to_array().iter().for_each(|x| bytes.extend(x.to_le_bytes()));
        }
        bytes.extend([0, 0]);
    }
    text += "endsolid box\n";
    Ok(vec![Input::new("m.stl", text), Input::new("m.stl", bytes)])
}

const HEADER: &str = "element vertex 5\nproperty float x\nproperty double y\ncomment none\n\
    property uchar red\nproperty uchar green\nproperty uchar blue\nproperty float z\n\
    element edge 1\nproperty int a\nproperty list uchar short weights\nelement face 3\n\
    property uchar material\nproperty list uchar int vertex_indices\nend_header\n";

const VERTICES: [([f64; 3], [u8; 3]); 5] = [
    ([0.0, 0.0, 0.0], [200, 0, 9]),
    ([1.0, 0.0, 0.0], [200, 0, 255]),
    ([1.0, 1.0, 0.5], [7, 7, 7]),
    ([0.0, 1.0, 0.0], [0, 255, 0]),
    ([0.5, 0.5, 2.0], [0, 0, 0]),
];

const FACES: [&[i32]; 3] = [&[0, 1, 2, 3], &[2, 1, 0], &[0, 4, 1]];

pub fn ply() -> Sound {
    let mut text = String::new();
    for ([x, y, z], [r, g, b]) in VERTICES {
        writeln!(text, "{x} {y} {r} {g} {b} {z}")?;
    }
    text += "3 2 5 6\n";
    for face in FACES {
        let corners: Vec<String> = face.iter().map(ToString::to_string).collect();
        writeln!(text, "1 {} {}", face.len(), corners.join(" "))?;
    }
    let file = |form: &str, body: &[u8]| {
        let head = format!("ply\nformat {form} 1.0\n{HEADER}");
        Input::new("m.ply", [head.as_bytes(), body].concat())
    };
    Ok(vec![
        file("ascii", text.as_bytes()),
        file("binary_little_endian", &binary(false)),
        file("binary_big_endian", &binary(true)),
    ])
}

fn binary(big: bool) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut push = |number: &[u8]| match big {
        true => bytes.extend(number.iter().rev()),
        false => bytes.extend(number),
    };
    for ([x, y, z], colour) in VERTICES {
        push(&(x as f32).to_le_bytes());
        push(&y.to_le_bytes());
        colour.iter().for_each(|c| push(&[*c]));
        push(&(z as f32).to_le_bytes());
    }
    push(&3_i32.to_le_bytes());
    push(&[2]);
    [5_i16, 6].iter().for_each(|w| push(&w.to_le_bytes()));
    for face in FACES {
        push(&[1]);
        push(&[face.len() as u8]);
        face.iter().for_each(|corner| push(&corner.to_le_bytes()));
    }
    bytes
}
