//! How many rays a second one thread traces, with each set of instructions at hand.
//!
//! `cargo bench --bench rays -- [MODEL] [--write FILE]`
//!
//! The model is a file or a built-in scene, by default the room. Rows of form factors are traced
//! from patches in short runs of neighbours all over it:
//!
//! - **hits**: only tracing is timed. 1,024 rays a row begin all over a patch, and their directions
//!   are a quasi-random set of the cosine distribution, sorted along a space-filling curve.
//! - **any**: the same rays, asked only whether they meet anything.
//! - **rows**: the same patches' rows as the engine makes them, rays made and patches found.
//!
//! How alike the rays are is told by how many triangles 16 in a row meet. `HEMICUBE_SIMD=portable`
//! (or `avx2`, `avx512`) measures that set alone. `--write` writes triangles and rays for another
//! ray tracer: two counts (u32), 9 numbers a triangle, then origin and direction of each ray (f32),
//! in units in which the model's radius is 1.

#![allow(clippy::print_stdout, reason = "a benchmark")]

use std::error::Error;
use std::f64::consts::{FRAC_PI_4, PI};
use std::io::{BufWriter, Write};
use std::path::Path;
use std::time::Instant;

use glam::{DVec2, DVec3, dvec2};
use hemicube::engines::{Engine, Rays, RaysOptions};
use hemicube::form_factors::Row;
use hemicube::patches::{PatchId, Patches};
use hemicube::scene::{Geometry, Scene};
use hemicube::simd::{Version, limit};
use hemicube::visibility::{Bvh, Frame, Hits, Packet};

/// Rays of a row.
const RAYS: usize = 1024;

/// Rows that are traced, in runs of neighbours.
const ROWS: usize = 2048;
const RUN: usize = 64;

/// Each time is the best of so many turns, which the sets of instructions take in turn.
const TURNS: usize = 5;

/// Patches aimed at, unless the model has more triangles.
const PATCHES: u64 = 40_000;

fn main() -> Result<(), Box<dyn Error>> {
    rayon::ThreadPoolBuilder::new().num_threads(1).build_global()?;
    let mut args = std::env::args().skip(1).filter(|a| a != "--bench");
    let (mut name, mut file) = ("room".to_owned(), None);
    while let Some(arg) = args.next() {
        match arg.as_str() {
            "--write" => file = args.next(),
            _ => name = arg,
        }
    }
    let scene =
        if Path::new(&name).exists() { Scene::load(&name)? } else { Scene::builtin(&name)? };
    let geometry = &scene.geometry;
    let patches = Patches::uniform(geometry, Patches::area_adding(geometry, PATCHES))?;
    let start = Instant::now();
    let bvh = Bvh::new(geometry);
    println!(
        "{name}: {} triangles, {} patches; hierarchy made in {:.1} ms, {} bytes a triangle",
        geometry.len(),
        patches.len(),
        1e3 * start.elapsed().as_secs_f64(),
        bvh.bytes() / bvh.ids().len().max(1) as u64,
    );
    let ids = chosen(&patches);
    let packets = packets(geometry, &patches, &bvh, &ids);
    if let Some(file) = file {
        write(Path::new(&file), geometry, &bvh, &packets)?;
    }
    let mut hits = vec![Hits::NONE; packets.len()];
    let mut blocked = vec![0; packets.len()];
    let mut rows = vec![Row::default(); ids.len()];
    let mut engine = Rays::new(geometry, &patches, &bvh, RaysOptions { samples: RAYS, seed: 0 });
    let versions = versions();
    let mut best = vec![[f64::INFINITY; 3]; versions.len()];
    for _ in 0..TURNS {
        for (&version, best) in versions.iter().zip(&mut best) {
            limit(version);
            let closest = seconds(|| bvh.closest(&packets, &mut hits));
            let any = seconds(|| bvh.blocked(&packets, &mut blocked));
            let mut made = Ok(());
            let whole = seconds(|| made = engine.fill(&ids, &mut rows));
            made?;
            *best = [best[0].min(closest), best[1].min(any), best[2].min(whole)];
        }
    }
    println!("16 rays meet {:.1} triangles", met(&hits));
    println!("{:>9}  {:>6}  {:>6}  {:>6}  Mray/s", "", "hits", "any", "rows");
    for (version, best) in versions.iter().zip(best) {
        let [hits, any, rows] = best.map(|t| 1e-6 * (RAYS * ids.len()) as f64 / t);
        let name = format!("{version:?}").to_lowercase();
        println!("{name:>9}  {hits:>6.2}  {any:>6.2}  {rows:>6.2}");
    }
    Ok(())
}

/// The sets of instructions that are measured.
fn versions() -> Vec<Version> {
    let only = std::env::var("HEMICUBE_SIMD").ok();
    let all = [Version::Portable, Version::Avx2, Version::Avx512];
    let chosen = |v: Version| only.as_ref().is_none_or(|o| *o == format!("{v:?}").to_lowercase());
    all.into_iter().filter(|&v| v <= Version::detect() && chosen(v)).collect()
}

/// Seconds of a processor that a piece of work takes, or of the clock where the system does not
/// tell.
fn seconds(work: impl FnOnce()) -> f64 {
    let (start, thread) = (Instant::now(), thread_seconds());
    work();
    let wall = start.elapsed().as_secs_f64();
    thread.zip(thread_seconds()).map_or(wall, |(from, to)| to - from)
}

/// Seconds that this process has had of a processor, where the system tells it.
fn thread_seconds() -> Option<f64> {
    let tasks = std::fs::read_dir("/proc/self/task").ok()?;
    let of = |path: &Path| -> Option<f64> {
        let text = std::fs::read_to_string(path.join("schedstat")).ok()?;
        Some(1e-9 * text.split_whitespace().next()?.parse::<f64>().ok()?)
    };
    tasks.map(|task| of(&task.ok()?.path())).sum()
}

/// Runs of neighbouring patches all over the model.
fn chosen(patches: &Patches) -> Vec<PatchId> {
    let runs = (ROWS / RUN).min(patches.len().div_ceil(RUN));
    let step = patches.len() / runs;
    (0..runs)
        .flat_map(|run| (run * step..patches.len().min(run * step + RUN)).map(|i| i as u32))
        .map(PatchId)
        .collect()
}

/// Packets of the rows of patches.
fn packets(geometry: &Geometry, patches: &Patches, bvh: &Bvh, ids: &[PatchId]) -> Vec<Packet> {
    let table = directions(RAYS);
    let mut packets = Vec::with_capacity(ids.len() * RAYS / 16);
    for &id in ids {
        let point = patches.center(id);
        let frame = Frame::on_surface(DVec3::ZERO, geometry.normal(point.triangle, point.side));
        let own = bvh.solid(point.triangle);
        for chunk in table.chunks(16) {
            let mut packet = Packet::EMPTY;
            for (lane, (local, u)) in chunk.iter().enumerate() {
                let origin = patches.sample(id, *u).position(geometry);
                let [x, y, z] = frame.axes;
                let direction = (x * local.x + y * local.y + z * local.z).as_vec3();
                packet.set(lane, bvh.local(origin), direction, f32::INFINITY, own);
            }
            packets.push(packet);
        }
    }
    packets
}

/// Directions about the z axis with a density of cos θ / π, each with a point of the unit square,
/// along a space-filling curve (Morton 1966).
fn directions(n: usize) -> Vec<(DVec3, DVec2)> {
    // The generalised golden ratio of four dimensions (Roberts 2018).
    const PHI: f64 = 1.167_303_978_261_418_7;
    let mut samples: Vec<[f64; 4]> =
        (1..=n).map(|i| [1, 2, 3, 4].map(|d| (i as f64 * PHI.powi(-d)).fract())).collect();
    let spread =
        |x: f64| (0..16).fold(0_u64, |m, b| m | ((x * 65536.0) as u64 >> b & 1) << (2 * b));
    samples.sort_by_key(|s| spread(s[0]) | spread(s[1]) << 1);
    samples.iter().map(|s| (cosine(s[0], s[1]), dvec2(s[2], s[3]))).collect()
}

/// The square onto the hemisphere by way of the disc (Shirley & Chiu 1997).
fn cosine(u: f64, v: f64) -> DVec3 {
    let (a, b) = (2.0 * u - 1.0, 2.0 * v - 1.0);
    let (r, angle) =
        if a.abs() > b.abs() { (a, FRAC_PI_4 * b / a) } else { (b, 0.5 * PI - FRAC_PI_4 * a / b) };
    let (x, y) = if b == 0.0 && a == 0.0 { (0.0, 0.0) } else { (r * angle.cos(), r * angle.sin()) };
    DVec3::new(x, y, (1.0 - x * x - y * y).max(0.0).sqrt())
}

/// How many triangles the rays of a packet meet, in the mean.
fn met(hits: &[Hits]) -> f64 {
    let distinct = |hits: &Hits| {
        let mut items = hits.item;
        items.sort_unstable();
        items.chunk_by(|a, b| a == b).count()
    };
    hits.iter().map(distinct).sum::<usize>() as f64 / hits.len() as f64
}

/// Writes triangles and rays.
fn write(file: &Path, geometry: &Geometry, bvh: &Bvh, packets: &[Packet]) -> std::io::Result<()> {
    let mut out = BufWriter::new(std::fs::File::create(file)?);
    for count in [bvh.ids().len(), 16 * packets.len()] {
        out.write_all(&(count as u32).to_le_bytes())?;
    }
    for &id in bvh.ids() {
        for number in geometry.corners(id).iter().flat_map(|&p| bvh.local(p).to_array()) {
            out.write_all(&number.to_le_bytes())?;
        }
    }
    for packet in packets {
        for lane in 0..16 {
            for number in packet.origin.iter().chain(&packet.direction).map(|axis| axis[lane]) {
                out.write_all(&number.to_le_bytes())?;
            }
        }
    }
    out.flush()
}
