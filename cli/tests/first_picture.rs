//! `hemicube render MODEL` of models that bring neither camera nor light.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test")]

mod common;

use common::picture::Picture;
use common::{Bench, CLOSED_ROOM, Outcome, ROOM_MATERIALS};

/// A cube of 2 m about the origin whose faces look outwards, or inwards.
fn cube(inwards: bool) -> String {
    let mut text = String::from(
        "v -1 -1 -1\nv 1 -1 -1\nv -1 1 -1\nv 1 1 -1\nv -1 -1 1\nv 1 -1 1\nv -1 1 1\nv 1 1 1\n",
    );
    let faces =
        [[1, 3, 4, 2], [5, 6, 8, 7], [1, 2, 6, 5], [3, 7, 8, 4], [1, 5, 7, 3], [2, 4, 8, 6]];
    for mut face in faces {
        if inwards {
            face.reverse();
        }
        text += &format!("f {}\n", face.map(|v: i32| v.to_string()).join(" "));
    }
    text
}

/// A square pyramid that stands on the plane z = 0, as STL.
fn standing_pyramid() -> String {
    let [a, b, c, d, top] = ["-1 -1 0", "1 -1 0", "1 1 0", "-1 1 0", "0 0 3"];
    let facets = [[a, c, b], [a, d, c], [a, b, top], [b, c, top], [c, d, top], [d, a, top]];
    let mut text = String::from("solid pyramid\n");
    for facet in facets {
        let corners: String = facet.iter().map(|v| format!("vertex {v}\n")).collect();
        text += &format!("facet normal 0 0 0\nouter loop\n{corners}endloop\nendfacet\n");
    }
    text + "endsolid pyramid\n"
}

fn render(bench: &Bench, model: &str, more: &[&str]) -> (Outcome, Picture) {
    let small = ["render", model, "--size", "96x72", "--samples", "128", "-o", "out.png"];
    let outcome = bench.run(&[&small, more].concat()).ok();
    (outcome, bench.picture("out.png"))
}

/// Brightness from dark to bright: the 2nd, 50th and 98th hundredth of the pixels, of 255.
fn range(picture: &Picture) -> [u8; 3] {
    let mut green: Vec<u8> = picture.pixels.iter().map(|p| p[1]).collect();
    green.sort_unstable();
    [2, 50, 98].map(|percent| green[green.len() * percent / 100])
}

#[track_caller]
fn assert_good(picture: &Picture) {
    let [dark, middle, bright] = range(picture);
    assert!((90..200).contains(&middle), "{dark} {middle} {bright}");
    assert!(bright - dark > 60, "form needs contrast: {dark} {middle} {bright}");
    assert!(dark > 15 && bright < 250, "neither black nor burnt: {dark} {middle} {bright}");
}

#[test]
fn an_object_stands_in_a_studio() {
    let bench = Bench::new().with("cube.obj", cube(false)).with("tiny.obj", cube(false));
    let (said, picture) = render(&bench, "cube.obj", &[]);
    for part in ["model: an object", "--as room", "this one is outside", "studio", "--stage off"] {
        assert!(said.stderr.contains(part), "'{part}' is not in {said:?}");
    }
    assert_good(&picture);
    assert!(said.stderr.contains("cube: 12 source triangles"), "the stage is no part: {said:?}");
    // As bright and as large in any unit.
    for unit in ["mm", "in"] {
        let (_, scaled) = render(&bench, "cube.obj", &["--unit", unit]);
        assert!(picture.difference(&scaled).0 < 2.0, "{unit}");
    }
}

#[test]
fn a_stage_can_be_refused_and_the_kind_overruled() {
    let bench = Bench::new().with("cube.obj", cube(false));
    let (said, plain) = render(&bench, "cube.obj", &["--stage", "off"]);
    assert!(said.stderr.contains("uniform sky") && !said.stderr.contains("studio"), "{said:?}");
    assert_eq!(plain.pixels[0], plain.pixels[95], "the sky is the same everywhere");
    let (said, _) = render(&bench, "cube.obj", &["--as", "room"]);
    assert!(said.stderr.contains("this one is inside"), "{said:?}");
    assert!(said.stderr.contains("under the ceiling") && !said.stderr.contains("model:"));
    let refused = ["render", "cube.obj", "--as", "house"];
    bench.run(&refused).refused(&["object", "room"]);
}

#[test]
fn a_closed_room_gets_lights_under_its_ceiling() {
    let bench = Bench::new().with("room.obj", CLOSED_ROOM).with("room.mtl", ROOM_MATERIALS);
    let (said, picture) = render(&bench, "room.obj", &[]);
    for part in ["model: a room", "--as object", "this one is inside", "under the ceiling"] {
        assert!(said.stderr.contains(part), "'{part}' is not in {said:?}");
    }
    let [dark, middle, _] = range(&picture);
    assert!(dark > 40 && (90..200).contains(&middle), "{dark} {middle}");
    let bench = bench.with("inside.obj", cube(true));
    assert!(render(&bench, "inside.obj", &[]).0.stderr.contains("model: a room"));
}

#[test]
fn an_eye_in_a_nook_has_light_too() {
    let two = [([0.0; 3], [10.0, 3.0, 8.0], true), ([10.5, 0.0, 0.0], [11.5, 1.0, 1.0], true)];
    let bench = Bench::new().with("rooms.obj", boxes(&two));
    let nook = ["--as", "room", "--eye", "10.7,.5,.2", "--target", "11.5,.4,1"];
    let (said, picture) = render(&bench, "rooms.obj", &nook);
    assert!(!said.stderr.contains("stops") && !said.stderr.contains("black"), "{said:?}");
    let [dark, middle, _] = range(&picture);
    assert!(dark > 40 && (90..200).contains(&middle), "{dark} {middle}");
}

#[test]
fn a_black_sky_is_no_light() {
    let bench = Bench::new().with("cube.obj", cube(false));
    let dark = ["render", "cube.obj", "--sky", "0,0,0"];
    bench.run(&dark).refused(&["nothing emits light", "leave --sky out"]);
    render(&bench, "cube.obj", &[&dark[2..], &["--lamp", "a=3,3,3,1000"]].concat());
}

#[test]
fn a_chosen_point_of_view_fits_the_angle_asked_for() {
    let bench = Bench::new().with("cube.obj", cube(false));
    let plain = ["--stage", "off"];
    let covered = |vfov: &str| {
        let (said, picture) = render(&bench, "cube.obj", &[&plain[..], &["--vfov", vfov]].concat());
        assert!(said.stderr.contains(&format!("--vfov {vfov} ")), "{said:?}");
        picture.pixels.iter().filter(|p| **p != picture.pixels[0]).count() as f64 / (96.0 * 72.0)
    };
    let shares = ["20", "40", "90"].map(covered);
    assert!(shares.iter().all(|share| (0.2..0.8).contains(share)), "{shares:?}");
}

#[test]
fn a_body_that_stands_on_z_is_upright() {
    let bench = Bench::new().with("pyramid.stl", standing_pyramid());
    let (said, picture) = render(&bench, "pyramid.stl", &[]);
    assert!(said.stderr.contains("up: z") && said.stderr.contains("--up y"), "{said:?}");
    assert_good(&picture);
    let (said, upright) = render(&bench, "pyramid.stl", &["--up", "z"]);
    assert!(!said.stderr.contains("up: z"), "{said:?}");
    assert_eq!(picture.difference(&upright).1, 0);
    let (_, lying) = render(&bench, "pyramid.stl", &["--up", "y"]);
    assert!(picture.difference(&lying).0 > 5.0);
    let wrong = ["render", "pyramid.stl", "--up", "w"];
    bench.run(&wrong).refused(&["--up", "0,0,1"]);
}

/// Boxes as OBJ: lowest and highest corner, and whether faces look inwards.
fn boxes(of: &[([f64; 3], [f64; 3], bool)]) -> String {
    let mut text = String::new();
    for (low, high, inwards) in of {
        for line in cube(*inwards).lines() {
            let (kind, rest) = line.split_once(' ').unwrap();
            let numbers = rest.split(' ').enumerate().map(|(k, n)| match (kind, n) {
                ("v", "-1") => low[k].to_string(),
                ("v", _) => high[k].to_string(),
                // Counted from the end, as each box brings its own vertices.
                (_, n) => (n.parse::<i32>().unwrap() - 9).to_string(),
            });
            text += &format!("{kind} {}\n", numbers.collect::<Vec<_>>().join(" "));
        }
    }
    text
}

/// A cube whose vertices are red below and blue above.
fn coloured_cube() -> String {
    let header = "ply\nformat ascii 1.0\nelement vertex 8\nproperty float x\nproperty float y\n\
                  property float z\nproperty uchar red\nproperty uchar green\n\
                  property uchar blue\nelement face 6\n\
                  property list uchar int vertex_indices\nend_header\n";
    let cube = cube(false);
    let lines = cube.lines().map(|line| match line.split_once(' ').unwrap() {
        ("v", at) if at.split(' ').nth(1) == Some("-1") => format!("{at} 220 40 30\n"),
        ("v", at) => format!("{at} 30 60 220\n"),
        (_, face) => {
            let corners = face.split(' ').map(|n| (n.parse::<u32>().unwrap() - 1).to_string());
            format!("4 {}\n", corners.collect::<Vec<_>>().join(" "))
        }
    });
    header.to_owned() + &lines.collect::<String>()
}

#[test]
fn colours_of_vertices_are_seen() {
    let bench = Bench::new().with("cube.ply", coloured_cube());
    let (said, picture) = render(&bench, "cube.ply", &["--up", "y"]);
    assert!(said.stderr.contains("model: an object"), "{said:?}");
    assert_good(&picture);
    let share = |is: &dyn Fn([f64; 3]) -> bool| {
        let pixels = picture.pixels.iter().map(|p| [p[0], p[1], p[2]].map(f64::from));
        pixels.filter(|p| is(*p)).count() as f64 / picture.pixels.len() as f64
    };
    // A triangle has the mean of its corners' colours.
    let (red, blue) = (share(&|[r, g, _]| r > 1.3 * g), share(&|[_, g, b]| b > 1.3 * g));
    assert!(red > 0.1 && blue > 0.1, "{red} {blue}");
}

#[test]
fn models_of_many_shapes_have_contrast() {
    let plate = |corners: &str| format!("v -1 0 0\nv 1 0 0\nv 1 1 0\nv -1 1 0\nf {corners}\n");
    let two = [([-1.0, 0.0, -1.0], [0.0, 1.0, 0.0], false), ([0.5; 3], [1.5, 2.0, 1.5], false)];
    // A shell, and two rooms within it with something in one of them.
    let house = [
        ([0.0; 3], [10.4, 3.4, 6.4], false),
        ([0.2; 3], [5.0, 3.2, 6.2], true),
        ([5.4, 0.2, 0.2], [10.2, 3.2, 6.2], true),
        ([1.0, 0.2, 1.0], [2.0, 1.0, 2.5], false),
    ];
    let bench = Bench::new()
        .with("front.obj", plate("1 2 3 4"))
        .with("back.obj", plate("4 3 2 1"))
        .with("two.obj", boxes(&two))
        .with("house.obj", boxes(&house));
    let models = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/models/");
    let [chair, window] = ["chair.obj", "room-window.obj"].map(|name| format!("{models}{name}"));
    for (model, kind) in [
        ("front.obj", "object"),
        ("back.obj", "object"),
        ("two.obj", "object"),
        (&chair, "object"),
        ("house.obj", "room"),
        (&window, "room"),
    ] {
        let (said, picture) = render(&bench, model, &[]);
        let place = if kind == "object" { "outside" } else { "inside" };
        for part in [
            format!("model: a{} {kind}", if kind == "object" { "n" } else { "" }),
            format!("this one is {place}"),
        ] {
            assert!(said.stderr.contains(&part), "{model}: '{part}' is not in {said:?}");
        }
        let [dark, middle, bright] = range(&picture);
        let contrast = bright - dark;
        assert!((70..210).contains(&middle), "{model}: {dark} {middle} {bright}");
        assert!(contrast > 40 && dark > 5, "{model}: {dark} {middle} {bright}");
    }
}

#[test]
fn measurements_know_no_stage() {
    let bench = Bench::new().with("cube.obj", cube(false));
    bench.run(&["factors", "cube.obj", "-o", "F.csv", "-q"]).ok();
    let rows = std::fs::read_to_string(bench.path("F.csv")).unwrap().lines().count();
    assert!(rows <= 13, "{rows}");
    let grid = ["--grid", "0,2,0", "1,0,0", "0,0,1", "1x1"];
    bench.run(&[&["probe", "cube.obj"], &grid[..]].concat()).refused(&["nothing emits light"]);
}

#[test]
fn a_picture_that_shows_nothing_says_why() {
    let bench = Bench::new().with("cube.obj", cube(false)).with("room.obj", cube(true));
    let warned = |model: &str, more: &[&str], parts: &[&str]| {
        let (said, _) = render(&bench, model, more);
        for part in [&["warning:"], parts].concat() {
            assert!(said.stderr.contains(part), "'{part}' is not in {said:?}");
        }
        let (quiet, _) = render(&bench, model, &[more, &["-q"]].concat());
        assert_eq!(quiet.stderr, "");
    };
    let away = ["--eye", "5,0,0", "--target", "9,0,0", "--stage", "off"];
    warned("cube.obj", &away, &["nothing of the model is in view", "--eye"]);
    // The ground of the studio is no part of the model, and hides nothing.
    warned("cube.obj", &["--eye", "5,0,0", "--target", "9,-2,0"], &["nothing of the model"]);
    let turned = ["--sides", "one", "--flip", "--as", "object"];
    warned("cube.obj", &turned, &["100 % of what is in view are backs", "leave --flip out"]);
    let within = ["--eye", "0,0,.5", "--target", "0,0,0", "--sky", "1,1,1", "--sides", "one"];
    warned("cube.obj", &within, &["100 % of what is in view are backs", "--sides two", "--flip"]);
    warned("room.obj", &["--sky", "1,1,1"], &["the picture is black", "leave --sky"]);
    // What was proposed works.
    for (model, more) in [("cube.obj", &[][..]), ("room.obj", &[])] {
        let (said, _) = render(&bench, model, more);
        assert!(!said.stderr.contains("black") && !said.stderr.contains("backs"), "{said:?}");
    }
    let (said, _) = render(&bench, "cube.obj", &["--sun", "200,40"]);
    assert!(!said.stderr.contains("stops"), "the sun is bright: {said:?}");
    let faint = ["--stage", "off", "--lamp", "spark=0,0,0,1e-5"];
    warned("room.obj", &faint, &["stops: the light is very faint", "--lamp"]);
}

#[test]
fn lamps_and_a_sun_can_be_given() {
    let ies = "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 2 1 1 2 0 0 0 1 1 9\n0 180\n0\n100 100\n";
    let bench = Bench::new().with("room.obj", cube(true)).with("even.ies", ies);
    let lux = |more: &[&str]| -> f64 {
        let grid = ["--grid", "0,-.99,0", ".01,0,0", "0,0,-.01", "1x1", "--max-reflectance", "0"];
        let table = bench.run(&[&["probe", "room.obj"], &grid[..], more].concat()).ok().stdout;
        let mut lines = table.lines();
        let at = lines.next().unwrap().split(',').position(|title| title == "E").unwrap();
        lines.next().unwrap().split(',').nth(at).unwrap().parse().unwrap()
    };
    // 400 pi lm are 100 cd alike in all directions, from .5 m above the point.
    let lamp = ["--lamp", "a=0.005,-.49,-.005,1256.637"];
    assert!((lux(&lamp) / 400.0 - 1.0).abs() < 1e-3, "{}", lux(&lamp));
    let shaped = ["--lamp", "a=0.005,-.49,-.005,1256.637,even.ies"];
    assert!((lux(&shaped) / 400.0 - 1.0).abs() < 1e-3, "{}", lux(&shaped));
    let own = ["--lamp", "a=0.005,-.49,-.005,even.ies"];
    assert!((lux(&own) / 400.0 - 1.0).abs() < 1e-3, "{}", lux(&own));
    let said = bench.run(&["render", "room.obj", "--lamp", "desk=0,0,0,800,even.ies"]).ok();
    assert!(said.stderr.contains("its file, even.ies, says 1257 lm"), "{}", said.stderr);
    let said = bench.run(&["render", "room.obj", "--lamp", "desk=0,0,0,1250,even.ies"]).ok();
    assert!(!said.stderr.contains("its file"), "{}", said.stderr);
    let list = bench.run(&["info", "room.obj", "--lamp", "desk=0,0,0,800,even.ies"]).ok().stdout;
    assert!(list.contains("desk (point"), "{list}");
    let refused = |flag: &str, value: &str| {
        bench.run(&["info", "room.obj", flag, value]).refused(&[flag, value]);
    };
    for value in ["a=1,2,3", "=1,2,3,4", "a=1,2,x,4", "a=1,2,3,-4"] {
        refused("--lamp", value);
    }
    for value in ["10", "0,91", "0,-1", "0,45,x"] {
        refused("--sun", value);
    }
}

#[test]
fn the_sun_stands_where_its_azimuth_says() {
    // A floor and, north of its middle, a wall across it; north is -z.
    let text = "v -3 0 -3\nv 3 0 -3\nv 3 0 3\nv -3 0 3\nv -3 0 -1\nv 3 0 -1\nv 3 3 -1\nv -3 3 -1
f 4 3 2 1\nf 5 6 7 8\n";
    let bench = Bench::new().with("wall.obj", text);
    let lux = |sun: &str| -> f64 {
        let grid = ["--grid", "0,0,0", ".01,0,0", "0,0,-.01", "1x1", "--max-reflectance", "0"];
        let sun = ["--sun", sun];
        let table = bench.run(&[&["probe", "wall.obj"], &grid[..], &sun].concat()).ok().stdout;
        let mut lines = table.lines();
        let at = lines.next().unwrap().split(',').position(|title| title == "E").unwrap();
        lines.next().unwrap().split(',').nth(at).unwrap().parse().unwrap()
    };
    assert_eq!(lux("0,45,1000"), 0.0, "in the shadow of the wall to the north");
    for azimuth in ["90", "180", "270"] {
        let e = lux(&format!("{azimuth},30,1000"));
        assert!((e / 500.0 - 1.0).abs() < 1e-3, "{azimuth}: {e}");
    }
}

#[test]
fn equal_findings_are_one_line() {
    let text = cube(false).replace("f 1 3 4 2\n", "f 1 3 4 2\nf 1 3 4 2\n");
    let bench = Bench::new().with("cube.obj", text);
    let said = bench.run(&["info", "cube.obj"]).ok().stdout;
    assert!(
        said.contains("bounds:    -1.0000,-1.0000,-1.0000 to 1.0000,1.0000,1.0000 m"),
        "{said}"
    );
    let large = bench.run(&["info", "cube.obj", "--unit", "mm"]).ok().stdout;
    assert!(large.contains("mm²") || large.contains("cm²"), "{large}");
    let (said, _) = render(&bench, "cube.obj", &["--unit", "mm"]);
    assert!(said.stderr.contains("is it in another unit?"), "as info says: {said:?}");
}
