//! What a mask cuts out of a triangle casts the shadow, and has the form factors, of the polygon
//! that it depicts.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test")]

use std::sync::Arc;

use glam::{DVec2, DVec3};
use hemicube::engines::{EngineOptions, ExactOptions, RaysOptions};
use hemicube::matrix::{Lumped, Matrix, MatrixOptions, Rows, make};
use hemicube::progress::Silent;
use hemicube::scene::{GroupBy, Material, Scene, SceneBuilder, Sides, Surface, Texture, Wrap};

/// Texels along a side of the mask.
const SIZE: u32 = 64;

/// Corners of the cross that the mask shows, from 0 to 1 along the card.
const CROSS: [[f64; 4]; 3] =
    [[0.25, 0.5, 0.125, 0.875], [0.125, 0.25, 0.375, 0.625], [0.5, 0.875, 0.375, 0.625]];

fn is_in_cross(x: f64, y: f64) -> bool {
    CROSS.iter().any(|[x0, x1, y0, y1]| (*x0..*x1).contains(&x) && (*y0..*y1).contains(&y))
}

fn mask() -> Arc<[u8]> {
    let middle = |i: u32| (f64::from(i) + 0.5) / f64::from(SIZE);
    let alpha = |i: u32| if is_in_cross(middle(i % SIZE), middle(i / SIZE)) { 255 } else { 0 };
    let texels: Vec<[u8; 4]> = (0..SIZE * SIZE).map(|i| [255, 255, 255, alpha(i)]).collect();
    let mut out = Vec::new();
    let mut encoder = png::Encoder::new(&mut out, SIZE, SIZE);
    encoder.set_color(png::ColorType::Rgba);
    encoder.write_header().unwrap().write_image_data(texels.as_flattened()).unwrap();
    out.into()
}

/// A floor, a light of the same size above it, and between them a card with a cross on it: as a
/// mask, or as rectangles.
fn scene(masked: bool) -> Scene {
    let mut b = SceneBuilder::new("card");
    let rectangle = |b: &mut SceneBuilder, name: &str, [x0, x1, z0, z1]: [f64; 4], y, m, up| {
        let surface = b.surface(Surface { name: name.into(), node: 0, primitive: 0 });
        let corners = [[x0, z0], [x0, z1], [x1, z1], [x1, z0]];
        let v = corners.map(|[x, z]| b.vertex(DVec3::new(x, y, z)));
        let uv = corners.map(DVec2::from);
        for k in [[0, 1, 2], [0, 2, 3]] {
            let k = if up { k } else { [k[0], k[2], k[1]] };
            b.triangle(k.map(|k| v[k]), Some(k.map(|k| uv[k])), surface, m, Sides::Two);
        }
    };
    let plain = b.material(Material::default());
    let light = b.material(Material { radiance: DVec3::ONE, ..Material::default() });
    rectangle(&mut b, "floor", [0.0, 1.0, 0.0, 1.0], 0.0, plain, true);
    rectangle(&mut b, "light", [0.0, 1.0, 0.0, 1.0], 1.0, light, false);
    if masked {
        let texture = b.texture(Texture {
            name: "cross".into(),
            encoded: mask(),
            wrap: [Wrap::Repeat; 2],
            v_up: false,
            opacity: false,
        });
        let material = Material {
            alpha_texture: Some(texture),
            alpha_cutoff: Some(0.5),
            ..Material::default()
        };
        let card = b.material(material);
        rectangle(&mut b, "card", [0.0, 1.0, 0.0, 1.0], 0.5, card, true);
    } else {
        for part in CROSS {
            rectangle(&mut b, "card", part, 0.5, plain, true);
        }
    }
    b.finish()
}

fn matrix(scene: &Scene, engine: EngineOptions, patch_size: Option<f64>) -> Matrix {
    let options = MatrixOptions { engine, patch_size, ..MatrixOptions::default() };
    make(&scene.geometry, &options, &Silent).unwrap()
}

/// Form factors between surfaces, fronts and backs.
fn between_surfaces(scene: &Scene, engine: EngineOptions) -> Vec<f64> {
    let matrix = matrix(scene, engine, Some(0.02));
    let lumped = Lumped::new(&matrix, &scene.geometry, &scene.grouping(GroupBy::Surface)).unwrap();
    let n = lumped.len();
    let (mut columns, mut values, mut all) = (Vec::new(), Vec::new(), vec![0.0; n * n]);
    for i in 0..n {
        lumped.row(i, &mut columns, &mut values).unwrap();
        columns.iter().zip(&values).for_each(|(&j, f)| all[i * n + j as usize] = *f);
    }
    all
}

#[test]
fn a_masked_card_is_the_polygon_that_it_depicts() {
    let exact = EngineOptions::Exact(ExactOptions::default());
    let rays = EngineOptions::Rays(RaysOptions { samples: 1024, ..RaysOptions::default() });
    let expected = between_surfaces(&scene(false), exact);
    for (engine, tolerance) in [(exact, 0.003), (rays, 0.006)] {
        let found = between_surfaces(&scene(true), engine);
        assert_eq!(found.len(), expected.len());
        for (k, (found, expected)) in found.iter().zip(&expected).enumerate() {
            assert!((found - expected).abs() < tolerance, "{k}: {found} {expected}");
        }
    }
}

#[test]
fn a_face_that_is_cut_has_one_row() {
    let scene = scene(true);
    let matrix = matrix(&scene, MatrixOptions::default().engine, None);
    assert!(matrix.len() > 24);
    let faces = Lumped::by_face(&matrix, &scene.geometry).unwrap();
    // Six triangles, and their backs.
    let rows = faces.surfaces(&scene.geometry);
    let numbers: Vec<u32> = rows.iter().map(|r| r.triangle.unwrap()).collect();
    assert_eq!(numbers, [0, 1, 2, 3, 4, 5, 0, 1, 2, 3, 4, 5]);
    assert_eq!((faces.label(7), rows[7].name.as_str()), ("7".to_owned(), "floor"));
    // Each piece is drawn with the row of its face, and its back with that of the face's.
    let cells = matrix.cells(&scene.geometry);
    assert_eq!((cells.front.len(), cells.back.len()), (cells.triangles.len(), cells.source.len()));
    for (k, &source) in cells.source.iter().enumerate() {
        let face = scene.geometry.face(source) as usize;
        let [front, back] = [cells.front[k], cells.back[k]].map(|i| faces.group_of(i as usize));
        assert_eq!([front, back], [face, face + 6]);
    }
    let cross: f64 = CROSS.iter().map(|[x0, x1, y0, y1]| (x1 - x0) * (y1 - y0)).sum();
    assert!(((rows[4].area + rows[5].area) / cross - 1.0).abs() < 0.01);
}
