//! Light of sources as arrays.

use std::collections::HashMap;
use std::io::{self, Seek, Write};
use std::path::Path;
use std::sync::Arc;

use glam::DVec2;

use super::manifest::{LightHead, RowsHead};
use super::rows;
use crate::export::archive::{Archive, finite, float, integer, word};
use crate::export::members::{Members, Packing};
use crate::export::npz::read::ReadError;
use crate::form_factors::FormFactors;
use crate::patches::{Cell, MAX_PATCHES, PatchId, Patches, SplitCells, SurfacePoint};
use crate::progress::{Cancelled, Progress, is_cancelled};
use crate::scene::{Rgb, Scene};
use crate::solution::{Balance, MeshOptions};
use crate::store::Store;

/// The folder of rows with what may emit alone.
const TO_EMITTERS: &str = "light/to_emitters";

/// Writes what mixing needs.
pub fn write<W: Write + Seek>(
    to: &mut Members<'_, W>,
    store: &Store,
) -> io::Result<(LightHead, RowsHead)> {
    let (s, p) = (store.balances.len(), store.patches.len());
    let levels = store.patches.levels().unwrap_or_default();
    to.array("light/levels", &[levels.len()], Packing::Packed, levels.into_iter())?;
    to.array("light/usable", &[p], Packing::Packed, store.usable.iter().map(|u| u8::from(*u)))?;
    let (moved, origins): (Vec<_>, Vec<_>) = store.patches.moved_origins().into_iter().unzip();
    let k = moved.len();
    to.array("light/moved", &[k], Packing::Packed, moved.into_iter().map(|i| i.0))?;
    let origins = origins.into_iter().flat_map(|uv| uv.to_array());
    to.array("light/origins", &[k, 2], Packing::Packed, origins)?;
    let mut of_all = |name: &str, of: &dyn Fn(&Balance) -> &[Rgb]| {
        let all = store.balances.iter().flat_map(of);
        let numbers = all.flat_map(|v| v.as_vec3().to_array());
        to.array(&format!("light/{name}"), &[s, p, 3], Packing::Plain, numbers)
    };
    of_all("irradiance", &|b| &b.irradiance)?;
    of_all("direct", &|b| &b.direct)?;
    of_all("arrived", &|b| &b.arrived)?;
    let sampled = s > 0 && store.balances.iter().all(|b| b.spread.is_some());
    if sampled {
        of_all("spread", &|b| b.spread.as_ref().map_or(&[][..], |s| &s[0]))?;
        of_all("spread_direct", &|b| b.spread.as_ref().map_or(&[][..], |s| &s[1]))?;
    }
    let rows = rows::write(to, TO_EMITTERS, &store.to_emitters)?;
    let MeshOptions { patch_size, cluster, min_area } = store.mesh;
    let head = LightHead {
        patches: p as u64,
        patch_size: Some(patch_size).filter(|size| size.is_finite()),
        cluster,
        min_area,
        moved: k as u64,
        mesh: store.patches.fingerprint(),
        engine: store.engine.clone(),
        sampled,
        sources: store.sources.clone(),
        energy: store.balances.iter().map(|b| b.energy).collect(),
    };
    Ok((head, rows))
}

/// The arrays of light, as they stand in the file.
pub struct Arrays {
    levels: Vec<u8>,
    moved: Vec<u32>,
    origins: Vec<f64>,
    usable: Vec<bool>,
    balances: Vec<Balance>,
    to_emitters: FormFactors,
}

/// Bytes that a source takes a patch: five triples of doubles.
pub const SOURCE_BYTES: u64 = 5 * 24;

/// Reads what [`write`] wrote.
pub fn read(
    from: &mut Archive,
    head: &LightHead,
    rows: &RowsHead,
    memory: u64,
) -> Result<Arrays, String> {
    let (s, p) = (head.sources.len(), head.patches);
    if head.energy.len() != s || p > MAX_PATCHES {
        return Err("manifest.json does not say how many sources and patches there are".into());
    }
    let adaptive = if head.min_area.is_some() { p } else { 0 };
    let level = |kind, b: &[u8]| integer(kind, b).and_then(|l| u8::try_from(l).ok());
    let levels = from.numbers("light/levels", adaptive, level)?;
    let usable = from.numbers("light/usable", p, |kind, b| Some(integer(kind, b)? != 0))?;
    let moved = from.numbers("light/moved", head.moved, word)?;
    let within = |kind, b: &[u8]| float(kind, b).filter(|x| (0.0..=1.0).contains(x));
    let origins = from.numbers("light/origins", head.moved.saturating_mul(2), within)?;
    let on_triangle = |uv: &[f64; 2]| uv[0] + uv[1] <= 1.0 + f64::EPSILON;
    if !origins.as_chunks::<2>().0.iter().all(on_triangle) {
        return Err("light/origins.npy leads off the patches".into());
    }
    // Sampled light may be a little below zero (`direct/analytic.rs`).
    let mut of_all = |name: &str| -> Result<Vec<Vec<Rgb>>, String> {
        let all = from.numbers(&format!("light/{name}"), 3 * p * s as u64, finite)?;
        let threes = all.as_chunks::<3>().0;
        let of_source = |k: usize| {
            let own = &threes[k * p as usize..][..p as usize];
            own.iter().map(|v| Rgb::from_array(*v)).collect()
        };
        Ok((0..s).map(of_source).collect())
    };
    let irradiance = of_all("irradiance")?;
    let direct = of_all("direct")?;
    let arrived = of_all("arrived")?;
    let spread = match head.sampled {
        true => {
            let both = of_all("spread")?.into_iter().zip(of_all("spread_direct")?);
            both.map(|(all, direct)| Some([all, direct])).collect()
        }
        false => vec![None; s],
    };
    let values = irradiance.into_iter().zip(direct).zip(arrived).zip(spread).zip(&head.energy);
    let balances = values
        .map(|((((irradiance, direct), arrived), spread), &energy)| Balance {
            direct,
            irradiance,
            arrived,
            spread,
            energy,
            solved: None,
        })
        .collect();
    let to_emitters = rows::read(from, TO_EMITTERS, rows, p, memory)?;
    Ok(Arrays { levels, moved, origins, usable, balances, to_emitters })
}

/// Why light cannot be laid on a scene.
const OTHER_PATCHES: &str = "its patches are not those that this version makes of the scene";

/// The solutions of a scene from what its file holds, in at most `memory` bytes.
pub fn store(
    path: &Path,
    scene: &Scene,
    head: LightHead,
    arrays: Arrays,
    reflectance: &[f64],
    memory: u64,
    progress: &dyn Progress,
) -> Result<Store, ReadError> {
    /// Bytes that a patch of the finest mesh takes.
    const FINEST_BYTES: u64 = 64;
    let broken = |problem: &str| ReadError::Broken { path: path.into(), problem: problem.into() };
    let Arrays { levels, moved, origins, usable, balances, to_emitters } = arrays;
    let patch_size = head.patch_size.unwrap_or(f64::INFINITY);
    let mesh = MeshOptions { patch_size, cluster: head.cluster, min_area: head.min_area };
    // What a file claims may be a billion patches.
    let count = mesh.count(scene).map_err(|e| broken(&e.to_string()))?;
    let needed = count.saturating_mul(FINEST_BYTES);
    let joined = 2 * scene.geometry.len() as u64;
    if mesh.min_area.is_none() && count > head.patches.saturating_add(joined) {
        return Err(broken(OTHER_PATCHES));
    } else if needed > memory {
        let what = format!("{count} patches");
        return Err(ReadError::Memory { path: path.into(), what, needed, allowed: memory });
    }
    let finest = mesh.subdivide(scene, progress).map_err(|e| match is_cancelled(&e) {
        true => Cancelled.into(),
        false => broken(&e.to_string()),
    })?;
    let mut at = HashMap::new();
    for (&id, uv) in moved.iter().zip(origins.as_chunks::<2>().0) {
        if id as usize >= finest.len() {
            return Err(broken("light/moved.npy names no patch"));
        }
        let Cell { triangle, side, .. } = finest.cell(PatchId(id));
        at.insert(PatchId(id), SurfacePoint { triangle, side, uv: DVec2::from_array(*uv) });
    }
    let finest = match at.is_empty() {
        true => finest,
        false => finest.with_origins(at, progress)?,
    };
    let patches: Option<Patches> = match head.min_area {
        Some(_) => SplitCells::of_levels(Arc::new(finest), &levels),
        None => Some(finest),
    };
    let is_same = |p: &Patches| p.len() as u64 == head.patches && p.fingerprint() == head.mesh;
    let patches = patches.filter(is_same).ok_or_else(|| broken(OTHER_PATCHES))?;
    Ok(Store {
        patches: Arc::new(patches),
        sources: head.sources,
        balances,
        usable,
        to_emitters,
        mesh,
        engine: head.engine,
        reflectance: reflectance.as_chunks::<3>().0.iter().map(|v| Rgb::from_array(*v)).collect(),
        stages: Vec::new(),
    })
}
