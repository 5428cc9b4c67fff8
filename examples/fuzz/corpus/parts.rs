//! What processes that share work leave to each other: plans and parts of matrices, and rows.

use std::error::Error;
use std::fs;
use std::path::Path;

use hemicube::engines::{Engine, Rays, RaysOptions};
use hemicube::export::{RowFolder, write_part, write_plan};
use hemicube::form_factors::{FormFactors, KeptRows};
use hemicube::matrix::Plan;
use hemicube::patches::{PatchId, Patches};
use hemicube::scene::Scene;
use hemicube::visibility::Bvh;
use hemicube::{MatrixOptions, Silent};

use super::stored::closed;
use super::{Input, Sound};

/// Bytes that a part may take.
const MEMORY: u64 = 1 << 28;

/// What rows are kept under.
pub const KEY: &str = "0123456789abcdef";

/// The plan of the closed scene, in several tiles.
pub fn plan_of(scene: &Scene) -> Result<Plan, Box<dyn Error>> {
    let options = MatrixOptions { patch_size: Some(0.02), ..MatrixOptions::default() };
    Ok(Plan::new(&scene.geometry, &options, &Silent)?)
}

pub fn plan() -> Sound {
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("plan.json");
    write_plan(&path, &plan_of(&closed()?)?)?;
    Ok(vec![Input::new("plan.json", fs::read(&path)?)])
}

/// The only part of a matrix, and the second of two.
pub fn part() -> Sound {
    let (scene, folder) = (closed()?, tempfile::tempdir()?);
    let plan = plan_of(&scene)?;
    let one = |number| -> Result<Vec<u8>, Box<dyn Error>> {
        let part = plan.part(&scene.geometry, number, MEMORY, &Silent)?;
        Ok(fs::read(write_part(folder.path(), &plan, &part, &Silent)?)?)
    };
    let halves = Input::new("part-2-of-2.npz", one((2, 2))?);
    Ok(vec![
        Input::new("part-1-of-1.npz", one((1, 1))?),
        halves.and("part-1-of-2.npz", one((1, 2))?),
    ])
}

/// The patches of the closed scene, all of which have a row.
pub fn patches(scene: &Scene) -> Result<Patches, Box<dyn Error>> {
    Ok(Patches::uniform(&scene.geometry, 0.1)?)
}

pub fn rows() -> Sound {
    let (scene, folder) = (closed()?, tempfile::tempdir()?);
    let (patches, bvh) = (patches(&scene)?, Bvh::new(&scene.geometry));
    let ids: Vec<PatchId> = patches.ids().collect();
    let mut factors = FormFactors::new(ids.len(), MEMORY);
    let options = RaysOptions { samples: 64, seed: 0 };
    let mut engine = Rays::new(&scene.geometry, &patches, &bvh, options);
    engine.make(&ids, &mut factors, &Silent)?;
    let result = folder.path().join("m.hemi");
    RowFolder::beside(&result).keep(KEY, &ids, &factors)?;
    let kept = folder.path().join("m.hemi.rows").join(name());
    Ok(vec![Input::new(&name(), fs::read(kept)?)])
}

/// The name of the file of rows.
fn name() -> String {
    format!("{KEY}-0.rows")
}

/// The result that the folder of a file of rows is beside.
pub fn result_of(rows: &Path) -> std::io::Result<std::path::PathBuf> {
    let folder = rows.with_file_name("m.hemi.rows");
    fs::create_dir_all(&folder)?;
    fs::rename(rows, folder.join(name()))?;
    Ok(rows.with_file_name("m.hemi"))
}
