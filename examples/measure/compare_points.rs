//! Irradiance of the field at reference points: `compare_points MODEL POINTS.csv [AREA] [PIXELS]`.
//!
//! The CSV has columns x, y, z, nx, ny, nz, covered, E_r, E_g, E_b. Prints the RMS and the worst of
//! the relative error of luminance over uncovered points brighter than 1 % of the mean.

#![allow(clippy::print_stdout, reason = "an example")]

use std::error::Error;
use std::path::Path;

use glam::{DVec2, DVec3};
use hemicube::engines::EngineOptions;
use hemicube::engines::HemicubeOptions;
use hemicube::patches::SurfacePoint;
use hemicube::progress::Silent;
use hemicube::scene::{Geometry, ImportOptions, Side, load, luminance};
use hemicube::solution::{LightOptions, light};

fn main() -> Result<(), Box<dyn Error>> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let [model, points, rest @ ..] = &args[..] else {
        return Err("usage: compare_points MODEL POINTS.csv [AREA] [PIXELS]".into());
    };
    let scene = load(Path::new(model), &ImportOptions::default())?;
    let patch_size = rest.first().map(|a| a.parse()).transpose()?;
    let resolution = rest.get(1).map_or(Ok(128), |r| r.parse())?;
    let options = LightOptions {
        patch_size,
        engine: EngineOptions::Hemicube(HemicubeOptions {
            resolution,
            ..HemicubeOptions::default()
        }),
        ..LightOptions::default()
    };
    let solution = light(&scene, &options, &Silent)?;
    let field = solution.field(&scene);
    let text = std::fs::read_to_string(points)?;
    let mut lines = text.lines();
    let header: Vec<&str> = lines.next().unwrap_or_default().split(',').collect();
    let column = |name: &str| header.iter().position(|h| *h == name).ok_or(format!("no {name}"));
    let names = ["x", "y", "z", "nx", "ny", "nz", "covered", "E_r", "E_g", "E_b"];
    let at: Vec<usize> = names.iter().map(|n| column(n)).collect::<Result<_, _>>()?;
    let mut pairs = Vec::new();
    for line in lines {
        let cells: Vec<&str> = line.split(',').collect();
        let v: Vec<f64> = at.iter().map(|&i| cells[i].parse()).collect::<Result<_, _>>()?;
        if v[6] == 0.0 {
            let (p, n) = (DVec3::new(v[0], v[1], v[2]), DVec3::new(v[3], v[4], v[5]));
            let Some(point) = nearest(&scene.geometry, p, n) else { continue };
            let got = luminance(field.at(point));
            pairs.push((got, luminance(DVec3::new(v[7], v[8], v[9])), line.to_owned()));
        }
    }
    let mean = pairs.iter().map(|p| p.1).sum::<f64>() / pairs.len() as f64;
    pairs.retain(|p| p.1 > 0.01 * mean);
    let error = |p: &(f64, f64, String)| p.0 / p.1 - 1.0;
    let rms = (pairs.iter().map(|p| error(p).powi(2)).sum::<f64>() / pairs.len() as f64).sqrt();
    pairs.sort_by(|a, b| error(b).abs().total_cmp(&error(a).abs()));
    println!("{} patches, {} points", solution.patches.len(), pairs.len());
    println!(
        "RMS {:.2} %, median {:.2} %",
        100.0 * rms,
        100.0 * error(&pairs[pairs.len() / 2]).abs()
    );
    for p in pairs.iter().take(8) {
        println!("{:+.1} %: {:.5} for {:.5} at {}", 100.0 * error(p), p.0, p.1, &p.2);
    }
    Ok(())
}

/// The point of the surface that faces `normal` nearest to `p`.
fn nearest(geometry: &Geometry, p: DVec3, normal: DVec3) -> Option<SurfacePoint> {
    let on = |t| -> Option<(f64, SurfacePoint)> {
        let facing = geometry.normal(t, Side::Front).dot(normal);
        let side = if facing > 0.0 { Side::Front } else { Side::Back };
        let [a, b, c] = geometry.corners(t);
        let n = (b - a).cross(c - a);
        let u = n.dot((p - a).cross(c - a)) / n.length_squared();
        let v = n.dot((b - a).cross(p - a)) / n.length_squared();
        let inside = u > -1e-9 && v > -1e-9 && u + v < 1.0 + 1e-9 && facing.abs() > 0.99;
        let distance = (p - a).dot(n.normalize()).abs();
        (inside && geometry.is_solid(t) && distance < 1e-3)
            .then_some((distance, SurfacePoint { triangle: t, side, uv: DVec2::new(u, v) }))
    };
    geometry.ids().filter_map(on).min_by(|a, b| a.0.total_cmp(&b.0)).map(|x| x.1)
}
