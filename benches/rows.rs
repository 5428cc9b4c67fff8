//! Time to make rows of form factors of the room, one at a time on one thread, and drop them.
//!
//! `cargo bench --bench rows`

#![allow(clippy::unwrap_used, missing_docs, reason = "a benchmark")]

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use hemicube::engines::{Draw, Engine, Hemicube, HemicubeOptions};
use hemicube::form_factors::Row;
use hemicube::patches::{PatchId, Patches};
use hemicube::scene::{Geometry, builtin};

/// Patches whose rows are made in turn: a prime, so that they lie all over the room.
const SAMPLE: usize = 97;

fn spread(patches: &Patches) -> Vec<PatchId> {
    patches.ids().step_by(patches.len().div_ceil(SAMPLE)).collect()
}

fn rows(group: &mut criterion::BenchmarkGroup<'_, criterion::measurement::WallTime>, case: &Case) {
    let patches = Patches::uniform(case.geometry, case.patch_size).unwrap();
    let options = HemicubeOptions { resolution: case.resolution, draw: case.draw };
    let mut engine = Hemicube::new(case.geometry, &patches, options).unwrap();
    let ids = spread(&patches);
    let mut row = [Row::default()];
    let mut turn = ids.iter().cycle();
    let id = BenchmarkId::new(case.name, patches.len());
    group.bench_function(id, |b| {
        b.iter(|| engine.fill(&[*turn.next().unwrap()], &mut row).unwrap());
    });
}

struct Case<'a> {
    name: &'static str,
    geometry: &'a Geometry,
    patch_size: f64,
    resolution: usize,
    draw: Draw,
}

/// Areas in m² that yield about 10,000 and 40,000 patches.
const SIZES: [f64; 2] = [0.06, 0.0075];

fn row(c: &mut Criterion) {
    let scene = builtin::build("room").unwrap();
    let geometry = &scene.geometry;
    let mut group = c.benchmark_group("row");
    for (name, resolution) in [("64 px, sources", 64), ("128 px, sources", 128)] {
        for patch_size in SIZES {
            let case = Case { name, geometry, patch_size, resolution, draw: Draw::Sources };
            rows(&mut group, &case);
        }
    }
    group.sample_size(20);
    for patch_size in SIZES {
        let (name, draw) = ("128 px, patches", Draw::Patches);
        rows(&mut group, &Case { name, geometry, patch_size, resolution: 128, draw });
    }
    group.finish();
}

/// The engine shares rows out among the threads of its pool; a row has one.
fn on_one_thread(c: &mut Criterion) {
    rayon::ThreadPoolBuilder::new().num_threads(1).build_global().unwrap();
    row(c);
}

criterion_group!(benches, on_one_thread);
criterion_main!(benches);
