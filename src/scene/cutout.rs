//! Leaves and fences: a triangle whose texture is opaque in parts is cut along their outline when
//! the scene is built, so that all that comes after sees geometry alone.
//!
//! The outline is that of the bilinear alpha at the cutoff, within half a texel. It is found once a
//! texture, block by block, and clipped to each triangle that has it.

mod mask;
mod outline;
mod pieces;
#[cfg(test)]
mod tests;

use std::collections::{BTreeMap, HashMap};

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::geometry::{TriangleId, TriangleState, position_key};
use super::hash::Mixed;
use super::model::Scene;
use super::optics::{Material, OPAQUE_ALPHA, Optics};
use super::texture::{Alphas, TextureSampler};
use super::{Finding, Severity};
use mask::Mask;
use pieces::{Left, Pieces, pieces};

/// Most blocks of a mask that a triangle may meet, and points of outlines in it.
const MOST_IN_TRIANGLE: usize = 1 << 15;

/// Most of both in all triangles together: about as many pieces.
const MOST_IN_SCENE: usize = 1 << 19;

/// Points of outlines that may be looked at for each that lies in a triangle, on average.
const LOOKS: usize = 16;

/// Masks of fewer texels say no more than their mean.
const FEWEST_TEXELS: usize = 16;

/// Cuts triangles along the outline of what is opaque of their material's alpha texture, marks what
/// is clear as transparent, and says so. Pieces take the place of their triangle.
pub(super) fn cut(scene: &mut Scene) {
    let users = users(&scene.optics);
    let mut left: usize = users.values().map(Vec::len).sum();
    let mut budget = MOST_IN_SCENE;
    let mut decoded: Option<(u32, TextureSampler)> = None;
    let mut cuts = HashMap::new();
    for ((texture, cutoff), triangles) in users {
        if decoded.as_ref().is_none_or(|d| d.0 != texture) {
            // What does not decode is said where colours are averaged.
            decoded = scene.optics.textures[texture as usize].decode().ok().map(|s| (texture, s));
        }
        let share = (budget as f64 * triangles.len() as f64 / left as f64) as usize;
        left -= triangles.len();
        if let Some((_, sampler)) = &decoded {
            let cutoff = f64::from_bits(cutoff);
            let used = cut_all(scene, texture, sampler, cutoff, &triangles, share, &mut cuts);
            budget -= used.min(share);
        }
    }
    if !cuts.is_empty() {
        let pieces: usize = cuts.values().map(|p| p.triangles.len()).sum();
        scene.findings.push(Finding::new(
            Severity::Note,
            "whole model",
            format!(
                "{} triangles are cut along the outline of what is opaque, into {pieces} pieces",
                cuts.len()
            ),
            "",
        ));
        replace(scene, &cuts);
    }
}

/// The triangles of each alpha texture and cutoff (its bits, as it is positive).
fn users(optics: &Optics) -> BTreeMap<(u32, u64), Vec<usize>> {
    let mut users: BTreeMap<_, Vec<usize>> = BTreeMap::new();
    for (t, &m) in optics.material_of.iter().enumerate() {
        let material = &optics.materials[m as usize];
        if let Some(texture) = material.alpha_texture {
            users.entry((texture, cutoff(material).to_bits())).or_default().push(t);
        }
    }
    users
}

/// What a texture's alpha has to reach to be opaque.
fn cutoff(material: &Material) -> f64 {
    let cutoff = material.alpha_cutoff.unwrap_or(OPAQUE_ALPHA);
    if cutoff > 0.0 { cutoff / material.alpha.max(0.0) } else { 0.0 }
}

/// Decides all triangles of one texture, and returns what their pieces take of the budget.
fn cut_all(
    scene: &mut Scene,
    texture: u32,
    sampler: &TextureSampler,
    cutoff: f64,
    triangles: &[usize],
    budget: usize,
    cuts: &mut HashMap<usize, Pieces>,
) -> usize {
    let Scene { geometry, optics, findings, .. } = scene;
    let alphas = sampler.alphas();
    let name = format!("texture {}", optics.textures[texture as usize].name);
    let blends = |t: &usize| optics.material(TriangleId(*t as u32)).alpha_cutoff.is_none();
    if alphas.values.iter().any(|a| *a > 0.0 && *a < 1.0) && triangles.iter().any(blends) {
        findings.push(Finding::new(
            Severity::Note,
            name.clone(),
            format!("is translucent; alpha of {OPAQUE_ALPHA} or more is opaque, the rest clear"),
            "",
        ));
    }
    let size = [alphas.width, alphas.height];
    let footprints: Vec<_> =
        triangles.iter().map(|&t| optics.uv[t].map(|uv| sampler.texel_from_uv(uv))).collect();
    let chosen = choose(alphas, cutoff as f32, &footprints, budget);
    if let Some(Chosen { grid, .. }) = &chosen
        && *grid != size
    {
        let [width, height] = grid;
        findings.push(Finding::new(
            Severity::Note,
            name,
            format!(
                "what is opaque of it is followed on a grid of {width} x {height}, as more detail \
                 takes too many pieces; as much light passes"
            ),
            "repeat it less often, or model what it shows",
        ));
    } else if chosen.is_none() {
        findings.push(Finding::new(
            Severity::Warning,
            name,
            "has too much detail to be cut out; by their mean alpha, triangles are there or not",
            "repeat it less often, or model what it shows",
        ));
    }
    let texels = sampler.texel_share(triangles.iter().map(|&t| optics.uv[t]));
    let found: Vec<Left> = triangles
        .par_iter()
        .zip(&footprints)
        .map(|(&t, corners)| {
            let positions = geometry.corners(TriangleId(t as u32));
            let cut = chosen.as_ref().filter(|_| has_area(*corners)).and_then(
                |Chosen { mask, .. }| {
                    let places = corners.map(|at| mask.place(at));
                    pieces(mask, places, positions, MOST_IN_TRIANGLE).ok()
                },
            );
            cut.unwrap_or_else(|| {
                let (_, share) = sampler.mean_within(optics.uv[t], Some(cutoff), texels);
                if share < OPAQUE_ALPHA { Left::None } else { Left::All }
            })
        })
        .collect();
    for (&t, left) in triangles.iter().zip(found) {
        geometry.state[t] = match left {
            Left::None => TriangleState::Transparent,
            Left::All | Left::Pieces(_) => TriangleState::Solid,
        };
        if let Left::Pieces(pieces) = left {
            cuts.insert(t, pieces);
        }
    }
    chosen.map_or(0, |c| c.cost)
}

fn has_area([a, b, c]: [DVec2; 3]) -> bool {
    (b - a).perp_dot(c - a) != 0.0
}

/// A mask that is not too fine.
struct Chosen {
    mask: Mask,
    /// Columns and rows of texels or means of texels.
    grid: [usize; 2],
    /// What its pieces take of the budget.
    cost: usize,
}

/// The finest mask whose pieces the budget allows.
fn choose(
    mut alphas: Alphas,
    mut cutoff: f32,
    footprints: &[[DVec2; 3]],
    budget: usize,
) -> Option<Chosen> {
    let size = DVec2::new(alphas.width as f64, alphas.height as f64);
    let share = alphas.share(cutoff);
    let corners = || footprints.iter().flatten().copied();
    let reach = [
        corners().fold(DVec2::INFINITY, DVec2::min),
        corners().fold(DVec2::NEG_INFINITY, DVec2::max),
    ];
    loop {
        let grid = [alphas.width, alphas.height];
        if let Some(mask) = Mask::new(&alphas, cutoff, size, reach, budget)
            && let Some(cost) = cost(&mask, footprints, budget)
        {
            return Some(Chosen { mask, grid, cost });
        }
        if alphas.values.len() < FEWEST_TEXELS {
            return None;
        }
        alphas = alphas.coarser();
        cutoff = alphas.cutoff_of(share);
    }
}

/// Blocks that triangles meet together, and points of outlines in them; `None` if they exceed a
/// budget.
fn cost(mask: &Mask, footprints: &[[DVec2; 3]], budget: usize) -> Option<usize> {
    let (mut sum, mut looks) = (0, 0);
    for corners in footprints.iter().filter(|corners| has_area(**corners)) {
        let mut cost = 0;
        let [a, b, c] = corners.map(|at| mask.place(at));
        let sign = (b - a).perp_dot(c - a).signum();
        let is_within = |p: DVec2| {
            let edges = [(a, b), (b, c), (c, a)];
            edges.iter().all(|(from, to)| (to - from).perp_dot(p - from) * sign >= 0.0)
        };
        let met = mask.visit([a, b, c], MOST_IN_TRIANGLE, |block, offset| {
            let points = block.outlines.iter().flatten();
            cost += 1 + points.filter(|p| is_within(*p + offset)).count();
            looks += block.points;
        });
        sum += cost;
        if met.is_err() || cost > MOST_IN_TRIANGLE || sum > budget || looks > LOOKS * budget {
            return None;
        }
    }
    Some(sum)
}

/// Puts pieces in the place of their triangles.
fn replace(scene: &mut Scene, cuts: &HashMap<usize, Pieces>) {
    let Scene { geometry: g, optics: o, .. } = scene;
    let mut vertices: HashMap<[u64; 3], u32, Mixed> = HashMap::default();
    let (mut triangles, mut uvs, mut face_of) = (Vec::new(), Vec::new(), Vec::new());
    for (t, (&vertex, &uv)) in g.triangles.iter().zip(&o.uv).enumerate() {
        let Some(pieces) = cuts.get(&t) else {
            triangles.push(vertex);
            uvs.push(uv);
            face_of.push(t as u32);
            continue;
        };
        let corners: Vec<(u32, DVec2)> = pieces
            .corners
            .iter()
            .map(|corner| {
                let w = corner.weights;
                let own = (0..3).find(|&k| w[k] == 1.0).map(|k| vertex[k]);
                let new = || {
                    *vertices.entry(position_key(corner.position)).or_insert_with(|| {
                        g.vertices.push(corner.position);
                        (g.vertices.len() - 1) as u32
                    })
                };
                (own.unwrap_or_else(new), uv[0] * w.x + uv[1] * w.y + uv[2] * w.z)
            })
            .collect();
        g.cut_faces.insert(t as u32, vertex);
        for piece in &pieces.triangles {
            triangles.push(piece.map(|c| corners[c].0));
            uvs.push(piece.map(|c| corners[c].1));
            face_of.push(t as u32);
        }
    }
    o.tint.resize(if o.tint.is_empty() { 0 } else { g.len() }, DVec3::ONE);
    (g.triangles, o.uv) = (triangles, uvs);
    take(&mut g.sides, &face_of);
    take(&mut g.state, &face_of);
    take(&mut g.surface_of, &face_of);
    take(&mut o.material_of, &face_of);
    if !o.tint.is_empty() {
        take(&mut o.tint, &face_of);
    }
    g.face_of = face_of;
}

/// What each triangle has of its face.
fn take<T: Copy>(of: &mut Vec<T>, face_of: &[u32]) {
    *of = face_of.iter().map(|&face| of[face as usize]).collect();
}
