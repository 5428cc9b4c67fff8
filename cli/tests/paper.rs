//! `hemicube paper --quick`: everything is there and finite. Gains and exponents are printed, not
//! asserted: they depend on the machine.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

/// A CSV file: its columns, and its rows as text.
struct Csv {
    columns: Vec<String>,
    rows: Vec<Vec<String>>,
}

impl Csv {
    fn read(path: &Path) -> Self {
        let text = fs::read_to_string(path).unwrap_or_default();
        let mut lines =
            text.lines().map(|l| l.split(',').map(String::from).collect::<Vec<String>>());
        Self { columns: lines.next().unwrap_or_default(), rows: lines.collect() }
    }

    /// A column by name, as numbers; `NaN` where there is none.
    fn column(&self, name: &str) -> Vec<f64> {
        let at = self.columns.iter().position(|c| c == name);
        assert!(at.is_some(), "no column {name} in {:?}", self.columns);
        let number = |row: &Vec<String>| at.and_then(|at| row[at].parse().ok());
        self.rows.iter().map(|row| number(row).unwrap_or(f64::NAN)).collect()
    }

    /// Every row has every column, and all that is not a truth value is a finite number.
    fn assert_finite(&self, name: &str) {
        for row in &self.rows {
            assert_eq!(row.len(), self.columns.len(), "{name}: {row:?}");
            for (column, cell) in self.columns.iter().zip(row) {
                let finite = cell.parse().is_ok_and(f64::is_finite);
                let truth = column.ends_with("estimated") && cell.parse::<bool>().is_ok();
                assert!(finite || truth, "{name}: {column}: {cell}");
            }
        }
    }
}

fn paper(arguments: &[&str], folder: &Path) -> std::io::Result<Output> {
    Command::new(env!("CARGO_BIN_EXE_hemicube"))
        .arg("paper")
        .args(arguments)
        .arg("-o")
        .arg(folder)
        .output()
}

#[expect(clippy::print_stdout, reason = "gains are worth knowing, and not to be asserted")]
#[test]
fn a_quick_run_yields_all_tables_plots_and_pictures() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("new folder");
    let run = paper(&["all", "--quick"], &out).unwrap();
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let listed = String::from_utf8_lossy(&run.stdout).into_owned();
    for file in listed.lines() {
        assert!(fs::metadata(file).unwrap().len() > 0, "{file}");
    }

    let table1 = Csv::read(&out.join("table1.csv"));
    table1.assert_finite("table1");
    assert_eq!(table1.column("paper_fragments"), [552.0, 2796.0, 4676.0, 6896.0, 8148.0, 13744.0]);
    for deviation in table1.column("fragments_deviation_percent") {
        assert!(deviation.abs() < 9.0, "{deviation}");
    }
    let fragments = table1.column("fragments");
    for way in ["classical", "patches", "sources"] {
        assert!(table1.column(&format!("{way}_s")).iter().all(|s| *s > 0.0));
        let measured = table1.column(&format!("{way}_rows_measured"));
        assert!(measured.iter().zip(&fragments).all(|(m, n)| *m >= 1.0 && m <= n));
    }
    assert!(table1.column("classical_tests_per_s").iter().all(|t| *t > 0.0));

    let table2 = Csv::read(&out.join("table2.csv"));
    table2.assert_finite("table2");
    assert_eq!(table2.column("fragments_uniform"), fragments);
    let [rows, adaptive] = ["rows_adaptive", "fragments_adaptive"].map(|c| table2.column(c));
    assert!(adaptive.iter().zip(&fragments).all(|(a, n)| a <= n));
    assert!(rows.iter().zip(&fragments).all(|(r, n)| r <= n), "no row is made twice");

    let table3 = Csv::read(&out.join("table3.csv"));
    table3.assert_finite("table3");
    assert_eq!(table3.column("tolerance"), [0.5, 0.4, 0.3, 0.2, 0.1, 0.05, 0.02, 0.01]);
    for scene in ["scene1_fragments", "scene2_fragments"] {
        assert!(table3.column(scene).is_sorted(), "smaller tolerances split more");
    }

    let quality = Csv::read(&out.join("quality.csv"));
    quality.assert_finite("quality");
    assert_eq!(quality.rows.len(), 3);
    assert!(quality.column("rms_patches_percent").iter().all(|r| (0.0..50.0).contains(r)));

    let document = fs::read_to_string(out.join("paper.md")).unwrap();
    assert!(document.contains("A quick look") && !document.contains('{'), "{document}");
    let images: Vec<&str> =
        document.split("](").skip(1).filter_map(|rest| rest.split(')').next()).collect();
    assert_eq!(images.len(), 4 + 3 * 4);
    for image in images {
        assert!(out.join(image).is_file(), "{image}");
    }
    for gains in ["patches_gain_percent", "sources_gain_percent"] {
        println!("{gains}: {:?}", table1.column(gains));
    }
    println!("adaptive gain_percent: {:?}", table2.column("gain_percent"));
    let growth = document.split("How time grows").nth(1).unwrap_or_default();
    println!("exponents: {}", growth.split("Row by row").next().unwrap_or_default());
}

#[test]
fn one_table_alone_says_what_is_missing() {
    let folder = tempfile::tempdir().unwrap();
    let run = paper(&["table2", "--quick"], folder.path()).unwrap();
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    assert!(folder.path().join("table2.csv").is_file());
    assert!(!folder.path().join("table1.csv").exists());
    let document = fs::read_to_string(folder.path().join("paper.md")).unwrap();
    assert_eq!(document.matches("Not part of this run").count(), 3);
}

#[test]
fn a_folder_that_cannot_be_is_bad_input() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("file");
    fs::write(&file, "x").unwrap();
    let run = paper(&["table2", "--quick"], &file).unwrap();
    assert_eq!(run.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&run.stderr).contains("file"));
}

#[cfg(unix)]
#[test]
fn an_interrupt_ends_with_130_and_leaves_nothing_half_written() {
    let folder = tempfile::tempdir().unwrap();
    let mut run = Command::new(env!("CARGO_BIN_EXE_hemicube"))
        .args(["paper", "table1", "-o"])
        .arg(folder.path())
        .stderr(std::process::Stdio::null())
        .spawn()
        .unwrap();
    // Well within the minutes that it would take, and after the handler is there.
    std::thread::sleep(std::time::Duration::from_secs(2));
    let sent = Command::new("kill").args(["-INT", &run.id().to_string()]).status();
    assert!(sent.is_ok_and(|s| s.success()));
    assert_eq!(run.wait().unwrap().code(), Some(130));
    let left: Vec<_> =
        fs::read_dir(folder.path()).unwrap().flatten().map(|e| e.file_name()).collect();
    assert_eq!(left, ["images"]);
    assert_eq!(fs::read_dir(folder.path().join("images")).unwrap().count(), 0);
}
