//! Several ranks, here threads, light a scene as one process does, to the tolerance of the solver;
//! to the last bit it is the same for any number of them. Rows in a folder serve the next run.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::fs;
use std::path::Path;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Barrier, Mutex};

use glam::DVec3;
use hemicube::engines::{EngineOptions, HemicubeOptions, RaysOptions};
use hemicube::export::{RowFolder, read_factors, read_scene, read_store, write_hemi};
use hemicube::is_cancelled;
use hemicube::progress::{Cancelled, Progress, Silent};
use hemicube::ranks::{Communicator, Ranks, RanksError};
use hemicube::scene::{Lamp, Rgb, Scene};
use hemicube::solution::{Adaptive, LightError, LightOptions, Work, light, light_shared};
use hemicube::store::sources;
use hemicube::uncertainty::light_within_shared;

/// What threads say to each other.
#[derive(Debug)]
struct Table {
    barrier: Barrier,
    said: Mutex<Vec<Vec<u8>>>,
    /// How many bytes in all.
    bytes: AtomicUsize,
}

/// A thread at a table.
#[derive(Debug)]
struct Seat {
    rank: usize,
    size: usize,
    table: Arc<Table>,
}

impl Communicator for Seat {
    fn rank(&self) -> usize {
        self.rank
    }

    fn size(&self) -> usize {
        self.size
    }

    fn all_gather(&self, own: &[u8]) -> Result<Vec<Vec<u8>>, RanksError> {
        self.table.said.lock().unwrap()[self.rank] = own.to_vec();
        self.table.bytes.fetch_add(own.len(), Ordering::Relaxed);
        self.table.barrier.wait();
        let all = self.table.said.lock().unwrap().clone();
        self.table.barrier.wait();
        Ok(all)
    }

    fn gather(&self, own: &[u8]) -> Result<Vec<Vec<u8>>, RanksError> {
        let all = self.all_gather(own)?;
        Ok(if self.rank == 0 { all } else { Vec::new() })
    }
}

fn table(size: usize) -> Arc<Table> {
    let (said, barrier) = (Mutex::new(vec![Vec::new(); size]), Barrier::new(size));
    Arc::new(Table { barrier, said, bytes: AtomicUsize::new(0) })
}

/// What each of so many ranks makes of the same work.
fn among<T: Send>(table: &Arc<Table>, size: usize, work: impl Fn(Ranks) -> T + Sync) -> Vec<T> {
    std::thread::scope(|scope| {
        let rank = |rank| {
            let seat = Seat { rank, size, table: Arc::clone(table) };
            let work = &work;
            scope.spawn(move || work(Ranks::of(Arc::new(seat))))
        };
        let threads: Vec<_> = (0..size).map(rank).collect();
        threads.into_iter().map(|t| t.join().unwrap()).collect()
    })
}

/// The built-in room with a lamp beside what emits, and a sky.
fn room() -> Scene {
    let mut scene = Scene::builtin("room").unwrap();
    scene.lamps.push(Lamp::Point {
        name: "lamp".into(),
        position: DVec3::new(1.0, 1.5, 1.0),
        intensity: DVec3::new(30.0, 20.0, 10.0),
        x_axis: DVec3::X,
        photometry: None,
    });
    scene.sky = DVec3::new(1.0, 2.0, 4.0);
    scene
}

fn options(patch_size: f64, tolerance: Option<f64>) -> LightOptions {
    LightOptions {
        patch_size: Some(patch_size),
        engine: EngineOptions::Rays(RaysOptions { samples: 256, seed: 3 }),
        tolerance,
        ..LightOptions::default()
    }
}

fn bits(values: &[Rgb]) -> Vec<[u64; 3]> {
    values.iter().map(|v| v.to_array().map(f64::to_bits)).collect()
}

/// How far two results are apart, as a share of the second.
fn apart(a: &[Rgb], b: &[Rgb]) -> f64 {
    let norm = |v: f64, x: Rgb| v + x.length_squared();
    let difference = a.iter().zip(b).map(|(a, b)| *a - *b).fold(0.0, norm);
    (difference / b.iter().copied().fold(0.0, norm)).sqrt()
}

#[test]
fn light_is_the_same_for_any_number_of_ranks() {
    let cornell = Scene::builtin("cornell-box").unwrap();
    let scenes = [(room(), options(0.05, Some(1e-7)), 1e-6), (cornell, options(0.02, None), 1e-3)];
    for (scene, options, near) in scenes {
        let alone = light(&scene, &options, &Silent).unwrap();
        let mut first: Option<[Vec<[u64; 3]>; 2]> = None;
        for size in [1, 2, 4, 7] {
            let table = table(size);
            let found = among(&table, size, |ranks| {
                let work = Work { ranks, kept: None };
                light_shared(&scene, &options, &work, &Silent).unwrap()
            });
            for solution in &found {
                assert!(apart(&solution.irradiance, &alone.irradiance) < near);
                assert!(apart(&solution.reflected, &alone.reflected) < 10.0 * near);
                assert_eq!(solution.usable, alone.usable);
                assert!(solution.halves.is_some());
                let now = [bits(&solution.irradiance), bits(&solution.reflected)];
                assert!(*first.get_or_insert_with(|| now.clone()) == now, "{size} ranks");
                let rows = |s: &hemicube::solution::Solution| s.report.rows.unwrap();
                assert_eq!(rows(solution).entries, rows(&alone).entries);
                let energy = |s: &hemicube::solution::Solution| s.report.energy.unwrap().absorbed;
                assert!((energy(solution)[1] / energy(&alone)[1] - 1.0).abs() < near);
            }
            let sweeps = |s: &hemicube::solution::Solution| s.report.solve.unwrap().iterations;
            // A sweep is 12 or 24 bytes a patch; the rest comes once.
            let bytes = table.bytes.load(Ordering::Relaxed) / alone.patches.len();
            assert!((12..60).contains(&(bytes / sweeps(&found[0]) as usize)), "{bytes} a patch");
            assert!(sweeps(&found[0]) <= 2 * sweeps(&alone));
        }
    }
}

#[test]
fn an_error_asked_for_is_reached_alike() {
    let scene = Scene::builtin("cornell-box").unwrap();
    let options = options(0.01, None);
    let found = |size| {
        let mut all = among(&table(size), size, |ranks| {
            let work = Work { ranks, kept: None };
            light_within_shared(&scene, &options, 0.05, &work, &Silent).unwrap()
        });
        all.pop().unwrap()
    };
    let (one, three) = (found(1), found(3));
    assert_eq!(bits(&one.0.irradiance), bits(&three.0.irradiance));
    assert_eq!(one.0.report.error, three.0.report.error);
    assert_eq!(one.1, three.1);
    assert!(one.0.report.error.unwrap().total <= 0.05);
}

/// Stops the work after so many rows, and remembers what it is warned of.
#[derive(Default)]
struct Stop {
    after: Option<u64>,
    rows: AtomicU64,
    warnings: Mutex<Vec<String>>,
}

impl Progress for Stop {
    fn stage(&self, _name: &str, _total: u64) {}

    fn advance(&self, n: u64) -> Result<(), Cancelled> {
        let rows = self.rows.fetch_add(n, Ordering::Relaxed) + n;
        if self.after.is_some_and(|after| rows > after) { Err(Cancelled) } else { Ok(()) }
    }

    fn warn(&self, message: &str) {
        self.warnings.lock().unwrap().push(message.to_owned());
    }
}

/// Solves the room by so many ranks, with rows kept beside the file, and writes that; yields its
/// bytes, the rows taken up, and warnings.
fn solved(path: &Path, size: usize, seed: u32) -> (Vec<u8>, u64, Vec<String>) {
    let scene = room();
    let mut options = options(0.02, None);
    options.engine = EngineOptions::Rays(RaysOptions { samples: 256, seed });
    let stop = Stop::default();
    let taken_up = among(&table(size), size, |ranks| {
        let folder = RowFolder::beside(path);
        let work = Work { ranks, kept: Some(&folder) };
        let found = sources(&scene, &[]).unwrap();
        let (store, factors) = scene.solve_shared(found, &options, &work, &stop).unwrap();
        write_hemi(path, &scene, &store, &factors, &Silent).unwrap();
        if factors.ranks().is_first() {
            folder.remove().unwrap();
        }
        folder.taken_up()
    });
    assert!(!Path::new(&format!("{}.rows", path.display())).exists());
    let warnings = stop.warnings.into_inner().unwrap();
    (fs::read(path).unwrap(), taken_up.iter().sum(), warnings)
}

/// The same by one rank that is stopped after so many rows.
fn stopped(path: &Path, after: u64) {
    let scene = room();
    among(&table(1), 1, |ranks| {
        let folder = RowFolder::beside(path);
        let work = Work { ranks, kept: Some(&folder) };
        let stop = Stop { after: Some(after), ..Stop::default() };
        let found = sources(&scene, &[]).unwrap();
        let error = scene.solve_shared(found, &options(0.02, None), &work, &stop).unwrap_err();
        assert!(is_cancelled(&error));
    });
}

#[test]
fn rows_of_a_run_that_was_stopped_serve_the_next() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let (whole, taken, warnings) = solved(&at("whole.hemi"), 2, 3);
    assert_eq!((taken, warnings.len()), (0, 0));
    // It is a file as any other.
    let scene = read_scene(&at("whole.hemi")).unwrap();
    let store = read_store(&at("whole.hemi"), &scene, 1 << 30, &Silent).unwrap();
    let factors = read_factors(&at("whole.hemi"), 1 << 30).unwrap();
    let alone = light(&room(), &options(0.02, None), &Silent).unwrap();
    let mixed = store.mix(&scene).unwrap();
    assert!(apart(&mixed.irradiance, &alone.irradiance) < 1e-3);
    assert_eq!(factors.entries(), alone.report.rows.unwrap().entries);
    // By other numbers of ranks, from the start and from what others left.
    assert!(solved(&at("one.hemi"), 1, 3).0 == whole);
    let path = at("stopped.hemi");
    stopped(&path, 3000);
    let rows: Vec<_> = fs::read_dir(at("stopped.hemi.rows")).unwrap().flatten().collect();
    assert!(rows.len() > 20, "{}", rows.len());
    let (again, taken, warnings) = solved(&path, 3, 3);
    assert!(again == whole && warnings.is_empty());
    assert!((2000..4000).contains(&taken), "{taken}");
    // One that is damaged is made again, one cut off too, and none of other options is used.
    stopped(&path, 3000);
    let mut rows: Vec<_> =
        fs::read_dir(at("stopped.hemi.rows")).unwrap().map(|e| e.unwrap().path()).collect();
    rows.sort();
    let bytes = fs::read(&rows[3]).unwrap();
    fs::write(&rows[3], &bytes[..bytes.len() / 2]).unwrap();
    let mut bytes = fs::read(&rows[5]).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    fs::write(&rows[5], bytes).unwrap();
    let (again, less, warnings) = solved(&path, 2, 3);
    assert!(again == whole && less < taken);
    assert!(warnings.len() == 2 && warnings.iter().all(|w| w.contains(".rows")), "{warnings:?}");
    stopped(&path, 3000);
    let (other, taken, warnings) = solved(&path, 2, 4);
    assert!(other != whole && taken == 0);
    assert!(warnings.iter().any(|w| w.contains("other options")), "{warnings:?}");
}

#[test]
fn what_ranks_cannot_share_is_refused() {
    let scene = room();
    let refused = |options: LightOptions| {
        let work = Work { ranks: Ranks::of(Arc::new(Mute)), kept: None };
        light_shared(&scene, &options, &work, &Silent).unwrap_err()
    };
    let usual = options(0.05, None);
    let hemicube = EngineOptions::Hemicube(HemicubeOptions::default());
    assert!(matches!(refused(LightOptions { engine: hemicube, ..usual }), LightError::Alone));
    let adaptive = Some(Adaptive { max_factor: 0.1, min_area: 0.01 });
    assert!(matches!(refused(LightOptions { adaptive, ..usual }), LightError::Alone));
    // One that hears nothing of the others stops.
    assert!(refused(usual).to_string().contains("no line"));
}

#[test]
fn ranks_with_other_models_or_options_do_not_work_together() {
    let usual = options(0.05, None);
    let lit = |of: &(dyn Fn(bool) -> (Scene, LightOptions) + Sync)| {
        among(&table(2), 2, |ranks| {
            let (scene, options) = of(ranks.is_first());
            let work = Work { ranks, kept: None };
            light_shared(&scene, &options, &work, &Silent).map(|solution| solution.irradiance)
        })
    };
    let other_rays = EngineOptions::Rays(RaysOptions { samples: 256, seed: 7 });
    let mut painted = room();
    painted.optics.reflectance[0] *= 0.5;
    for found in [
        lit(&|first| match first {
            true => (room(), usual),
            false => (room(), LightOptions { engine: other_rays, ..usual }),
        }),
        lit(&|first| (if first { room() } else { painted.clone() }, usual)),
    ] {
        for error in found.into_iter().map(Result::unwrap_err) {
            assert!(matches!(error, LightError::Ranks(RanksError::Different { rank: 1 })));
        }
    }
    // Each may have another memory: all take what all have.
    let memory = |first: bool| usual.memory >> u32::from(first);
    let found = lit(&|first| (room(), LightOptions { memory: memory(first), ..usual }));
    let found: Vec<_> = found.into_iter().map(Result::unwrap).collect();
    assert!(found[0] == found[1] && !found[0].is_empty());
    let too_little = lit(&|first| (room(), LightOptions { memory: memory(first) >> 30, ..usual }));
    for error in too_little.into_iter().map(Result::unwrap_err) {
        assert!(matches!(error, LightError::Memory { .. }));
    }
}

/// A rank that cannot reach others.
#[derive(Debug)]
struct Mute;

impl Communicator for Mute {
    fn rank(&self) -> usize {
        0
    }

    fn size(&self) -> usize {
        2
    }

    fn all_gather(&self, _own: &[u8]) -> Result<Vec<Vec<u8>>, RanksError> {
        Err(RanksError::Unreachable("no line".into()))
    }

    fn gather(&self, own: &[u8]) -> Result<Vec<Vec<u8>>, RanksError> {
        self.all_gather(own)
    }
}
