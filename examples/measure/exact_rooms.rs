//! How long the exact matrix of an occluded scene takes, how that grows, and how good it is.
//!
//! ```text
//! cargo run --release --example exact_rooms
//! cargo run --release --example exact_rooms -- paper-3 1e-3 1.6 .4 .1
//! ```
//!
//! Without arguments: a closed room with three floating boxes, two of them turned, of some 500 to
//! 9,000 triangles. With arguments: a built-in scene, the error asked for, and largest areas of
//! patches in m². Some rows are held against two references: themselves at a tenth of the error and
//! with other rays, and sampled rows of 262,144 rays, whose own noise is taken out by multiplying
//! the deviations from two halves. The last column is the error that the engine states.

#![allow(clippy::print_stdout, reason = "an example")]

use std::error::Error;
use std::fs;
use std::time::Instant;

use glam::{DMat3, DVec3};
use hemicube::engines::{Engine, Exact, ExactOptions, Rays, RaysOptions};
use hemicube::form_factors::{FormFactors, Row};
use hemicube::patches::{PatchId, Patches};
use hemicube::progress::Silent;
use hemicube::scene::{Geometry, Material, SceneBuilder, Sides, Surface, builtin};
use hemicube::visibility::Bvh;

/// Rows that are held against references.
const ROWS: usize = 48;

/// Squares along the longest edge of the room.
const ROOMS: [usize; 3] = [8, 16, 32];

fn main() -> Result<(), Box<dyn Error>> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    println!(
        "{:>8} {:>9} {:>8} {:>8} {:>9} {:>9} {:>9} {:>9} {:>9} {:>9}",
        "patches",
        "triangles",
        "seconds",
        "user s",
        "RMS",
        "row |dF|",
        "by rays",
        "|lost|",
        "Mrays",
        "stated"
    );
    let mut times = Vec::new();
    if let [name, error, sizes @ ..] = &args[..] {
        let geometry = builtin::build(name).ok_or("no such scene")?.geometry;
        for size in sizes {
            let patches = Patches::uniform(&geometry, size.parse()?)?;
            times.push(measure(&geometry, &patches, error.parse()?)?);
        }
    } else {
        for squares in ROOMS {
            let geometry = room(squares);
            let patches = Patches::uniform(&geometry, f64::INFINITY)?;
            times.push(measure(&geometry, &patches, ExactOptions::default().error)?);
        }
    }
    if let [first, .., last] = times[..] {
        println!("time grows as n^{:.2}", (last.1 / first.1).ln() / (last.0 / first.0).ln());
    }
    Ok(())
}

/// Prints a line about the matrix of a scene; returns the number of patches and user seconds.
fn measure(
    geometry: &Geometry,
    patches: &Patches,
    error: f64,
) -> Result<(f64, f64), Box<dyn Error>> {
    let bvh = Bvh::new(geometry);
    let (start, user) = (Instant::now(), user_seconds());
    let mut engine = Exact::new(
        geometry,
        patches,
        &bvh,
        ExactOptions { error, ..ExactOptions::default() },
        &Silent,
    )?;
    let ids: Vec<PatchId> = patches.ids().collect();
    let mut factors = FormFactors::new(patches.len(), 16 << 30);
    engine.make(&ids, &mut factors, &Silent)?;
    let (seconds, user) = (start.elapsed().as_secs_f64(), user_seconds() - user);
    let ids: Vec<PatchId> = patches.ids().step_by(patches.len().div_ceil(ROWS)).collect();
    let mut fine = vec![Row::default(); ids.len()];
    Exact::new(
        geometry,
        patches,
        &bvh,
        ExactOptions { error: 0.1 * error, seed: 9, ..ExactOptions::default() },
        &Silent,
    )?
    .fill(&ids, &mut fine)?;
    let rays = [1, 2, 3, 4]
        .map(|seed| Rays::new(geometry, patches, &bvh, RaysOptions { samples: 1 << 16, seed }));
    let n = patches.len();
    let (mut square, mut off, mut rows, mut by_rays, mut ray_square) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for (&id, fine) in ids.iter().zip(&fine) {
        let (mut own, mut other) = (vec![0.0; n], vec![0.0; n]);
        factors.row(id).ok_or("no such row")?.entries().for_each(|(j, f)| own[j.index()] = f);
        fine.entries().for_each(|(j, f)| other[j.index()] = f);
        let mut halves = [vec![0.0; n], vec![0.0; n]];
        for (k, rays) in rays.iter().enumerate() {
            let mut row = Row::default();
            rays.row(id, &mut row);
            row.entries().for_each(|(j, f)| halves[k / 2][j.index()] += 0.5 * f);
        }
        for j in 0..n {
            let d = own[j] - other[j];
            (square, off, rows) = (square + other[j] * other[j], off + d * d, rows + d.abs());
            let [a, b] = [halves[0][j], halves[1][j]];
            by_rays += (own[j] - a) * (own[j] - b);
            ray_square += a * b;
        }
    }
    let lost = patches.ids().map(|id| factors.account(id).lost.abs()).sum::<f64>() / n as f64;
    let percent = |x: f64| format!("{:.4}%", 100.0 * x);
    println!(
        "{n:>8} {:>9} {seconds:>8.2} {user:>8.2} {:>9} {:>9} {:>9} {:>9} {:>9.1} {:>9}",
        geometry.len(),
        percent((off / square).sqrt()),
        percent(rows / ids.len() as f64),
        percent((f64::max(by_rays, 0.0) / ray_square).sqrt()),
        percent(lost),
        engine.counts()[2] as f64 * 1e-6,
        percent(engine.estimate()),
    );
    Ok((n as f64, user))
}

/// User time of this process so far in s, where the system tells.
fn user_seconds() -> f64 {
    let stat = fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let after = stat.rsplit(')').next().unwrap_or_default();
    let ticks: Option<f64> = after.split_whitespace().nth(11).and_then(|t| t.parse().ok());
    ticks.map_or(f64::NAN, |t| t / 100.0)
}

/// A closed room of 4 × 3 × 2.5 m with three floating boxes.
fn room(squares: usize) -> Geometry {
    let step = 4.0 / squares as f64;
    let mut b = SceneBuilder::new("occluded room");
    let s = b.surface(Surface { name: "walls".into(), node: 0, primitive: 0 });
    let m = b.material(Material::default());
    let mut cuboid = |centre: DVec3, size: DVec3, turn: DMat3, inward: bool| {
        for axis in 0..3 {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            let [nu, nv] = [u, v].map(|k| (size[k] / step).round().max(1.0) as usize);
            for far in [false, true] {
                let point = |i: usize, j: usize| {
                    let mut p = DVec3::ZERO;
                    p[axis] = if far { 0.5 } else { -0.5 };
                    p[u] = i as f64 / nu as f64 - 0.5;
                    p[v] = j as f64 / nv as f64 - 0.5;
                    centre + turn * (p * size)
                };
                for (i, j) in (0..nu).flat_map(|i| (0..nv).map(move |j| (i, j))) {
                    let mut q = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)];
                    if far == inward {
                        q.reverse();
                    }
                    let q = q.map(|(i, j)| b.vertex(point(i, j)));
                    b.triangle([q[0], q[1], q[2]], None, s, m, Sides::One);
                    b.triangle([q[0], q[2], q[3]], None, s, m, Sides::One);
                }
            }
        }
    };
    let at = DVec3::new;
    cuboid(at(2.0, 1.5, 1.25), at(4.0, 3.0, 2.5), DMat3::IDENTITY, true);
    cuboid(at(1.0, 0.9, 0.7), at(0.8, 0.6, 0.9), DMat3::from_rotation_z(0.4), false);
    cuboid(at(2.8, 1.9, 0.9), at(0.7, 0.9, 0.6), DMat3::IDENTITY, false);
    let turn = DMat3::from_rotation_y(0.5) * DMat3::from_rotation_x(0.3);
    cuboid(at(2.1, 1.0, 1.8), at(0.6, 0.6, 0.5), turn, false);
    b.finish().geometry
}
