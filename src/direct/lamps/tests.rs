use super::*;
use crate::scene::builtin::{Mesh, closed_room};
use crate::scene::{Material, Photometry, SceneBuilder, Side, Sides};
use std::f64::consts::PI;

fn point_lamp(position: DVec3, candela: f64) -> Lamp {
    let (name, intensity) = ("lamp".into(), Rgb::splat(candela));
    Lamp::Point { name, position, intensity, x_axis: DVec3::X, photometry: None }
}

/// Two-sided rectangles, each given by a corner and two edges, of which the first is split into
/// patches of at most 0.002 m².
fn lit(rectangles: &[[DVec3; 3]], lamp: Lamp) -> (Scene, Patches, Vec<Rgb>) {
    let mut b = SceneBuilder::new("lamp");
    let m = b.material(Material::default());
    for [corner, e, f] in rectangles {
        let corners = [*corner, corner + e, corner + e + f, corner + f];
        b.mesh("rectangle", &corners, &[[0, 1, 2], [0, 2, 3]], m, Sides::Two);
    }
    b.lamp(lamp);
    let scene = b.finish();
    let patches = Patches::uniform(&scene.geometry, 0.002).unwrap();
    let direct = from_lamps(&scene, &patches, &Bvh::new(&scene.geometry));
    (scene, patches, direct)
}

/// A floor of 2 x 2 m at y = 0 about the origin, its front upwards.
const FLOOR: [DVec3; 3] =
    [DVec3::new(-1.0, 0.0, -1.0), DVec3::new(0.0, 0.0, 2.0), DVec3::new(2.0, 0.0, 0.0)];

/// A screen of 1 x 1 m above one of its quarters.
const SCREEN: [DVec3; 3] =
    [DVec3::new(0.0, 0.5, 0.0), DVec3::new(0.0, 0.0, 1.0), DVec3::new(1.0, 0.0, 0.0)];

/// Patches of the floor's upper side, with their centres.
fn floor<'a>(s: &'a Scene, p: &'a Patches) -> impl Iterator<Item = (PatchId, DVec3)> + 'a {
    let up = |c: &crate::patches::Cell| s.geometry.normal(c.triangle, c.side).y > 0.5;
    p.ids()
        .filter(move |&i| p.cell(i).triangle.0 < 2 && up(&p.cell(i)))
        .map(|i| (i, p.center(i).position(&s.geometry)))
}

/// Irradiance of the floor's patch nearest to a place.
fn at((s, p, direct): &(Scene, Patches, Vec<Rgb>), x: f64, z: f64) -> f64 {
    let away = |c: DVec3| c.distance(DVec3::new(x, 0.0, z));
    let nearest = floor(s, p).min_by(|a, b| away(a.1).total_cmp(&away(b.1))).unwrap();
    direct[nearest.0.index()].x
}

#[test]
fn a_point_lamp_follows_the_inverse_square_and_casts_shadows() {
    let lamp = point_lamp(DVec3::new(-0.5, 2.0, -0.5), 100.0);
    let lit = lit(&[FLOOR, SCREEN], lamp);
    let below = at(&lit, -0.5, -0.5);
    assert!((below / 25.0 - 1.0).abs() < 0.002, "100 cd at 2 m: 25 lx, got {below}");
    assert_eq!(at(&lit, 0.75, 0.75), 0.0);
}

#[test]
fn the_sun_casts_a_sharp_shadow_straight_down() {
    let (direction, irradiance) = (DVec3::NEG_Y, Rgb::splat(3.0));
    let sun = Lamp::Directional { name: "sun".into(), direction, irradiance };
    let lit = lit(&[FLOOR, SCREEN], sun);
    assert_eq!(at(&lit, 0.5, 0.5), 0.0);
    assert_eq!(at(&lit, -0.5, 0.5), 3.0);
    let (_, patches, direct) = &lit;
    let flux: f64 = patches.ids().map(|i| direct[i.index()].x * patches.area(i)).sum();
    assert!((flux / 12.0 - 1.0).abs() < 1e-12, "as much as falls on the floor: {flux}");
}

#[test]
fn patches_at_the_border_of_a_shadow_have_their_share_of_light() {
    // The screen's border lies on no border of patches: 0.0137 m beyond a row of them.
    let mut screen = SCREEN;
    screen[0].x = 0.0137;
    let (direction, irradiance) = (DVec3::NEG_Y, Rgb::ONE);
    let sun = Lamp::Directional { name: "sun".into(), direction, irradiance };
    let (scene, patches, direct) = lit(&[FLOOR, screen], sun);
    let (mut worst, mut partly, mut sum) = (0.0_f64, 0, 0.0);
    for (id, centre) in floor(&scene, &patches).filter(|(_, c)| c.z > 0.1) {
        // The share of the patch at x < 0.0137, by a fine grid.
        const N: u32 = 64;
        let inside = (0..N * N).filter(|k| {
            let u = DVec2::new(f64::from(k % N) + 0.5, f64::from(k / N) + 0.5) / f64::from(N);
            patches.sample(id, u).position(&scene.geometry).x < 0.0137
        });
        let exact = inside.count() as f64 / f64::from(N * N);
        if exact > 0.0 && exact < 1.0 && centre.x < 0.1 {
            worst = worst.max((direct[id.index()].x - exact).abs());
            sum += direct[id.index()].x - exact;
            partly += 1;
        }
    }
    assert!(partly > 20 && worst < 0.13, "{partly} patches, {worst}");
    assert!((sum / f64::from(partly)).abs() < 0.03, "{sum} of {partly}");
}

#[test]
fn a_spot_lamp_shines_within_its_cone_only() {
    let lamp = Lamp::Spot {
        name: "spot".into(),
        position: DVec3::new(-0.5, 1.0, -0.5),
        direction: DVec3::NEG_Y,
        intensity: Rgb::splat(10.0),
        inner: 0.2,
        outer: 0.4,
        x_axis: DVec3::X,
        photometry: None,
    };
    let lit = lit(&[FLOOR, SCREEN], lamp);
    assert!((at(&lit, -0.5, -0.5) / 10.0 - 1.0).abs() < 0.005);
    assert_eq!(at(&lit, 0.0, -0.5), 0.0, "beyond 0.42 m");
}

/// A wall that stands exactly where a point of a patch lies: whichever side that is lit from,
/// and whichever way the wall faces, no light passes to the other side and none is lacking.
#[test]
fn no_light_leaks_under_a_wall_that_stands_on_a_point_of_a_patch() {
    let (scene, patches, _) = lit(&[FLOOR], point_lamp(DVec3::Y, 1.0));
    let (middle, _) =
        floor(&scene, &patches).min_by(|a, b| a.1.length().total_cmp(&b.1.length())).unwrap();
    for k in 0..POINTS {
        let x = patches.sample(middle, even(k)).position(&scene.geometry).x;
        for lamp in [DVec3::new(x - 0.6, 0.3, 0.1), DVec3::new(x + 0.6, 0.3, 0.1)] {
            for (z, along) in [(-1.0, 2.0), (1.0, -2.0)] {
                let corner = DVec3::new(x, 0.0, z);
                let wall = [corner, DVec3::new(0.0, 0.0, along), DVec3::Y];
                let (scene, patches, direct) = lit(&[FLOOR, wall], point_lamp(lamp, 1.0));
                for (id, _) in floor(&scene, &patches) {
                    let origin = patches.origin(id).position(&scene.geometry);
                    let irradiance = direct[id.index()].x;
                    if (origin.x < x) != (lamp.x < x) {
                        assert_eq!(irradiance, 0.0, "{x}: {origin}");
                    } else {
                        let way = lamp - origin;
                        let exact = way.y / way.length().powi(3);
                        let error = irradiance / exact - 1.0;
                        assert!(error.abs() < 0.15, "{x}: {origin}: {irradiance} {exact}");
                    }
                }
            }
        }
    }
}

/// Seen from both sides, tilted and far from the origin; and bodies that curve away.
#[test]
fn nothing_shadows_itself() {
    let turn = glam::DQuat::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 1.1);
    let place = |p: DVec3| turn * p + DVec3::new(70.0, -30.0, 20.0);
    let tilted = [place(FLOOR[0]), turn * FLOOR[1], turn * FLOOR[2]];
    let ball = Mesh::geodesic(1.0, 6);
    let mut b = SceneBuilder::new("ball");
    let m = b.material(Material::default());
    b.mesh("ball", &ball.vertices, &ball.triangles, m, Sides::Two);
    let ball = b.finish();
    let lamps = [(place(0.7 * DVec3::Y), Side::Front), (place(-0.7 * DVec3::Y), Side::Back)];
    let outside = (DVec3::new(2.0, 1.0, -3.0), Side::Front);
    let inside = (DVec3::new(0.3, -0.2, 0.1), Side::Back);
    for (mut scene, lamps) in
        [(lit(&[tilted], point_lamp(DVec3::ZERO, 0.0)).0, lamps), (ball, [outside, inside])]
    {
        let patches = Patches::uniform(&scene.geometry, 0.01).unwrap();
        let bvh = Bvh::new(&scene.geometry);
        for (lamp, side) in lamps {
            scene.lamps = vec![point_lamp(lamp, 1.0)];
            let direct = from_lamps(&scene, &patches, &bvh);
            let mut seen = 0;
            for id in patches.ids().filter(|&i| patches.cell(i).side == side) {
                let exact: f64 = (0..POINTS)
                    .map(|k| {
                        let p = patches.sample(id, even(k));
                        let way = lamp - p.position(&scene.geometry);
                        let normal = scene.geometry.normal(p.triangle, p.side);
                        normal.dot(way).max(0.0) / way.length().powi(3) / POINTS as f64
                    })
                    .sum();
                let error = direct[id.index()].x - exact;
                assert!(error.abs() < 1e-12 + 1e-9 * exact, "{lamp}: {id:?}: {exact} {error}");
                seen += usize::from(exact > 0.0);
            }
            assert!(seen > 100);
        }
    }
}

/// A lamp 9 cm before a surface whose patches are as long as 6 cm to 2 m: each has the mean of
/// H = I h / r³ over it.
#[test]
fn patches_beside_a_lamp_have_its_mean() {
    let lamp = DVec3::new(0.13, 0.09, -0.21);
    for (size, n) in [(0.002, 80), (0.03, 200), (0.5, 600), (4.0, 1500)] {
        let (scene, _, _) = lit(&[FLOOR], point_lamp(lamp, 10.0));
        let patches = Patches::uniform(&scene.geometry, size).unwrap();
        let direct = from_lamps(&scene, &patches, &Bvh::new(&scene.geometry));
        for (id, _) in floor(&scene, &patches) {
            let sum: f64 = (0..n * n)
                .map(|k| {
                    let u = DVec2::new(f64::from(k % n) + 0.5, f64::from(k / n) + 0.5);
                    let p = patches.sample(id, u / f64::from(n)).position(&scene.geometry);
                    10.0 * lamp.y / lamp.distance(p).powi(3)
                })
                .sum();
            let exact = sum / f64::from(n * n);
            let error = direct[id.index()].x / exact - 1.0;
            assert!(error.abs() < 0.01, "{size}: {exact} {error}");
        }
    }
}

/// Cosine-distributed: I = 1000 cd cos γ downwards, none upwards.
fn diffuse() -> Photometry {
    let words = |f: &dyn Fn(f64) -> f64| -> String {
        (0..=90).map(|a| format!("{:.4} ", f(f64::from(a)))).collect()
    };
    let text = format!(
        "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 91 1 1 2 0 0 0 1 1 50\n{}\n0\n{}",
        words(&|a| a),
        words(&|a| 1000.0 * a.to_radians().cos())
    );
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("diffuse.ies");
    std::fs::write(&path, text).unwrap();
    crate::scene::ies::read(&path).unwrap()
}

/// Under a diffuse luminaire at height h, at distance r from it: H = I₀ (h / r)² / r².
#[test]
fn photometry_says_what_falls_on_the_floor() {
    let position = DVec3::new(0.2, 1.5, -0.1);
    let (mut scene, patches, _) = lit(&[FLOOR], point_lamp(position, 7.0));
    assert!(scene.set_photometry("lamp", diffuse()));
    let direct = from_lamps(&scene, &patches, &Bvh::new(&scene.geometry));
    for (id, centre) in floor(&scene, &patches) {
        let r2 = (position - centre).length_squared();
        let exact = 1000.0 * 1.5 * 1.5 / (r2 * r2);
        let error = direct[id.index()].x / exact - 1.0;
        assert!(error.abs() < 0.01, "{centre}: {error}");
    }
}

#[test]
fn all_flux_of_a_lamp_arrives_in_a_closed_room() {
    let room = || closed_room("room", DVec3::new(4.0, 3.0, 5.0), Rgb::splat(0.5), [Rgb::ZERO; 6]);
    let arriving = |lamp: Lamp, photometry: Option<Photometry>| {
        let mut scene = room();
        scene.lamps = vec![lamp];
        if let Some(photometry) = photometry {
            assert!(scene.set_photometry("lamp", photometry));
        }
        let patches = Patches::uniform(&scene.geometry, 0.01).unwrap();
        let direct = from_lamps(&scene, &patches, &Bvh::new(&scene.geometry));
        patches.ids().map(|i| direct[i.index()] * patches.area(i)).sum::<Rgb>()
    };
    let near = |flux: Rgb, exact: f64| {
        assert!((flux / exact - Rgb::ONE).abs().max_element() < 2e-3, "{flux} {exact}");
    };
    let middle = DVec3::new(1.7, 1.4, 2.2);
    near(arriving(point_lamp(middle, 10.0), None), 40.0 * PI);
    // On the ceiling itself half of the flux is above it.
    near(arriving(point_lamp(DVec3::new(1.7, 3.0, 2.2), 10.0), None), 20.0 * PI);
    near(arriving(point_lamp(middle, 10.0), Some(diffuse())), 1000.0 * PI);
    let spot = Lamp::Spot {
        name: "lamp".into(),
        position: middle,
        direction: DVec3::new(0.6, 0.64, 0.48),
        intensity: Rgb::ONE,
        inner: 0.1,
        outer: 0.2,
        x_axis: DVec3::X,
        photometry: None,
    };
    near(arriving(spot, Some(diffuse())), 1000.0 * PI);
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| lit(&[FLOOR, SCREEN], point_lamp(DVec3::new(0.3, 1.2, 0.1), 5.0)).2)
    };
    assert!(run(1) == run(3));
}
