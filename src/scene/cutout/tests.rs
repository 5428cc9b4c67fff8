use std::time::Instant;

use super::*;
use crate::scene::texture::tests::png;
use crate::scene::{SceneBuilder, Sides, Surface, Texture, Wrap};

/// A PNG whose alpha is a function of the texel.
fn image(size: u32, alpha: impl Fn(u32, u32) -> u8) -> std::sync::Arc<[u8]> {
    let texel = |i: u32| [200, 100, 50, alpha(i % size, i / size)];
    png(size, size, &(0..size * size).map(texel).collect::<Vec<_>>())
}

/// A unit square of two triangles whose texture coordinates run over `repeats` of an image.
fn card(
    encoded: std::sync::Arc<[u8]>,
    wrap: Wrap,
    repeats: [f64; 2],
    cutoff: Option<f64>,
) -> Scene {
    let mut b = SceneBuilder::new("card");
    let texture = b.texture(Texture {
        name: "t".into(),
        encoded,
        wrap: [wrap; 2],
        v_up: false,
        opacity: false,
    });
    let material = b.material(Material {
        name: "leaf".into(),
        reflectance_texture: Some(texture),
        alpha_texture: Some(texture),
        alpha_cutoff: cutoff,
        ..Material::default()
    });
    let surface = b.surface(Surface { name: "card".into(), node: 0, primitive: 0 });
    let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let [low, high] = repeats;
    let uv = corners.map(|[x, y]| DVec2::new(x, y) * (high - low) + low);
    for [x, y] in corners {
        b.vertex(DVec3::new(x, y, 0.1 * x));
    }
    // The second as files do that have a vertex a corner.
    for k in [0, 2, 3] {
        b.vertex(DVec3::new(corners[k][0], corners[k][1], 0.1 * corners[k][0]));
    }
    b.triangle([0, 1, 2], Some([uv[0], uv[1], uv[2]]), surface, material, Sides::Two);
    b.triangle([4, 5, 6], Some([uv[0], uv[2], uv[3]]), surface, material, Sides::Two);
    b.finish()
}

/// Area of what is solid, as a share of the card.
fn share(scene: &Scene) -> f64 {
    let g = &scene.geometry;
    let solid = g.ids().filter(|&t| g.is_solid(t));
    solid.map(|t| g.area(t)).sum::<f64>() / 1.01_f64.sqrt()
}

/// Length of the edges that one solid triangle has alone: cracks count twice.
fn border(scene: &Scene) -> f64 {
    let g = &scene.geometry;
    let mut edges = HashMap::new();
    for t in g.ids().filter(|&t| g.is_solid(t)) {
        let corners = g.corners(t);
        for k in 0..3 {
            let (a, b) = (corners[k], corners[(k + 1) % 3]);
            let mut key = [position_key(a), position_key(b)];
            key.sort_unstable();
            let edge = edges.entry(key).or_insert((0, a.truncate().distance(b.truncate())));
            edge.0 += 1;
        }
    }
    assert!(edges.values().all(|e| e.0 <= 2));
    edges.values().filter(|e| e.0 == 1).map(|e| e.1).sum()
}

fn disc(size: u32, radius: f64) -> impl Fn(u32, u32) -> u8 {
    let centre = DVec2::splat(0.5 * f64::from(size));
    move |x, y| {
        let at = DVec2::new(f64::from(x), f64::from(y)) + 0.5;
        let inside = radius * f64::from(size) - at.distance(centre);
        (255.0 * (inside + 0.5).clamp(0.0, 1.0)) as u8
    }
}

#[test]
fn a_disc_has_its_area_and_no_cracks() {
    use std::f64::consts::PI;
    for (size, radius) in [(64, 0.4), (256, 0.3), (500, 0.45)] {
        let scene = card(image(size, disc(size, radius)), Wrap::Repeat, [0.0, 1.0], Some(0.5));
        let exact = PI * radius * radius;
        assert!((share(&scene) / exact - 1.0).abs() < 0.01, "{size}: {}", share(&scene) / exact);
        let round = border(&scene) / (2.0 * PI * radius);
        assert!((round - 1.0).abs() < 0.02, "{size}: {round}");
        let n = scene.geometry.len();
        assert!((20..200).contains(&n), "{size}: {n} pieces");
        let g = &scene.geometry;
        assert!(
            g.face_of.is_sorted()
                && g.ids().all(|t| g.normal(t, crate::scene::Side::Front).z > 0.9)
        );
        assert_eq!(scene.optics.reflectance.len(), n);
        assert!(scene.findings.iter().any(|f| f.message.contains("2 triangles are cut")));
    }
}

#[test]
fn a_fence_is_a_fence_wherever_it_repeats() {
    // Slats of 6 of 16 texels, and a rail.
    let slats = |x: u32, y: u32| if (5..11).contains(&x) || (2..4).contains(&y) { 255 } else { 0 };
    let exact = 1.0 - (10.0 / 16.0) * (14.0 / 16.0);
    for wrap in [Wrap::Repeat, Wrap::Mirror] {
        let scene = card(image(16, slats), wrap, [-3.3, 4.7], Some(0.5));
        assert!((share(&scene) / exact - 1.0).abs() < 0.01, "{}", share(&scene) / exact);
        // Round 64 holes, some of which the border cuts.
        let holes = 64.0 * 2.0 * (10.0 + 14.0) / 16.0 / 8.0;
        assert!((border(&scene) / holes - 1.0).abs() < 0.1, "{} {holes}", border(&scene));
    }
    let clamped = card(image(16, slats), Wrap::Clamp, [-3.0, 5.0], Some(0.5));
    // One repeat, and its rail and slats drawn out: three of eight to the left, four to the right.
    let (slat, rail) = (6.0 / 16.0 / 8.0, 2.0 / 16.0 / 8.0);
    let exact = slat + rail - slat * rail;
    assert!((share(&clamped) / exact - 1.0).abs() < 0.02, "{} {exact}", share(&clamped));
}

#[test]
fn nothing_changes_where_all_is_opaque_or_clear() {
    for (alpha, solid) in [(255, 2), (128, 2), (127, 0), (0, 0)] {
        for cutoff in [Some(0.5), None] {
            let scene = card(image(64, |_, _| alpha), Wrap::Repeat, [0.0, 3.0], cutoff);
            let g = &scene.geometry;
            assert_eq!((g.len(), g.vertices.len(), g.face_of.len()), (2, 7, 0));
            assert_eq!(g.ids().filter(|&t| g.is_solid(t)).count(), solid, "{alpha}");
        }
    }
}

#[test]
fn a_triangle_of_no_extent_in_the_texture_is_decided_by_its_place() {
    let half = |x: u32, _| if x < 32 { 255 } else { 0 };
    for (at, solid) in [(0.2, 2), (0.7, 0)] {
        let scene = card(image(64, half), Wrap::Repeat, [at, at], Some(0.5));
        let g = &scene.geometry;
        assert_eq!(g.ids().filter(|&t| g.is_solid(t)).count(), solid);
        assert_eq!(g.len(), 2);
    }
}

#[test]
fn any_triangles_of_any_mask_are_cut_without_cracks() {
    let mut state = 7_u64;
    let mut random = || {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f64 / (1 << 24) as f64
    };
    for round in 0..60 {
        let waves: Vec<[f64; 3]> =
            (0..6).map(|_| [4.0 * random() - 2.0, 4.0 * random() - 2.0, 7.0 * random()]).collect();
        let hard = round % 3 == 0;
        let alpha = |x: u32, y: u32| {
            let (x, y) = (f64::from(x) / 6.0, f64::from(y) / 6.0);
            let sum: f64 = waves.iter().map(|[a, b, c]| (a * x + b * y + c).sin()).sum();
            if hard { 255 * u8::from(sum > 0.0) } else { (128.0 + 90.0 * sum) as u8 }
        };
        let wrap = [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp][round % 3];
        let reach = [1.0, 3.0, 0.2][round / 3 % 3];
        let repeats = [reach * (random() - 0.5), reach * (random() - 0.5)];
        let scene = card(image(48, alpha), wrap, repeats, Some(0.5));
        let sampler = scene.optics.textures[0].decode().unwrap();
        let at = |k: u32| repeats[0] + (repeats[1] - repeats[0]) * (f64::from(k) + 0.5) / 128.0;
        let places = (0..128 * 128).map(|k| DVec2::new(at(k % 128), at(k / 128)));
        let opaque = places.filter(|&uv| sampler.alpha(uv) >= 0.5).count() as f64 / 16384.0;
        let found = share(&scene);
        // Steps of hard masks are smoothed, by half a texel here and there.
        let tolerance = 0.02 + 0.5 / (48.0 * (repeats[1] - repeats[0]).abs());
        assert!((found - opaque).abs() < tolerance, "{round}: {found}, not {opaque}");
        border(&scene);
        // Vertices on edges would be said.
        let doubts = crate::scene::inspect(&scene);
        let t = doubts.iter().find(|f| f.message.contains("on another triangle's edge"));
        assert!(t.is_none(), "{round}: {t:?}");
    }
}

#[test]
fn noise_and_repeats_without_end_are_bounded() {
    let noise = |x: u32, y: u32| {
        let h = (x ^ (y << 12)).wrapping_mul(2_654_435_761);
        ((h ^ (h >> 15)).wrapping_mul(2_246_822_519) >> 24) as u8
    };
    let encoded = image(4096, noise);
    for repeats in [[0.0, 1.0], [0.0, 300.0], [-1e5, 1e5], [0.0, 1e12]] {
        let start = Instant::now();
        let scene = card(encoded.clone(), Wrap::Repeat, repeats, Some(0.5));
        let (seconds, n) = (start.elapsed().as_secs_f64(), scene.geometry.len());
        assert!(seconds < 20.0 && n < 4 * MOST_IN_TRIANGLE);
        let said = |what: &str| scene.findings.iter().any(|f| f.message.contains(what));
        assert!(said("on a grid of") || said("too much detail"));
    }
}
