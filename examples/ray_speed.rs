//! How many rays a second one core traces for area-sampled rows of form factors.
//!
//! `cargo run --release --example ray_speed [SCENE]`
//!
//! Rows of a built-in scene: rays begin all over a patch, and their directions are a quasi-random
//! set of the cosine distribution, sorted along a space-filling curve. Only tracing is timed, not
//! the making of rays. Each time is the best of several, and the thread's own where the system
//! tells it.

#![allow(clippy::print_stdout, reason = "an example")]

use std::error::Error;
use std::f64::consts::{FRAC_PI_4, PI};
use std::time::Instant;

use glam::{DVec2, DVec3, dvec2};
use hemicube::patches::{PatchId, Patches};
use hemicube::scene::{Geometry, Side, builtin};
use hemicube::visibility::{Bvh, Frame, Hits, Packet};

/// Rays of a row.
const ROWS: [usize; 4] = [256, 1024, 4096, 16384];

/// Rays traced for each figure.
const RAYS: usize = 4 << 20;

/// Each time is the best of so many.
const TURNS: usize = 5;

/// Largest area of a patch in m²: about 40,000 patches in the room.
const PATCH_SIZE: f64 = 0.0075;

fn main() -> Result<(), Box<dyn Error>> {
    let name = std::env::args().nth(1).unwrap_or_else(|| "room".to_owned());
    let scene = builtin::build(&name).ok_or("no such scene")?;
    let geometry = &scene.geometry;
    let patches = Patches::uniform(geometry, PATCH_SIZE)?;
    let start = Instant::now();
    let bvh = Bvh::new(geometry);
    println!(
        "{name}: {} source triangles, {} patches; hierarchy made in {:.1} ms, {} bytes a triangle",
        geometry.len(),
        patches.len(),
        1e3 * start.elapsed().as_secs_f64(),
        bvh.bytes() / bvh.ids().len().max(1) as u64,
    );
    println!("{:>9}  {:>16}  {:>16}", "rays/row", "closest, Mray/s", "blocked, Mray/s");
    for n in ROWS {
        let packets = rows(geometry, &patches, &bvh, n);
        let mut hits = vec![Hits::NONE; packets.len()];
        let mut blocked = vec![0; packets.len()];
        let rays = (16 * packets.len()) as f64;
        let closest = best_time(|| bvh.closest(&packets, &mut hits));
        let any = best_time(|| bvh.blocked(&packets, &mut blocked));
        println!("{n:>9}  {:>16.1}  {:>16.1}", rays / closest / 1e6, rays / any / 1e6);
    }
    Ok(())
}

/// Seconds, the best of several turns.
fn best_time(mut body: impl FnMut()) -> f64 {
    let mut best = f64::INFINITY;
    for _ in 0..TURNS {
        let (start, thread) = (Instant::now(), thread_seconds());
        body();
        let wall = start.elapsed().as_secs_f64();
        best = best.min(thread.zip(thread_seconds()).map_or(wall, |(from, to)| to - from));
    }
    best
}

/// Seconds that this thread has had of a processor, where the system tells it.
fn thread_seconds() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    Some(1e-9 * text.split_whitespace().next()?.parse::<f64>().ok()?)
}

/// Packets of the rows of patches spread all over the scene.
fn rows(geometry: &Geometry, patches: &Patches, bvh: &Bvh, n: usize) -> Vec<Packet> {
    let table = directions(n);
    let count = (RAYS / n).min(patches.len());
    let step = patches.len() / count;
    let ids = (0..count).map(|i| PatchId((i * step) as u32));
    ids.flat_map(|id| row(geometry, patches, bvh, id, &table)).collect()
}

/// The rays of one row.
fn row(
    geometry: &Geometry,
    patches: &Patches,
    bvh: &Bvh,
    id: PatchId,
    table: &[(DVec3, DVec2)],
) -> Vec<Packet> {
    let point = patches.center(id);
    let normal = geometry.normal(point.triangle, point.side);
    let frame = Frame::on_surface(DVec3::ZERO, normal);
    let own = (point.side == Side::Front).then_some(point.triangle).and_then(|t| bvh.solid(t));
    let mut packets = vec![Packet::EMPTY; table.len() / 16];
    for (i, (local, u)) in table.iter().enumerate() {
        let origin = patches.sample(id, *u).position(geometry);
        let [x, y, z] = frame.axes;
        let direction = x * local.x + y * local.y + z * local.z;
        packets[i / 16].set(i % 16, bvh.local(origin), direction.as_vec3(), f32::INFINITY, own);
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
