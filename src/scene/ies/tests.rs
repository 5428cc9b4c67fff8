use super::*;

fn parsed(text: &str) -> Result<Photometry, ImportError> {
    parse(&Source::new(Path::new("lamp.ies"), text.as_bytes()))
}

/// A file of 1 lamp of 1000 lm, whose numbers from the multiplier on are given.
fn file(numbers: &str) -> String {
    format!("IESNA:LM-63-2002\n[TEST] 1\n[MANUFAC] A = B, C\nTILT=NONE\n1 1000 {numbers}\n")
}

const PLAIN: &str = "1 3 1 1 2 0 0 0\n1 1 50\n0 90 180\n0\n30 20 10";

#[test]
fn a_plain_file_is_read() {
    let p = parsed(&file(PLAIN)).unwrap();
    assert_eq!((&p.vertical[..], &p.horizontal[..]), (&[0.0, 90.0, 180.0][..], &[0.0][..]));
    assert_eq!(p.candela, [30.0, 20.0, 10.0]);
    assert_eq!((p.rated_flux(), p.opening()), (Some(1000.0), 0.0));
    assert_eq!(p.intensity(123.0, 45.0), 25.0);
}

#[test]
fn separators_ends_of_lines_and_encodings_vary() {
    let text = file(PLAIN).replace('\n', "\r\n").replace(' ', ",  ") + "\u{1a}";
    assert_eq!(parsed(&text).unwrap(), parsed(&file(PLAIN)).unwrap());
    let mut bytes = b"\xef\xbb\xbfiesna:lm-63-2002\n[MANUFAC] Fr\xe8res\nTilt = None\n".to_vec();
    bytes.extend(format!("1 1000 {PLAIN}").bytes());
    let latin = parse(&Source::new(Path::new("lamp.ies"), &bytes)).unwrap();
    assert_eq!(latin, parsed(&file(PLAIN)).unwrap());
}

#[test]
fn multipliers_and_units_apply() {
    let numbers = "2 2 1 1 1 -1 2 0\n.9 .5 50\n0 90\n0\n10 0";
    let later = parsed(&file(numbers)).unwrap();
    assert_eq!(later.candela, [18.0, 0.0]);
    assert_eq!(later.rated_flux(), Some(900.0));
    assert!((later.opening() - 0.6096).abs() < 1e-12);
    let first = parsed(&file(numbers).replace("IESNA:LM-63-2002", "IESNA91")).unwrap();
    assert_eq!((first.candela[0], first.rated_flux()), (9.0, Some(450.0)));
    let absolute = parsed(&file(numbers).replace("1 1000", "1 -1")).unwrap();
    assert_eq!((absolute.candela[0], absolute.rated_flux()), (18.0, None));
}

/// A lamp of π × 1000 lm in a lossless diffuse luminaire: I = 1000 cd cos γ.
#[test]
fn a_diffuse_luminaire_sends_out_the_lumens_of_its_lamp() {
    use std::f64::consts::PI;
    let angles: Vec<f64> = (0..=45).map(|k| 2.0 * f64::from(k)).collect();
    let words = |f: &dyn Fn(f64) -> f64| -> String {
        angles.iter().map(|&a| format!("{:.3} ", f(a))).collect()
    };
    let text = format!(
        "IESNA:LM-63-1995\nTILT=NONE\n2 {} 2 46 1 1 2 0 0 0 1 1 50\n{}\n0\n{}",
        500.0 * PI,
        words(&|a| a),
        words(&|a| 500.0 * a.to_radians().cos())
    );
    let p = parsed(&text).unwrap();
    let rated = p.rated_flux().unwrap();
    assert!((rated / (1000.0 * PI) - 1.0).abs() < 1e-12);
    assert!((p.flux() / rated - 1.0).abs() < 3e-4, "{} {rated}", p.flux());
}

#[test]
fn tilt_is_passed_over_only_if_it_changes_nothing() {
    let with = |tilt: &str| parsed(&file(PLAIN).replace("TILT=NONE", tilt));
    let same = with("TILT=INCLUDE\n1\n3\n0 45 90\n1 1.0 1").unwrap();
    assert_eq!(same, parsed(&file(PLAIN)).unwrap());
    let message = |tilt: &str| with(tilt).unwrap_err().to_string();
    let differs = message("TILT=INCLUDE\n1\n3\n0 45 90\n1 .9 .8");
    assert!(
        differs.contains("line 8: the light depends on the tilt (a factor of 0.9)"),
        "{differs}"
    );
    let other = message("TILT=LAMP.TLT");
    assert!(other.contains("line 4: TILT=LAMP.TLT refers to another file"), "{other}");
    let none = message("");
    assert!(none.contains("keywords: are not followed by a line TILT="), "{none}");
}

#[test]
fn what_is_wrong_is_said_with_its_line_and_a_remedy() {
    let header = parsed("LUMINAIRE 7\n").unwrap_err().to_string();
    assert!(header.starts_with("lamp.ies: line 1: begins with 'LUMINAIRE 7'"), "{header}");
    assert!(header.contains("IESNA91, IESNA95, IESNA:LM-63-1995"), "{header}");
    assert!(parsed("").unwrap_err().to_string().contains("line 1: begins with ''"));
    for (numbers, expected) in [
        ("0 3 1 1 2", "line 5: the candela multiplier is '0'; it must be a positive number"),
        ("1 2.5 1 1 2", "line 5: the number of vertical angles is '2.5'"),
        ("1 3 -1 1 2", "line 5: the number of horizontal angles is '-1'"),
        ("1 1 1 3 2 0 0 0 1 1 9\n10", "line 6: vertical angles go from 10 to 10"),
        ("1 2 1 2 2 0 0 0 1 1 9\n10 90\n0", "line 6: vertical angles go from 10 to 90"),
        ("1 3 1 4 2", "the photometric type is '4'; it must be 1 (type C), 2 (B) or 3 (A)"),
        ("1 3 1 1 3", "the unit is '3'; it must be 1 (feet) or 2 (metres)"),
        ("1 3 1 1 2 0 wide", "the opening's length is 'wide'; it must be a number"),
        ("1 3 1 1 2 0 0 0 0", "the ballast factor is '0'"),
        ("1 3 1 1 2 0 0 0 1 1 9\n0 90 45", "line 6: vertical angle 3 of 3 is '45'"),
        ("1 3 1 1 2 0 0 0 1 1 9\n0 40 85", "line 6: vertical angles go from 0 to 85"),
        ("1 3 1 1 2 0 0 0 1 1 9\n0 1e-308 180", "line 6: vertical angle 2 of 3 is '1e-308'"),
        ("1 3 1 1 2 0 0 0 1 1 9\n0 90 1e300", "line 6: vertical angle 3 of 3 is '1e300'"),
        ("1 1 1 1 2 0 0 0 1 1 9\n90", "vertical angles go from 90 to 90"),
        ("1 2 2 1 2 0 0 0 1 1 9\n0 90\n0 45", "line 7: horizontal angles go from 0 to 45"),
        ("1 2 1 1 2 0 0 0 1 1 9\n0 90\n0\n5 -2", "the intensity at 0, 90 degrees is '-2'"),
        ("1 2 1 1 2 0 0 0 1 1 9\n0 90\n0\n5", "the file ends before the intensity at 0, 90"),
        ("1 2 1 1 2 0 0 0 1 1 9\n0 90\n0\n5 nan", "the intensity at 0, 90 degrees is 'nan'"),
        ("1 2 1 1 2 0 0 0 1 1 9\n0 90\n0\n5 4\n3", "line 9: '3' follows after all intensities"),
        ("1e300 2 1 1 2 0 0 0 1 1 9\n0 90\n0\n1e300 4", "an intensity exceeds 1e30 cd"),
    ] {
        let message = parsed(&file(numbers)).unwrap_err().to_string();
        assert!(message.contains(expected), "{message}\n{expected}");
    }
    let dark = parsed(&file(PLAIN).replace("1 1000", "1 -2")).unwrap_err().to_string();
    assert!(dark.contains("the lumens per lamp is '-2'"), "{dark}");
    let gone = read(Path::new("no-such.ies")).unwrap_err().to_string();
    assert!(gone.contains("no-such.ies: cannot be read"), "{gone}");
}

#[test]
fn floodlights_are_turned_into_type_c() {
    use std::f64::consts::PI;
    let angles: Vec<f64> = (-18..=18).map(|k| 5.0 * f64::from(k)).collect();
    let words =
        |numbers: &[f64]| -> String { numbers.iter().map(|x| format!("{x:.6} ")).collect() };
    let of = |i: &dyn Fn(f64, f64) -> f64| {
        let candela: Vec<f64> =
            angles.iter().flat_map(|&h| angles.iter().map(move |&v| i(h, v))).collect();
        let tables = [words(&angles), words(&angles), words(&candela)].join("\n");
        parsed(&file(&format!("1 37 37 2 2 0 0 0 1 1 50\n{tables}"))).unwrap()
    };
    // Linear in both angles: right is C0 and up is C90.
    let p = of(&|h, v| 1000.0 + h + 2.0 * v);
    let at = [(0.0, 1040.0), (90.0, 1080.0), (180.0, 960.0), (270.0, 920.0)];
    for (c, expected) in at {
        assert!((p.intensity(c, 40.0) - expected).abs() < 0.1, "{c}: {}", p.intensity(c, 40.0));
    }
    assert_eq!(p.intensity(0.0, 91.0), 0.0);
    // H = 30 and V = 50: cos γ = cos H cos V.
    let (h, v) = (30_f64.to_radians(), 50_f64.to_radians());
    let gamma = (h.cos() * v.cos()).acos().to_degrees();
    let c = (h.cos() * v.sin()).atan2(h.sin()).to_degrees();
    assert!((p.intensity(c, gamma) - 1130.0).abs() < 2.0, "{}", p.intensity(c, gamma));
    // A diffuse one sends out π times its intensity.
    let p = of(&|h, v| 1000.0 * h.to_radians().cos() * v.to_radians().cos());
    assert!((p.flux() / (1000.0 * PI) - 1.0).abs() < 0.005, "{}", p.flux());
    // Symmetric about both axes, and dark beyond what was measured.
    let p = parsed(&file("1 2 2 2 2 0 0 0 1 1 50\n0 20\n0 30\n9 5 9 5")).unwrap();
    for c in [0.0, 180.0] {
        assert!((p.intensity(c, 20.0) - 9.0).abs() < 1e-9);
    }
    assert!((p.intensity(90.0, 10.0) - p.intensity(270.0, 10.0)).abs() < 1e-9);
    assert_eq!((p.intensity(0.0, 40.0), p.intensity(90.0, 30.0)), (0.0, 0.0));
}

#[test]
fn headlights_are_turned_into_type_c() {
    // Level ahead in C0, V upwards, H to the right: clockwise from above.
    let tables = "-10 0 20\n-30 0 60\n1 2 3 4 5 6 7 8 9";
    let p = parsed(&file(&format!("1 3 3 3 2 0 0 0 1 1 50\n{tables}"))).unwrap();
    let towards = [(0.0, 90.0, 5.0), (0.0, 110.0, 6.0), (30.0, 90.0, 2.0), (-60.0, 80.0, 7.0)];
    let between = [(15.0, 90.0, 3.5), (330.0, 90.0, 6.5), (0.0, 100.0, 5.5)];
    let dark = [(32.0, 90.0, 0.0), (180.0, 90.0, 0.0), (-61.0, 90.0, 0.0), (0.0, 79.0, 0.0)];
    for (c, gamma, expected) in [&towards[..], &between, &dark].concat() {
        let found = p.intensity(c, gamma);
        assert!((found - expected).abs() < 1e-9, "C {c}, γ {gamma}: {found}");
    }
    // Nothing measured straight ahead, and angles that stand for both sides.
    let p = parsed(&file("1 2 2 3 2 0 0 0 1 1 50\n0 20\n-30 10\n4 0 8 0")).unwrap();
    for (c, gamma, expected) in [(0.0, 90.0, 7.0), (0.0, 100.0, 3.5), (0.0, 80.0, 3.5)] {
        assert!((p.intensity(c, gamma) - expected).abs() < 1e-9);
    }
    let p = parsed(&file("1 2 2 3 2 0 0 0 1 1 50\n0 20\n0 30\n9 5 9 5")).unwrap();
    assert!((p.intensity(20.0, 70.0) - 5.0).abs() < 1e-9 && p.intensity(-20.0, 110.0) > 4.9);
    // One that shines alike over half of all directions.
    let alike = "1 3 3 3 2 0 0 0 1 1 50\n-90 0 90\n-90 0 90\n1 1 1 1 1 1 1 1 1";
    let p = parsed(&file(alike)).unwrap();
    assert!((p.flux() / (2.0 * std::f64::consts::PI) - 1.0).abs() < 1e-3, "{}", p.flux());
}

#[test]
fn early_editions_are_read() {
    let later = parsed(&file(PLAIN)).unwrap();
    let with = |header: &str| parsed(&file(PLAIN).replace("IESNA:LM-63-2002\n", header)).unwrap();
    assert_eq!(with("IESNA95\n"), later);
    // The edition of 1986 has no header, and a ballast-lamp factor, here of 1.
    assert_eq!(with("LUMINAIRE 7\nMADE BY X\n"), later);
    assert_eq!(parsed(&format!("TILT=NONE\n1 1000 {PLAIN}")).unwrap(), later);
    assert!(parsed("IESNA:LM-63-2077\nTILT=NONE\n1").is_err());
}

#[test]
fn cut_and_garbled_files_never_panic() {
    let text = file(PLAIN);
    for length in 0..text.len() - 3 {
        assert!(parsed(&text[..length]).is_err(), "{}", &text[..length]);
    }
    let words: Vec<&str> = text.split(' ').collect();
    for k in 0..words.len() {
        for odd in ["", "1e999", "-1", "65535", "0.5", "TILT=", "\u{1a}", "é"] {
            let mut words = words.clone();
            words[k] = odd;
            if let Ok(p) = parsed(&words.join(" ")) {
                assert!(p.flux().is_finite() && p.intensity(400.0, -7.0).is_finite());
            }
        }
    }
}
