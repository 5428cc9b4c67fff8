//! What a message proposes is done to the letter, and helps.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test")]

mod common;

use common::{Bench, CLOSED_ROOM, ROOM_MATERIALS};

/// The flags in a text, with their values: up to a word that is neither.
fn flags(text: &str) -> Vec<Vec<String>> {
    let mut found: Vec<Vec<String>> = Vec::new();
    let (mut going_on, mut wants_value) = (false, false);
    for word in text.split(' ') {
        if word.starts_with("--") {
            if !going_on {
                found.push(Vec::new());
            }
            wants_value = !word.starts_with("--flip");
        } else if !wants_value {
            going_on = false;
            continue;
        } else {
            wants_value = false;
        }
        going_on = !word.ends_with([',', ';']);
        let word = word.trim_matches(['"', ',', ';', '\n']);
        found.last_mut().unwrap().push(word.to_owned());
    }
    found
}

/// Makes a small picture; yields what was said, and the picture's mean brightness of 255 if there
/// is one.
fn shown(bench: &Bench, args: &[&str]) -> (String, Option<f64>) {
    let small = ["--size", "48x36", "--samples", "128", "-o", "a.png"];
    let outcome = bench.run(&[&["render"], args, &small].concat());
    let picture = (outcome.code == Some(0)).then(|| bench.picture("a.png"));
    let mean = picture
        .map(|p| p.pixels.iter().map(|p| f64::from(p[1])).sum::<f64>() / p.pixels.len() as f64);
    (outcome.stderr, mean)
}

#[test]
fn a_dark_room_is_lit_as_proposed() {
    let outwards = CLOSED_ROOM.lines().map(|line| match line.strip_prefix("f ") {
        Some(face) => format!("f {}\n", face.split(' ').rev().collect::<Vec<_>>().join(" ")),
        None => format!("{line}\n"),
    });
    let bench = Bench::new()
        .with("room.obj", CLOSED_ROOM)
        .with("outwards.obj", outwards.collect::<String>())
        .with("room.mtl", ROOM_MATERIALS);
    let within = ["--eye", "1,1,.2", "--target", "1,1,1"];
    let cases: [(&str, &[&str], &[&str]); 5] = [
        ("room.obj", &[], &["--lamp", "--emission"]),
        ("outwards.obj", &["--as", "room"], &["--lamp"]),
        ("outwards.obj", &["--as", "room", "--sides", "one"], &["--flip", "--emission"]),
        ("outwards.obj", &[&within[..], &["--sides", "one"]].concat(), &["--flip", "--lamp"]),
        ("room.obj", &within, &["--lamp", "--emission"]),
    ];
    for (model, more, parts) in cases {
        let args = [&[model], more].concat();
        let refused = bench.run(&[&["render"], &args[..], &["--stage", "off"]].concat());
        let refused = refused.refused(parts).stderr;
        let error = refused.lines().find(|line| line.starts_with("error:")).unwrap();
        let mut light = 0;
        for proposed in flags(error) {
            let proposed: Vec<&str> = proposed.iter().map(String::as_str).collect();
            let lit = proposed.iter().any(|f| ["--lamp", "--emission"].contains(f));
            let tried = match proposed[0] {
                // These are to be left out.
                "--stage" if error.contains("instead of --stage off") => continue,
                "--stage" => args.clone(),
                "--eye" | "--target" => vec![model],
                _ if lit => [&args[..], &proposed, &["--stage", "off"]].concat(),
                _ => [&args[..], &proposed].concat(),
            };
            let (said, mean) = shown(&bench, &tried);
            assert!(!said.contains("warning"), "{tried:?}: {said}");
            assert!((60.0..235.0).contains(&mean.unwrap()), "{tried:?}: {mean:?}");
            light += usize::from(lit);
        }
        assert!(light > 0, "{error}");
    }
}

#[test]
fn a_dark_picture_is_lit_as_proposed() {
    let cube = CLOSED_ROOM.replace("mtllib", "#").replace("usemtl", "#");
    let bench = Bench::new()
        .with("room.obj", CLOSED_ROOM)
        .with("cube.obj", cube)
        .with("room.mtl", ROOM_MATERIALS);
    let cases: [(&[&str], &str); 3] = [
        (&["room.obj", "--sky", "1,1,1"], "the picture is black"),
        (&["room.obj", "--lamp", "spark=1,1,1,1e-5"], "very faint"),
        (&["cube.obj", "--as", "object", "--lamp", "spark=1,4,1,1e-5"], "very faint"),
    ];
    for (args, why) in cases {
        let (said, _) = shown(&bench, args);
        let warning = said.lines().find(|line| line.contains(why)).unwrap();
        let proposed = flags(warning).into_iter().find(|f| f[0] == "--lamp").unwrap();
        let proposed: Vec<&str> = proposed.iter().map(String::as_str).collect();
        let (said, mean) = shown(&bench, &[args, &proposed].concat());
        assert!(!said.contains(why), "{args:?} {proposed:?}: {said}");
        assert!((20.0..235.0).contains(&mean.unwrap()), "{args:?} {proposed:?}: {mean:?}");
    }
}

#[test]
fn the_memory_proposed_is_enough() {
    let bench = Bench::new();
    let cases = [
        &["--memory", "2M"][..],
        &["--memory", "40M", "--patch-size", "0.005"],
        &["--memory", "20M", "--patch-size", "0.2", "--solver", "direct"],
    ];
    for more in cases {
        let (said, none) = shown(&bench, &[&["room"], more].concat());
        assert!(none.is_none(), "{said}");
        assert_eq!(said.contains("--solver gauss-seidel"), more.contains(&"direct"), "{said}");
        let proposed = flags(&said).into_iter().find(|f| f[0] == "--memory").unwrap();
        let (said, picture) =
            shown(&bench, &[&["room", "--memory", &proposed[1]], &more[2..]].concat());
        assert!(picture.is_some(), "{proposed:?} {said}");
    }
}

#[test]
fn points_in_the_dark_are_lit_as_proposed() {
    let bench = Bench::new().with("room.obj", CLOSED_ROOM).with("room.mtl", ROOM_MATERIALS);
    let probe =
        ["probe", "room.obj", "--grid", ".5,0,.5", "0,0,1", "1,0,0", "2x2", "--samples", "64"];
    let refused = bench.run(&probe).refused(&["nothing emits light", "--lamp"]).stderr;
    let flags = flags(&refused).concat();
    let flags: Vec<&str> = flags.iter().map(String::as_str).collect();
    let table = bench.run(&[&probe[..], &flags].concat()).ok();
    assert!(!table.stderr.contains("get no light"), "{table:?}");
}
