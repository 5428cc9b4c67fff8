//! View3D files of each kind, whole and broken.

use std::fs;

use glam::DVec3;

use super::{OutputFormat, Radiating};
use crate::scene::{ImportOptions, Severity, Sides, SidesChoice, TriangleState, View3d, load};

/// Eight corners of a unit cube.
const CUBE: &str = "V 1 0 0 0\nV 2 1 0 0\nV 3 1 1 0\nV 4 0 1 0\n\
                    V 5 0 0 1\nV 6 1 0 1\nV 7 1 1 1\nV 8 0 1 1\n";

fn read(text: &str) -> Result<View3d, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("m.vs3");
    fs::write(&path, text).unwrap();
    let read = View3d::load(&path).map_err(|e| e.to_string());
    if let Err(message) = &read {
        assert!(message.contains("m.vs3: ") && message.len() < 500, "{message}");
    }
    read
}

/// Area of each surface.
fn areas(task: &View3d) -> Vec<f64> {
    let g = &task.scene.geometry;
    let mut areas = vec![0.0; g.surfaces.len()];
    g.ids().for_each(|t| areas[g.surface_of[t.index()] as usize] += g.area(t));
    areas
}

fn normal(task: &View3d, surface: u32) -> DVec3 {
    let g = &task.scene.geometry;
    let sum = g.ids().filter(|t| g.surface_of[t.index()] == surface);
    sum.map(|t| g.normal(t, crate::scene::Side::Front)).sum::<DVec3>().normalize()
}

#[track_caller]
fn assert_close(found: &[f64], expected: &[f64]) {
    let same = found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-9);
    assert!(same && found.len() == expected.len(), "{found:?} {expected:?}");
}

/// Surfaces of the cube follow as lines 9 on.
#[track_caller]
fn refused(surfaces: &str, parts: &[&str]) {
    let message = read(&format!("{CUBE}{surfaces}")).unwrap_err();
    for part in parts {
        assert!(message.contains(part), "'{part}' is not in {message}");
    }
}

#[test]
fn every_kind_of_line_is_read() {
    let text = format!(
        "t  A cube, so far \r\n/ slash\r\n! comment\r\n!\t#\tx\r\n\r\n   \r\nX 1 2 3\r\n\
         c encl=1, list = 2\tEPS=1.e-5 out=2 maxU=8 maxO 8 minO=0 prjD=0 maxV=12\r\n\
         C maxD=500.0 row=2 col=1 emit=1\r\nf 3 ! the format\r\n{}\
         S,1,1,2,3,4,0,0,.5,floor ! it is\r\n\
         s\t2\t8\t7\t6\t5\t0\t0\t0.25\tZn001:Roof  2 of it\t\r\n\
         Surface 3 1 5 6 0 0 2 0.25 5\r\n\
         S 4 1 6 2 0 0 0 0.9\r\n\
         o 5 1 4 8 5 and more\r\nObstruction 6 1 4 8 0\r\n\
         End of data\r\nS nonsense\r\n",
        CUBE.replace('\n', "\r\n")
    );
    let task = read(&text).unwrap();
    assert_eq!(task.title, "A cube, so far");
    let control = task.control;
    assert_eq!((control.eps, control.list, control.out), (Some(1e-5), 2, OutputFormat::Sparse));
    assert!(control.enclosure && control.emittances);
    assert_eq!((control.row, control.col, control.max_distance), (Some(1), Some(0), 500.0));
    let names: Vec<&str> = task.surfaces.iter().map(|s| s.name.as_str()).collect();
    assert_eq!(names, ["floor", "Zn001:Roof  2 of it", "5", "4"]);
    let emittances: Vec<f64> = task.surfaces.iter().map(|s| s.emittance).collect();
    assert_eq!(emittances, [0.5, 0.25, 0.25, 0.9]);
    assert_eq!(task.surfaces[2].combined, Some(1));
    assert_eq!(task.rows(), [0, 1, 1, 2]);
    assert_eq!(task.surfaces[0].centre, DVec3::new(0.5, 0.5, 0.0));
    assert_close(&areas(&task), &[1.0, 1.0, 0.5, 0.5, 1.0, 0.5]);
    assert_eq!((normal(&task, 0), normal(&task, 1)), (DVec3::Z, DVec3::NEG_Z));
    let g = &task.scene.geometry;
    assert_eq!(g.sides.iter().filter(|s| **s == Sides::None).count(), 3);
    assert_eq!(g.surfaces[4].name, "obstruction 5");
    assert!(task.scene.findings.iter().all(|f| f.severity == Severity::Note));
}

#[test]
fn a_view3d_file_is_a_model() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("room.VS3");
    fs::write(&path, format!("{CUBE}S 1 1 2 3 4 0 0 .04 floor\nO 2 5 6 7 8\n")).unwrap();
    let load = |sides, unit| load(&path, &ImportOptions { sides, unit, ..Default::default() });
    let scene = load(SidesChoice::File, 2.0).unwrap();
    assert_eq!((scene.name.as_str(), scene.up), ("room", DVec3::Z));
    assert_eq!(scene.geometry.area(crate::scene::TriangleId(0)), 2.0);
    // Emittances stay in the materials; light is computed with less reflectance.
    assert!((scene.optics.materials[0].reflectance.x - 0.96).abs() < 1e-12);
    assert_eq!(scene.optics.reflectance[0].x, 0.9);
    for (choice, sides) in [(SidesChoice::One, Sides::One), (SidesChoice::Two, Sides::Two)] {
        let found = load(choice, 1.0).unwrap().geometry.sides;
        assert_eq!(found, [sides, sides, Sides::None, Sides::None]);
    }
}

#[test]
fn surfaces_in_planes_of_their_own_are_where_view3d_has_them() {
    let text = "F 3A\nS 1 R 0 0 .9 south\n 3. 0. 0.   0 90\n! width and height\n 3 2 extra words\n\
                S 2 r 0 0 .9 east\n 3 1 0 270 90 1 3\n\
                S 3 Q 0 0 .9 ceiling\n 3 0 3 0 180\n 2 0  3 0  3 1\n 2 1\n\
                S 4 t 0 0 .9 floor\n 0 0 0 180 0 0 0 1 0 1 1\nO 5 R\n 0 0 1 180 0 2 2\n";
    let task = read(text).unwrap();
    assert_close(&areas(&task), &[6.0, 3.0, 1.0, 0.5, 4.0]);
    for (k, expected) in
        [DVec3::Y, DVec3::NEG_X, DVec3::NEG_Z, DVec3::Z, DVec3::Z].into_iter().enumerate()
    {
        assert!(
            normal(&task, k as u32).distance(expected) < 1e-9,
            "{k}: {}",
            normal(&task, k as u32)
        );
    }
    let centres = [(1.5, 0.0, 1.0), (3.0, 0.5, 1.5), (0.5, 0.5, 3.0), (2.0 / 3.0, 1.0 / 3.0, 0.0)];
    for (surface, centre) in task.surfaces.iter().zip(centres) {
        let centre: DVec3 = centre.into();
        assert!(surface.centre.distance(centre) < 1e-9, "{surface:?} {centre}");
    }
}

#[test]
fn what_lies_in_a_surface_is_taken_away_from_it() {
    let more = "V 9 .25 0 .25\nV 10 .75 0 .25\nV 11 .75 0 .75\nV 12 .25 0 .75\n\
                V 13 .5 0 .5\nV 14 .75 0 .5\n";
    let wall = "S 1 2 1 5 6 0 0 .9 wall\n";
    let window = "S 2 10 9 12 11 1 0 .1 window\n";
    let task = read(&format!("{CUBE}{more}{wall}{window}S 3 10 13 11 0 2 0 .5 pane\n")).unwrap();
    assert_close(&areas(&task), &[0.75, 0.1875, 0.0625]);
    assert!(task.scene.geometry.len() <= 16, "{}", task.scene.geometry.len());
    // A surface may lie on an obstruction, which comes later.
    let task = read(&format!("{CUBE}{more}S 1 10 9 12 11 2 0 .9 panel\nO 2 2 1 5 6\n")).unwrap();
    assert_close(&areas(&task), &[0.25, 0.75]);
    for (line, part) in [
        ("S 2 10 9 12 11 2 0 .1 w", "line 16: base surface 2 is not an earlier one"),
        ("S 2 10 9 12 11 9 0 .1 w", "line 16: base surface 9 does not exist: the file has 2"),
        ("S 2 9 10 11 12 1 0 .1 w", "line 16: surface 2 faces another way than its base surface 1"),
        ("S 2 1 2 3 4 1 0 .1 w", "line 16: surface 2 is not in the plane of its base surface 1"),
        ("S 2 2 1 5 6 1 0 .1 w", "line 15: surface 1 is wholly taken up by what lies in it"),
    ] {
        let message = read(&format!("{CUBE}{more}{wall}{line}\n")).unwrap_err();
        assert!(message.contains(part) && message.contains("; "), "{message}");
    }
    let beyond = "V 15 2 0 .5\n";
    let line = "S 2 15 9 12 0 1 0 .1 w\n";
    let message = read(&format!("{CUBE}{more}{beyond}{wall}{line}")).unwrap_err();
    assert!(message.contains("line 17: surface 2 is not wholly within its base"), "{message}");
}

#[test]
fn surfaces_back_to_back_both_take_part() {
    let task = read(&format!("{CUBE}S 1 1 2 3 0 0 0 .9 a\nS 2 3 2 1 0 0 0 .9 b\n")).unwrap();
    assert_close(&areas(&task), &[0.5, 0.5]);
    assert!(task.scene.geometry.state.iter().all(|s| *s == TriangleState::Solid));
    let task = read(&format!("{CUBE}S 1 1 2 3 0 0 0 .9 a\nS 2 2 3 1 0 0 0 .9 b\n")).unwrap();
    assert_eq!(task.scene.geometry.state[1], TriangleState::Duplicate);
    // The same from another vertex on.
    let task = read(&format!("{CUBE}S 1 1 2 3 4 0 0 .9 a\nS 2 4 1 2 3 0 0 .9 b\n")).unwrap();
    assert_eq!(task.scene.geometry.state[2..], [TriangleState::Duplicate; 2]);
    // The sides of a sheet, and each again.
    let sheet = ["1 2 3", "3 2 1", "3 1 2", "2 1 3"];
    let sheet: String =
        (1..).zip(sheet).map(|(k, v)| format!("S {k} {v} 0 0 0 .9 {k}\n")).collect();
    let task = read(&format!("{CUBE}{sheet}")).unwrap();
    assert_close(&areas(&task), &[0.5; 4]);
    let (solid, again) = (TriangleState::Solid, TriangleState::Duplicate);
    assert_eq!(task.scene.geometry.state, [solid, solid, solid, again, again, again]);
    let finding = &task.scene.findings[0];
    assert_eq!((finding.severity, &*finding.place), (Severity::Warning, "line 11, line 12"));
    assert!(finding.message.starts_with("is an earlier surface again"), "{finding:?}");
}

#[test]
fn what_is_no_surface_is_refused() {
    let more = "V 9 2 0 0\nV 10 .5 0 0\nV 11 0 0 0\n";
    for (surface, part) in [
        ("S 1 1 2 2 0 0 0 .9 f", "line 12: corners 2 and 3 of surface 1 are at one place; name"),
        ("S 1 1 1 1 1 0 0 .9 f", "line 12: corners 1 and 2 of surface 1"),
        ("S 1 5 5 7 8 0 0 .9 f", "line 12: corners 1 and 2 of surface 1"),
        ("S 1 1 2 3 11 0 0 .9 f", "line 12: corners 1 and 4 of surface 1"),
        ("S 1 5 7 6 8 0 0 .9 f", "line 12: the edges of surface 1 cross each other; name"),
        ("S 1 1 9 2 3 0 0 .9 f", "line 12: the edges of surface 1 cross"),
        ("S 1 1 2 9 0 0 0 .9 f", "line 12: surface 1 has no area: its corners are on one line"),
        ("S 1 1 2 3 4 0 0 .9 f\nO 2 5 6 5 0", "line 13: corners 1 and 3 of surface 2"),
        ("S 1 1 2 3 4 0 0 .9 f\nO 2 1 2 9 0", "line 13: surface 2 has no area"),
    ] {
        refused(&format!("{more}{surface}\n"), &[part]);
    }
    let message = read("F 3a\nS 1 R 0 0 .9 f\n 0 0 0 0 90 1 0\n").unwrap_err();
    assert!(message.contains("line 2: corners 1 and 2 of surface 1 are at one"), "{message}");
    // A corner on an edge, and a needle as solids have them, are none of this.
    assert!(read(&format!("{CUBE}{more}S 1 1 2 9 4 0 0 .9 f\n")).is_ok());
    let needle = read(&format!("{CUBE}V 9 .5 1e-9 0\nS 1 1 2 9 0 0 0 .9 f\n")).unwrap();
    let finding = &needle.scene.findings[0];
    assert_eq!((finding.severity, &*finding.place), (Severity::Warning, "line 10"));
    assert!(finding.message.starts_with("is so thin"), "{finding:?}");
}

#[test]
fn many_windows_are_read_in_no_time() {
    let n = 30;
    let mut text = format!("V 1 0 0 0\nV 2 {0} 0 0\nV 3 {0} 0 {0}\nV 4 0 0 {0}\n", 2 * n + 1);
    let mut windows = String::from("S 1 1 2 3 4 0 0 .9 wall\n");
    for k in 0..n * n {
        let (row, at) = (k / n, 5 + 4 * k);
        let [x, z] = [2.0 * (k % n) as f64 + 0.2 + 0.3 * (row % 3) as f64, 2.0 * row as f64 + 0.5];
        for (c, [u, v]) in (at..).zip([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]) {
            text += &format!("V {c} {} 0 {}\n", x + u, z + v);
        }
        let [a, b, c, d] = [0, 1, 2, 3].map(|i| at + i);
        windows += &format!("S {} {a} {b} {c} {d} 1 0 .5 w\n", k + 2);
    }
    let task = read(&(text + &windows)).unwrap();
    let wall = task.scene.geometry.surface_of.iter().filter(|s| **s == 0).count();
    assert!(wall <= 2 * (n + 1) * (n + 2), "{wall}");
    let size = (2 * n + 1) as f64;
    assert!((areas(&task)[0] - (size * size - (n * n) as f64)).abs() < 1e-6);
}

#[test]
fn doubts_are_said() {
    let said = |text: &str| {
        let found = read(text).unwrap().scene.findings.into_iter();
        let warnings = found.filter(|f| f.severity == Severity::Warning);
        warnings.map(|f| format!("{}: {}", f.place, f.message)).collect::<Vec<_>>()
    };
    let sides = ["1 2 3 4", "8 7 6 5", "1 5 6 2", "4 3 7 8", "1 4 8 5", "2 6 7 3"];
    let floors: String = (1..).zip(sides).map(|(k, v)| format!("S {k} {v} 0 0 0 {k}f\n")).collect();
    assert_eq!(
        said(&format!("{CUBE}{floors}")),
        ["line 9, line 10, line 11, line 12 and 2 more: its emittance is below 0.001, \
             which is taken instead"]
    );
    let bright = read(&format!("{CUBE}S 1 1 2 3 4 0 0 1.0 f\n")).unwrap();
    assert_eq!(bright.surfaces[0].emittance, 0.999);
    assert_eq!(said(&format!("{CUBE}S 1 1 2 3 4 0 0 .999 f\nS 2 5 6 7 0 0 0 .001 f\n")).len(), 0);
    let control = said(&format!("C foo=3 encl=1 bar list=1\n{CUBE}S 1 1 2 3 4 0 0 .9 f\n"));
    assert_eq!(
        control,
        [
            "line 1: nobody knows the control word `foo`",
            "line 1: nobody knows the control word `bar`"
        ]
    );
    let unknown = said(&format!("{CUBE}W 1 2\nQ\nS 1 1 2 3 4 0 0 .9 f\n"));
    assert_eq!(unknown.len(), 1);
    assert!(
        unknown[0].starts_with("line 9: begins with `W`") && unknown[0].contains("2 such lines")
    );
    let bent = said(&format!("{CUBE}V 9 1 1 .01\nS 1 1 2 9 4 0 0 .9 f\n"));
    assert!(bent[0].starts_with("line 10: its corners are not in one plane"), "{bent:?}");
    let mixed = said(&format!("{CUBE}S 1 1 2 3 0 0 0 .9 f\nS 2 1 3 4 0 0 1 .5 f\n"));
    assert!(
        mixed[0].starts_with("line 10: is combined with one of another emittance"),
        "{mixed:?}"
    );
}

#[test]
fn a_dent_is_no_error() {
    let task = read("V 1 0 0 0\nV 2 4 0 0\nV 3 1 1 0\nV 4 0 4 0\nS 1 1 2 3 4 0 0 .9 arrow\n");
    assert_close(&areas(&task.unwrap()), &[4.0]);
}

#[test]
fn errors_name_the_line_and_what_to_do() {
    let s = "S number v1 v2 v3 v4 base cmb emit name";
    for (surfaces, parts) in [
        ("S 1 1 2 3 9 0 0 .9 f", &["line 9: vertex 9 does not exist: the file has 8"][..]),
        ("S 1 0 2 3 4 0 0 .9 f", &["line 9: vertex 0 does not exist"]),
        ("S 2 1 2 3 4 0 0 .9 f", &["line 9: surface 2 is out of order: 1 comes next"]),
        ("S one 1 2 3 4 0 0 .9 f", &["line 9: the number of the surface", "not `one`", s]),
        ("S", &["line 9: the number of the surface is missing", s]),
        ("S 1 1 2 3", &["line 9: vertex 4 of the surface is missing", "0"]),
        ("S 1 1 2 3 4", &["line 9: the base surface is missing", s]),
        ("S 1 1 2 3 4 0", &["line 9: the surface to combine with is missing", s]),
        ("S 1 1 2 3 4 0 0", &["line 9: the emittance is missing", s]),
        ("S 1 1 2 3 4 0 0 f", &["line 9: `f` is not a finite number"]),
        ("S 1 1 2 3 4 0 0 -1 f", &["line 9: the emittance -1 of surface 1 is not from 0 to 1; g"]),
        ("S 1 1 2 3 4 0 0 2 f", &["line 9: the emittance 2", "from 0.001 to 0.999"]),
        ("S 1 1 2 3 4 0 0 nan f", &["line 9: `nan` is not a finite number"]),
        ("S 1 1 2 3 4 -1 0 .9 f", &["line 9: the base surface", "not `-1`"]),
        ("S 1 1 2 3 0 0 .9 floor", &["line 9: a triangle lacks the 0", "v3 0 base cmb"]),
        ("S 1 1 2 3 0 0 0 1f", &["line 9: a triangle lacks the 0"]),
        ("S 1 1 2 3 0 0 .5 7", &["line 9: a triangle lacks the 0"]),
        ("S 1 1 2 3 4 0 5 .9 f", &["line 9: surface to combine with 5 does not exist"]),
        ("S 1 1 2 3 4 0 1 .9 f", &["line 9: surface 1 to combine with is not an earlier one"]),
        (
            "S 1 1 2 3 4 0 0 .9 f\nS 2 5 6 7 0 0 1 .9 f\nS 3 5 7 8 0 0 2 .9 f",
            &["line 11: surface 2 to combine with is combined with 1 itself; name 1 here"],
        ),
        ("S 1 1 2 3 4 0 0 .9 f\nO 2 1 2 3", &["line 10: vertex 4", "O number v1 v2 v3 v4"]),
        (
            "S 1 1 2 3 4 0 0 .9 f\nO 2 5 6 7 8\nS 3 5 6 7 8 0 0 .9 f",
            &["line 11: surface 3 (`S`) stands after an obstruction (`O`); put obstructions"],
        ),
        ("O 1 1 2 3 4", &["whole file: has no surfaces"]),
        ("M 1 1 2 3 4 0 0 .9 f", &["line 9: mask surfaces (`M`) are not read; leave it out"]),
        ("n 1 1 2 3 4 0 0 .9 f", &["line 9: null surfaces (`N`) are not read"]),
        ("V 10 0 0 0", &["line 9: vertex 10 is out of order: 9 comes next"]),
        ("V 9 0 0", &["line 9: z of the vertex is missing; write `V number x y z`"]),
        ("V 9 0 0 1e999", &["line 9: `1e999` is not a finite number"]),
        ("V 9 0 x 0", &["line 9: `x` is not a finite number"]),
        ("F 3a", &["line 9: the format stands after vertices or surfaces"]),
        ("F 2", &["line 9: `2` is no format that is read; write `F 3` or `F 3a`"]),
        ("F", &["line 9: `` is no format"]),
        ("C eps", &["line 9: `eps` has no value"]),
        ("C eps=x", &["line 9: `x` is not a finite number"]),
        ("C eps=0", &["line 9: `eps` is to be more than 0"]),
        ("C out=3", &["line 9: `out` is to be 0, 1 or 2, not 3"]),
        ("C encl=yes", &["line 9: `encl` is to be a whole number, not yes"]),
        ("C col=1", &["line 9: has a `col` without a `row`"]),
        ("C row=2\nS 1 1 2 3 4 0 0 .9 f", &["line 9: `row` is 2: the file has 1 surfaces"]),
        ("", &["whole file: has no surfaces"]),
    ] {
        refused(surfaces, parts);
    }
    for (text, part) in [
        ("F 3a\nS 1 Z 0 0 .9 f\n", "line 2: `Z` is no shape; write `S number shape"),
        (
            "F 3a\nS 1 R 0 0 .9 f\n 0 0 0 0 90 1\n",
            "line 2: the file ends before surface 1 has its 7",
        ),
        (
            "F 3a\nS 1 R 0 0 .9 f\n 0 0 0 0 90 1\nS 2",
            "line 4: `S` is no number: surface 1 (line 2)",
        ),
        ("F 3a\nS 1 R 0 0\n", "line 2: the emittance is missing"),
        ("F 3a\nO 1\n", "line 2: `` is no shape; write `O number shape`"),
    ] {
        let message = read(text).unwrap_err();
        assert!(message.contains(part), "{part}: {message}");
    }
}

#[test]
fn what_a_file_says_of_a_surface_is_handed_over() {
    let task = read(&format!("{CUBE}S 1 1 2 3 4 0 0 .9 floor\n")).unwrap();
    let centre = DVec3::new(0.5, 0.5, 0.0);
    let floor = Radiating { name: "floor".into(), emittance: 0.9, centre, combined: None };
    assert_eq!(task.surfaces, [floor]);
    assert_eq!(task.by_surface().of, [0, 0]);
}
