//! What callers hear through `Progress`: that they may stop the work, and what is left out.

#![allow(clippy::unwrap_used, reason = "a test")]

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use glam::DVec3;
use hemicube::patches::Patches;
use hemicube::progress::{Cancelled, Progress, is_cancelled};
use hemicube::reconstruct::Field;
use hemicube::scene::{Material, Rgb, Scene, SceneBuilder, Sides, builtin};
use hemicube::visibility::{Bvh, uncover};
use hemicube::{LightOptions, MatrixOptions};

/// Stops the work after so many calls, and counts them.
struct After(usize, AtomicUsize);

impl Progress for After {
    fn stage(&self, _: &str, _: u64) {}

    fn advance(&self, _: u64) -> Result<(), Cancelled> {
        let calls = self.1.fetch_add(1, Ordering::Relaxed);
        if calls < self.0 { Ok(()) } else { Err(Cancelled) }
    }
}

/// Calls of `work` before it ends by itself, and whether it ends soon if it is to stop at any of
/// some of them.
fn stops<T>(what: &str, work: impl Fn(&dyn Progress) -> Result<T, Cancelled>) {
    let all = After(usize::MAX, AtomicUsize::new(0));
    assert!(work(&all).is_ok());
    let calls = all.1.into_inner();
    assert!(calls > 2, "{what}: {calls}");
    for after in [0, 1, calls / 2, calls - 1] {
        let stop = After(after, AtomicUsize::new(0));
        assert!(work(&stop).is_err(), "{what}: not stopped at call {after} of {calls}");
        let more = stop.1.into_inner() - after;
        // All threads may be at work when one hears it.
        assert!(more <= 64, "{what}: {more} calls more");
    }
}

#[test]
fn patches_and_fields_stop_when_told() {
    let scene = builtin::build("room").unwrap();
    let g = &scene.geometry;
    let size = Patches::area_adding(g, 4_000);
    stops("patches", |progress| {
        Patches::uniform_heard(g, size, progress).map_err(|error| {
            assert!(is_cancelled(&error), "{error}");
            Cancelled
        })
    });
    let patches = Patches::uniform(g, size).unwrap();
    let bvh = Bvh::new(g);
    stops("uncover", |progress| uncover(g, patches.clone(), &bvh, progress));
    let irradiance = vec![Rgb::ONE; patches.len()];
    stops("field", |progress| Field::new_heard(g, &patches, &irradiance, |_| true, progress));
    let clustered = Patches::clustered(g, 10.0 * size, &[]).unwrap();
    let irradiance = vec![Rgb::ONE; clustered.len()];
    stops("field", |progress| Field::new_heard(g, &clustered, &irradiance, |_| true, progress));
}

/// Keeps what is said, and stops the work as soon as something is.
#[derive(Default)]
struct Said(Mutex<Vec<String>>);

impl Progress for Said {
    fn stage(&self, _: &str, _: u64) {}

    fn advance(&self, _: u64) -> Result<(), Cancelled> {
        if self.0.lock().unwrap().is_empty() { Ok(()) } else { Err(Cancelled) }
    }

    fn warn(&self, message: &str) {
        self.0.lock().unwrap().push(message.to_owned());
    }
}

/// `n` large triangles anyhow in a cube of so little height.
fn crowd(n: u32, height: f64) -> Scene {
    let mut state = 5_u64;
    let mut random = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        (state >> 40) as f64 / (1_u64 << 24) as f64
    };
    let vertices: Vec<DVec3> =
        (0..3 * n).map(|_| DVec3::new(random(), random(), height * random())).collect();
    let triangles: Vec<[u32; 3]> = (0..n).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    let mut b = SceneBuilder::new("crowd");
    let m = b.material(Material::default());
    b.mesh("crowd", &vertices, &triangles, m, Sides::Two);
    let mut scene = b.finish();
    scene.sky = Rgb::ONE;
    scene
}

#[test]
fn contacts_that_are_left_out_are_said() {
    let crossing = crowd(1_500, 1.0);
    let said = Said::default();
    let options = LightOptions { patch_size: Some(1e9), ..LightOptions::default() };
    let lit = crossing.light(&options, &said).map(|lit| lit.solution.report);
    assert!(lit.is_err_and(|error| is_cancelled(&error)));
    let said = said.0.into_inner().unwrap();
    assert_eq!(said.len(), 1, "{said:?}");
    assert!(said[0].contains("of 1500 triangles touch or cross"), "{said:?}");

    for (scene, none) in [(crowd(1_500, 0.0), true), (crowd(30, 1.0), true), (crossing, false)] {
        let patches = Patches::uniform(&scene.geometry, 1e9).unwrap();
        assert_eq!(patches.contacts_left_out() == 0, none);
    }
}

#[test]
fn coverings_that_are_left_out_are_said() {
    let said = Said::default();
    let made = crowd(3_000, 0.0).form_factors(&MatrixOptions::default(), &said);
    assert!(made.is_err_and(|error| is_cancelled(&error)));
    let said = said.0.into_inner().unwrap();
    assert_eq!(said.len(), 1, "{said:?}");
    assert!(said[0].contains("of 3000 faces lie on or near"), "{said:?}");
}
