//! Reads what processes that share work leave to each other.

use std::fs;
use std::path::Path;
use std::sync::OnceLock;

use hemicube::export::{Parts, RowFolder, read_plan, write_plan};
use hemicube::form_factors::{FormFactors, KeptRows, RowSink};
use hemicube::matrix::{Plan, Rows, merge_where};
use hemicube::patches::PatchId;
use hemicube::scene::Scene;
use hemicube::{MatrixOptions, Silent};

use crate::after::MEMORY;
use crate::corpus::parts::{KEY, patches, plan_of, result_of};
use crate::corpus::stored::closed;
use crate::kinds::Found;
use crate::read::text;

/// A scene and its plan, made once.
fn planned() -> Result<&'static (Scene, Plan), String> {
    static PLANNED: OnceLock<Result<(Scene, Plan), String>> = OnceLock::new();
    let make = || {
        let scene = closed().map_err(text)?;
        let plan = plan_of(&scene).map_err(text)?;
        Ok((scene, plan))
    };
    PLANNED.get_or_init(make).as_ref().map_err(Clone::clone)
}

/// A plan, whose checksum is made right if it can be one at all; and a part of it.
pub fn plan(path: &Path) -> Found {
    let bytes = fs::read(path).map_err(text)?;
    let file: serde_json::Value = serde_json::from_slice(&bytes).map_err(text)?;
    let plan = file.get("plan").cloned().unwrap_or_default();
    if let Ok(plan) = serde_json::from_value::<Plan>(plan) {
        write_plan(path, &plan).map_err(text)?;
    }
    let plan = read_plan(path).map_err(text)?;
    let scene = &planned()?.0;
    let part = plan.part(&scene.geometry, (1, 2), MEMORY, &Silent).map_err(text)?;
    let sound = |s: &f32| s.is_finite() && *s > 0.0;
    assert!(part.tiles.iter().flat_map(|t| &t.exchange).all(sound), "a part of a plan");
    Ok(())
}

/// The parts in the folder of one of them, joined.
pub fn part(path: &Path) -> Found {
    /// Rounding may leave a factor a little above 1.
    const MOST: f64 = 1.01;
    let (scene, plan) = planned()?;
    let folder = path.parent().ok_or("no folder")?;
    let parts = Parts::open(folder, plan, &Silent).map_err(text)?;
    let options = MatrixOptions { memory: MEMORY, ..MatrixOptions::default() };
    let matrix = merge_where(&scene.geometry, (plan, &parts), &options, &mut |_| Ok(None), &Silent);
    let matrix = matrix.map_err(text)?;
    let (mut columns, mut values) = (Vec::new(), Vec::new());
    for i in 0..matrix.len() {
        matrix.row(i, &mut columns, &mut values).map_err(text)?;
        assert!(values.iter().all(|f| (0.0..=MOST).contains(f)), "row {i}: {values:?}");
    }
    Ok(())
}

/// Rows that a run was to take up.
pub fn rows(path: &Path) -> Found {
    let scene = &planned()?.0;
    let patches = patches(scene).map_err(text)?;
    let ids: Vec<PatchId> = patches.ids().collect();
    let result = result_of(path).map_err(text)?;
    let mut factors = FormFactors::new(ids.len(), MEMORY);
    let blocks = RowFolder::beside(&result).take_up(KEY, &ids, &factors, &Silent);
    for block in blocks.ok_or("not taken up")? {
        factors.take(block).map_err(text)?;
    }
    let mut all = ids.iter().filter_map(|i| factors.row(*i)).flat_map(|row| row.columns);
    assert!(all.all(|j| j.index() < ids.len()), "a row leads out of the patches");
    Ok(())
}
