//! The paper's own figures.

/// Table 1: classical radiosity and hemicubes.
pub const TABLE1: &str = include_str!("table1.csv");
/// Table 2: uniform and adaptive subdivision at a tolerance of .02.
pub const TABLE2: &str = include_str!("table2.csv");
/// Table 3: adaptive subdivision at eight tolerances.
pub const TABLE3: &str = include_str!("table3.csv");

/// The tolerance of table 2: the largest that showed no visible loss of quality.
pub const TOLERANCE: f64 = 0.02;

/// Scenes by number, from 1.
pub const SCENES: [&str; 3] = ["paper-1", "paper-2", "paper-3"];

/// The numbers of a table, row by row, without its header.
pub fn rows(table: &str) -> Vec<Vec<f64>> {
    table
        .lines()
        .skip(1)
        .map(|line| line.split(',').filter_map(|field| field.trim().parse().ok()).collect())
        .collect()
}

/// What tables 1 and 2 say about a scene (1 to 3) at a size: the columns after these two.
pub fn of<const N: usize>(table: &str, scene: usize, size: f64) -> [f64; N] {
    let found = rows(table)
        .into_iter()
        .find(|r| r.first() == Some(&(scene as f64)) && r.get(1) == Some(&size));
    found.and_then(|r| r.get(2..)?.try_into().ok()).unwrap_or([f64::NAN; N])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_cell_of_the_tables_is_there() {
        for scene in 1..=SCENES.len() {
            for size in [10.0, 1.0, 0.7, 0.1] {
                let [n, classical, hemicube, gain] = of(TABLE1, scene, size);
                assert!(((classical / hemicube - 1.0) * 100.0 - gain).abs() < 0.02);
                let [uniform, adaptive, t1, t2, gain] = of(TABLE2, scene, size);
                assert!(((t1 / t2 - 1.0) * 100.0 - gain).abs() < 0.02);
                assert!(uniform == n && adaptive < uniform);
            }
        }
        assert_eq!(rows(TABLE3).len(), 8);
        assert!(rows(TABLE3).iter().all(|r| r.len() == 5));
    }
}
