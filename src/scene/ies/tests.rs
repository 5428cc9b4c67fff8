use super::*;

fn parsed(text: &str) -> Result<Photometry, ImportError> {
    parse(&Source { path: Path::new("lamp.ies"), bytes: text.as_bytes() })
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
    let latin = parse(&Source { path: Path::new("lamp.ies"), bytes: &bytes }).unwrap();
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
    assert!(header.contains("IESNA91, IESNA:LM-63-1995"), "{header}");
    assert!(parsed("").unwrap_err().to_string().contains("line 1: begins with ''"));
    for (numbers, expected) in [
        ("0 3 1 1 2", "line 5: the candela multiplier is '0'; it must be a positive number"),
        ("1 2.5 1 1 2", "line 5: the number of vertical angles is '2.5'"),
        ("1 3 -1 1 2", "line 5: the number of horizontal angles is '-1'"),
        ("1 3 1 2 2", "line 5: is photometry of type B; only type C is read"),
        ("1 3 1 3 2", "photometry of type A"),
        ("1 3 1 4 2", "the photometric type is '4'; it must be 1 (type C), 2 (B) or 3 (A)"),
        ("1 3 1 1 3", "the unit is '3'; it must be 1 (feet) or 2 (metres)"),
        ("1 3 1 1 2 0 wide", "the opening's length is 'wide'; it must be a number"),
        ("1 3 1 1 2 0 0 0 0", "the ballast factor is '0'"),
        ("1 3 1 1 2 0 0 0 1 1 9\n0 90 45", "line 6: vertical angle 3 of 3 is '45'"),
        ("1 3 1 1 2 0 0 0 1 1 9\n0 40 85", "line 6: vertical angles go from 0 to 85"),
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
