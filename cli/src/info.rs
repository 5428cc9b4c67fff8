//! `hemicube info`: what a model holds, and what is doubtful about it.

use glam::DVec3;
use hemicube::scene::{Finding, Lamp, Scene, Severity, Sides, TriangleState, inspect};
use hemicube::units::Area;
use hemicube::visibility::{covered_triangles, looks_inside_out};

use crate::args::Info;
use crate::failure::Failure;
use crate::input;
use crate::solutions;
use crate::terminal::print;

/// Runs the command.
pub fn run(args: &Info) -> Result<(), Failure> {
    let mut scene = input::read(&args.input)?;
    let doubts = inspect(&scene);
    scene.findings.extend(doubts);
    if looks_inside_out(&scene.geometry) {
        scene.findings.push(Finding::new(
            Severity::Warning,
            "whole model",
            "most fronts see nothing while their backs see surfaces: the normals point outwards",
            "if it is a room, turn them round with --flip, or use --sides two; bodies seen from \
             outside are right so",
        ));
    }
    scene.findings.extend(covered(&scene));
    describe(&scene);
    solutions::describe(&args.input.model.scene, &scene)
}

/// Triangles that lie under something: their light and shade mean nothing.
fn covered(scene: &Scene) -> Option<Finding> {
    /// Each look projects all triangles: so many in all take some seconds.
    const PROJECTED: usize = 100_000_000;
    let g = &scene.geometry;
    let looked_at = (PROJECTED / g.len().max(1)).clamp(64, 5_000);
    let found = covered_triangles(g, looked_at);
    let first = found.first()?;
    let sampled =
        if g.len() > looked_at { format!(" of {looked_at} looked at") } else { String::new() };
    let surface = g.surfaces.get(g.surface_of[first.index()] as usize).map_or("?", |s| &s.name);
    Some(Finding::new(
        Severity::Note,
        format!("surface {surface}, triangle {}", first.0),
        format!(
            "{} triangles{sampled} are covered: most of what their centre sees are backs; the \
             first is here",
            found.len()
        ),
        "no harm if something stands there; else turn the covering faces round",
    ))
}

/// Four places after the point, or as many more as small numbers need.
fn numbers(v: DVec3, between: &str) -> String {
    let largest = v.abs().max_element();
    let small = largest > 0.0 && largest < 0.1;
    let places = if small { 3 - largest.log10().floor().max(-30.0) as i32 } else { 4 } as usize;
    v.to_array().map(|x| format!("{:.places$}", x + 0.0)).join(between)
}

fn describe(scene: &Scene) {
    let g = &scene.geometry;
    print(&scene.name);
    let count = |p: TriangleState| g.state.iter().filter(|&&q| q == p).count();
    print(&format!(
        "  triangles: {} ({} degenerate, {} duplicate, {} transparent)",
        g.len(),
        count(TriangleState::Degenerate),
        count(TriangleState::Duplicate),
        count(TriangleState::Transparent)
    ));
    let two = g.ids().filter(|t| g.sides[t.index()] == Sides::Two).count();
    print(&format!("  two-sided: {two} of {}", g.len()));
    let only_block = g.ids().filter(|t| g.sides[t.index()] == Sides::None).count();
    if only_block > 0 {
        print(&format!("  obstructions that only block: {only_block} of {}", g.len()));
    }
    if let Some((low, high)) = g.bounds() {
        let s = high - low;
        print(&format!("  size:      {} m", numbers(s, " x ")));
        print(&format!("  bounds:    {} to {} m", numbers(low, ","), numbers(high, ",")));
    }
    let area: f64 = g.ids().filter(|&t| g.is_solid(t)).map(|t| g.area(t)).sum();
    print(&format!("  area:      {}", Area(area)));
    print(&format!("  surfaces:  {}", g.surfaces.len()));
    print(&format!("  materials: {}", scene.optics.materials.len()));
    let mut triangles_of = vec![0_usize; scene.optics.materials.len()];
    scene.optics.material_of.iter().for_each(|&m| triangles_of[m as usize] += 1);
    for (material, triangles) in scene.optics.materials.iter().zip(triangles_of) {
        let rho = material.reflectance;
        let mut line = format!(
            "    {:20} {triangles:>8} triangles, reflectance {:.3},{:.3},{:.3}",
            material.name, rho.x, rho.y, rho.z
        );
        if material.reflectance_texture.is_some() {
            line += " x texture";
        }
        let l = material.radiance;
        if l.max_element() > 0.0 {
            line += &format!(", radiance {:.4},{:.4},{:.4}", l.x, l.y, l.z);
        }
        print(&line);
    }
    for lamp in &scene.lamps {
        let kind = match lamp {
            Lamp::Point { .. } => "point",
            Lamp::Spot { .. } => "spot",
            Lamp::Directional { .. } => "directional",
        };
        let flux = lamp.photometry().map_or(String::new(), |p| format!(", {:.0} lm", p.flux()));
        print(&format!("  lamp:      {} ({kind}{flux})", lamp.name()));
    }
    for camera in &scene.cameras {
        print(&format!("  camera:    {}", camera.name));
    }
    let findings: Vec<&Finding> = scene.findings.iter().collect();
    for (severity, label) in [(Severity::Warning, "warning"), (Severity::Note, "note")] {
        for text in input::grouped(&findings, severity) {
            print(&format!("  {label}: {text}"));
        }
    }
}
