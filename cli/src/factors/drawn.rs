//! Rows whose form factors are drawn (`--row` with `--surfaces FILE.vtu`).

use std::io;

use hemicube::export::DrawnRow;
use hemicube::matrix::{BACK, Rows, SurfaceRow, mean_row};
use hemicube::scene::{Grouping, Scene, Side, Sides};

use crate::args::{FaceSides, Factors};
use crate::failure::Failure;

/// Refuses rows that are neither a number nor a name that the matrix will have.
pub fn check_names(args: &Factors, scene: &Scene) -> Result<(), Failure> {
    let names = names(args, scene);
    let has = |name: &str| names.iter().any(|n| n == name);
    for row in &args.outcome.row {
        let front = row.strip_suffix(BACK).filter(|_| args.sides == FaceSides::Two);
        if has(row) || front.is_some_and(has) || row.parse::<usize>().is_ok() {
            continue;
        }
        /// So many are named.
        const NAMED: usize = 12;
        let more = if names.len() > NAMED { " and others" } else { "" };
        return Err(Failure::Input(format!(
            "{}: --row {row}: there is no surface of that name; give the number of a row, or one \
             of {}{more}",
            args.model.scene.display(),
            names[..names.len().min(NAMED)].join(", ")
        )));
    }
    Ok(())
}

/// Says which row is not there of a matrix that will have so many, lumped or not.
pub fn check_numbers(args: &Factors, scene: &Scene, rows: usize) -> Result<(), String> {
    let names = names(args, scene);
    let numbers = args.outcome.row.iter().filter(|row| !names.contains(row));
    match numbers.flat_map(|row| row.parse::<usize>()).find(|&row| row >= rows) {
        Some(row) => Err(format!(
            "{}: --row {row}: the matrix has {rows} rows, from 0",
            args.model.scene.display()
        )),
        None => Ok(()),
    }
}

/// The names of surfaces that have rows, or of what they are lumped to.
fn names(args: &Factors, scene: &Scene) -> Vec<String> {
    let g = &scene.geometry;
    let (names, of) = match args.outcome.group {
        Some(group) => {
            let Grouping { names, of } = scene.grouping(group.by().0);
            (names, of)
        }
        None => (g.surfaces.iter().map(|s| s.name.clone()).collect(), g.surface_of.clone()),
    };
    let mut has_row = vec![false; names.len()];
    for (&name, _) in of.iter().zip(&g.sides).filter(|(_, sides)| **sides != Sides::None) {
        has_row[name as usize] = true;
    }
    let rows = names.into_iter().zip(has_row);
    let mut names: Vec<String> = rows.filter_map(|(name, has)| has.then_some(name)).collect();
    if args.outcome.group.is_none() {
        names.sort();
        names.dedup();
    }
    names
}

/// The form factors from each of the rows: from all rows of a surface together where its name is
/// given.
pub fn drawn(
    args: &Factors,
    rows: &dyn Rows,
    surfaces: &[SurfaceRow],
) -> Result<Vec<DrawnRow>, Failure> {
    let name_of = |s: &SurfaceRow| match s.side {
        Some(Side::Back) if args.outcome.group.is_none() => format!("{}{BACK}", s.name),
        _ => s.name.clone(),
    };
    let mut drawn: Vec<DrawnRow> = Vec::new();
    for name in &args.outcome.row {
        if drawn.iter().any(|row| row.name == *name) {
            continue;
        }
        let mut which: Vec<usize> =
            (0..rows.len()).filter(|&i| name_of(&surfaces[i]) == *name).collect();
        if which.is_empty() {
            which.extend(name.parse().ok().filter(|&row: &usize| row < rows.len()));
        }
        let factors =
            mean_row(rows, surfaces, &which).map_err(|e: io::Error| Failure::failed(e))?;
        drawn.push(DrawnRow { name: name.clone(), factors });
    }
    Ok(drawn)
}
