//! `hemicube view`: what its server answers, and what it refuses.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
#![cfg(unix)]

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{Shutdown, TcpStream};
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use glam::DVec3;
use hemicube::bake::{BakeOptions, Layers};
use hemicube::engines::{Draw, EngineOptions, Hemicube, HemicubeOptions};
use hemicube::export::page_facets;
use hemicube::form_factors::Row;
use hemicube::patches::PatchId;
use hemicube::solution::Adaptive;
use hemicube::store::sources;
use hemicube::{LightOptions, Scene, Silent};
use serde_json::Value;

/// The program while it serves a scene; it ends with the test.
struct Viewer {
    child: Child,
    /// `127.0.0.1:PORT`.
    host: String,
    secret: String,
}

impl Viewer {
    fn start() -> Self {
        Self::of(&["cornell-box", "--patch-size", "0.5"])
    }

    fn of(scene: &[&str]) -> Self {
        let mut child = Command::new(env!("CARGO_BIN_EXE_hemicube"))
            .args(["view", "--no-open", "--texel", "0.2"])
            .args(scene)
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let mut address = String::new();
        BufReader::new(child.stdout.take().unwrap()).read_line(&mut address).unwrap();
        let rest = address.trim().strip_prefix("http://").unwrap();
        let (host, secret) = rest.trim_end_matches('/').split_once('/').unwrap();
        assert!(host.starts_with("127.0.0.1:"), "{address}");
        assert!(secret.len() >= 32, "{address}");
        Self { child, host: host.into(), secret: secret.into() }
    }

    /// Sends bytes as they are; the status and the body of the answer.
    fn send(&self, bytes: &[u8]) -> (u16, Vec<u8>) {
        let mut stream = TcpStream::connect(&self.host).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
        // Who is refused early may find the door closed.
        let _ = stream.write_all(bytes);
        let _ = stream.shutdown(Shutdown::Write);
        let mut answer = Vec::new();
        let _ = stream.read_to_end(&mut answer);
        let Some(end) = answer.windows(4).position(|w| w == b"\r\n\r\n") else {
            return (0, Vec::new());
        };
        let head = String::from_utf8_lossy(&answer[..end]).into_owned();
        (head.split(' ').nth(1).unwrap().parse().unwrap(), answer[end + 4..].to_vec())
    }

    fn get_with(&self, target: &str, headers: &str) -> (u16, Vec<u8>) {
        self.send(format!("GET {target} HTTP/1.1\r\n{headers}\r\n").as_bytes())
    }

    /// What the page gets.
    fn get(&self, what: &str) -> (u16, Vec<u8>) {
        self.get_with(&format!("/{}/{what}", self.secret), &format!("Host: {}\r\n", self.host))
    }

    fn post(&self, what: &str, headers: &str) -> (u16, Vec<u8>) {
        let Self { host, secret, .. } = self;
        let head = format!("POST /{secret}/{what} HTTP/1.1\r\nHost: {host}\r\n{headers}\r\n");
        self.send(head.as_bytes())
    }

    fn json(&self, what: &str) -> Value {
        let (status, body) = self.get(what);
        assert_eq!(status, 200, "{what}");
        serde_json::from_slice(&body).unwrap()
    }

    /// The row at a place of a triangle.
    fn row(&self, facet: usize) -> Value {
        let version = self.json("state")["version"].as_u64().unwrap();
        self.json(&format!("row?version={version}&facet={facet}&at=0.2,0.5,0.3"))
    }

    /// The sum of what some triangles receive.
    fn light(&self) -> f64 {
        self.wait();
        (0..20).map(|f| self.row(f)["illuminance"].as_f64().unwrap()).sum()
    }

    fn wait(&self) {
        let start = Instant::now();
        while self.json("state")["done"] != true {
            assert!(start.elapsed() < Duration::from_secs(120), "{}", self.json("state"));
            thread::sleep(Duration::from_millis(50));
        }
        assert_eq!(self.json("state")["failure"], Value::Null);
    }
}

impl Drop for Viewer {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

#[test]
fn only_who_has_the_secret_is_answered() {
    let viewer = Viewer::start();
    let (status, page) = viewer.get("");
    assert_eq!(status, 200);
    let page = String::from_utf8(page).unwrap();
    assert!(page.contains("<title>cornell-box</title>") && page.contains("connect-src 'self'"));
    let (host, secret) = (&viewer.host, &viewer.secret);
    let own = format!("Host: {host}\r\n");
    let inside = format!("/{secret}/state");
    for wrong in ["/", "/state", "/0/state", "/../state", &format!("/{secret}x/state")] {
        assert_eq!(viewer.get_with(wrong, &own).0, 404, "{wrong}");
    }
    for wrong in ["../../etc/passwd", "%2e%2e/", "row", "row?facet=9999999&at=0,0,0", "hemicube"] {
        assert_eq!(viewer.get(wrong).0, 404, "{wrong}");
    }
    for wrong in ["", "Host: evil.example\r\n", "Host: 127.0.0.1.evil.example:80\r\n"] {
        assert_eq!(viewer.get_with(&inside, wrong).0, 403, "{wrong}");
    }
    for wrong in ["Origin: http://evil.example\r\n", "Sec-Fetch-Site: cross-site\r\n"] {
        assert_eq!(viewer.get_with(&inside, &format!("{own}{wrong}")).0, 403, "{wrong}");
    }
    let through_a_tunnel = "Host: localhost:8017\r\nOrigin: http://localhost:8017\r\n";
    assert_eq!(viewer.get_with(&inside, through_a_tunnel).0, 200);
    let put = format!("PUT {inside} HTTP/1.1\r\n{own}\r\n");
    assert_eq!(viewer.send(put.as_bytes()).0, 405);
    assert_eq!(viewer.post("reflectance?material=red&reflectance=1,1,1", "").0, 403);
    let from_here = format!("Origin: http://{host}\r\n");
    let wrong = [
        "state",
        "reflectance",
        "reflectance?material=red&reflectance=2,0,0",
        "subdivision",
        "subdivision?tolerance=",
        "subdivision?tolerance=0",
        "subdivision?tolerance=nan",
        "subdivision?tolerance=1.5",
    ];
    viewer.wait();
    for wrong in wrong {
        assert_eq!(viewer.post(wrong, &from_here).0, 404, "{wrong}");
    }
}

#[test]
fn a_reflectance_is_solved_again() {
    let viewer = Viewer::start();
    let (before, version) = (viewer.light(), viewer.json("state")["version"].as_u64().unwrap());
    let from_here = format!("Origin: http://{}\r\n", viewer.host);
    for wish in ["0.1,0.1,0.1", "0,0,0"] {
        let what = format!("reflectance?material=%77hite&reflectance={wish}");
        assert_eq!(viewer.post(&what, &from_here).0, 200);
    }
    viewer.wait();
    assert!(viewer.json("state")["version"].as_u64().unwrap() > version);
    let dark = viewer.light();
    assert!(dark < 0.9 * before, "{dark} of {before}");
}

#[test]
fn patches_are_split_adaptively_and_as_they_were_again() {
    let viewer = Viewer::start();
    viewer.wait();
    let from_here = format!("Origin: http://{}\r\n", viewer.host);
    let split = |tolerance: &str| {
        let what = format!("subdivision?tolerance={tolerance}");
        assert_eq!(viewer.post(&what, &from_here).0, 200);
        viewer.wait();
        viewer.row(0)["patches"].as_u64().unwrap()
    };
    let uniform = viewer.row(0)["patches"].as_u64().unwrap();
    let before = viewer.light();
    let [coarse, fine] = ["0.1", "0.01"].map(&split);
    assert_eq!(viewer.json("state")["tolerance"], 0.01);
    assert!(coarse < fine, "{coarse} {fine}");
    // The paper's own mesh of that tolerance.
    let scene = Scene::builtin("cornell-box").unwrap();
    let uniform_light = LightOptions { patch_size: Some(0.5), ..LightOptions::default() };
    let found = sources(&scene, &[]).unwrap();
    let (store, _) = scene.solve(found.clone(), &uniform_light, &Silent).unwrap();
    let area: f64 = store.patches.ids().map(|id| store.patches.area(id)).sum();
    let adaptive = LightOptions {
        adaptive: Some(Adaptive { max_factor: 0.01, min_area: area / 5_000.0 }),
        engine: EngineOptions::Hemicube(HemicubeOptions::default()),
        ..uniform_light
    };
    let (store, _) = scene.solve(found, &adaptive, &Silent).unwrap();
    assert_eq!(fine, store.patches.len() as u64);
    assert_eq!(split("uniform"), uniform);
    assert_eq!(viewer.light(), before);
    // One wish gives way to the next, and another colour stays for patches that come back.
    assert_eq!(viewer.post("subdivision?tolerance=0.01", &from_here).0, 200);
    assert_eq!(split("0.1"), coarse);
    assert_eq!(viewer.post("reflectance?material=white&reflectance=0,0,0", &from_here).0, 200);
    viewer.wait();
    assert_eq!(viewer.row(0)["patches"], coarse);
    assert_eq!(split("uniform"), uniform);
    assert!(viewer.light() < 0.9 * before);
}

#[test]
fn a_subdivision_that_cannot_be_is_refused_and_nothing_is_lost() {
    let folder = tempfile::tempdir().unwrap();
    let solved = folder.path().join("c.hemi");
    let solved = solved.to_str().unwrap();
    let program = env!("CARGO_BIN_EXE_hemicube");
    let solve = ["solve", "cornell-box", "--patch-size", "0.5", "-q", "-o", solved];
    assert!(Command::new(program).args(solve).output().unwrap().status.success());
    let viewer = Viewer::of(&[solved]);
    viewer.wait();
    let from_here = format!("Origin: http://{}\r\n", viewer.host);
    // A file of solutions keeps its patches.
    assert_eq!(viewer.json("state")["splits"], false);
    assert_eq!(viewer.post("subdivision?tolerance=0.02", &from_here).0, 404);

    let viewer = Viewer::of(&["cornell-box", "--patch-size", "0.5", "--memory", "20M"]);
    viewer.wait();
    let from_here = format!("Origin: http://{}\r\n", viewer.host);
    assert_eq!(viewer.post("subdivision?tolerance=0.0001", &from_here).0, 200);
    viewer.wait();
    let state = viewer.json("state");
    let refusal = state["refusal"].as_str().unwrap();
    assert!(refusal.contains("memory"), "{refusal}");
    assert_eq!(state["tolerance"], Value::Null);
    let before = viewer.light();
    assert_eq!(viewer.post("reflectance?material=white&reflectance=0,0,0", &from_here).0, 200);
    assert!(viewer.light() < 0.9 * before);
    assert_eq!(viewer.json("state")["refusal"], Value::Null);
}

#[test]
fn a_wish_in_the_midst_of_work_is_heeded() {
    let [viewer, dark] = [Viewer::start(), Viewer::start()];
    let wish = format!("Origin: http://{}\r\n", dark.host);
    assert_eq!(dark.post("reflectance?material=white&reflectance=0,0,0", &wish).0, 200);
    let (bright, dark) = (viewer.light(), dark.light());
    assert!(dark < 0.9 * bright, "{dark} of {bright}");
}

#[test]
fn floods_and_silence_do_no_harm() {
    let viewer = Viewer::start();
    assert_eq!(viewer.send(b"\x16\x03\x01 what is this\r\n\r\n").0, 400);
    let mut large = format!("GET /{}/ HTTP/1.1\r\nX: ", viewer.secret).into_bytes();
    large.resize(10 << 20, b'x');
    assert!([0, 431].contains(&viewer.send(&large).0));
    // Some say nothing, and all others are served beside them, or told to come back.
    let silent: Vec<TcpStream> =
        (0..40).map(|_| TcpStream::connect(&viewer.host).unwrap()).collect();
    thread::scope(|scope| {
        let all: Vec<_> = (0..200).map(|_| scope.spawn(|| viewer.get("state").0)).collect();
        for status in all.into_iter().map(|t| t.join().unwrap()) {
            assert!([200, 503, 0].contains(&status), "{status}");
        }
    });
    drop(silent);
    viewer.wait();
    assert_eq!(viewer.get("").0, 200);
}

#[test]
fn a_row_is_the_engine_s_and_ctrl_c_ends() {
    let mut viewer = Viewer::start();
    viewer.wait();
    let scene = Scene::builtin("cornell-box").unwrap();
    let options = LightOptions { patch_size: Some(0.5), ..LightOptions::default() };
    let all = sources(&scene, &[]).unwrap();
    let (store, _) = scene.solve(all, &options, &Silent).unwrap();
    let patches = &*store.patches;
    let texels = BakeOptions { texel: Some(0.2), ..BakeOptions::default() };
    let layers = Layers::new(&scene, &store, &texels, None, &Silent).unwrap();
    // The page numbers triangles by material, and sees them from their side.
    let facets = page_facets(&scene, &layers);
    for (number, facet) in facets.iter().enumerate() {
        let mut l = DVec3::ZERO;
        facet.around().into_iter().zip([0.2, 0.5, 0.3]).for_each(|(k, share)| l[k] = share);
        let wanted = patches.at(facet.point(l)).unwrap();
        assert_eq!(viewer.row(number)["patch"], wanted.0, "{number}");
    }
    let busy = (0..facets.len()).find(|f| viewer.row(*f)["illuminance"].as_f64() > Some(0.5));
    let row = viewer.row(busy.unwrap());
    assert_eq!(row["patches"].as_u64().unwrap() as usize, patches.len());
    let hemicube = HemicubeOptions { resolution: 256, draw: Draw::Patches };
    let engine = Hemicube::new(&scene.geometry, patches, hemicube).unwrap();
    let id = PatchId(row["patch"].as_u64().unwrap() as u32);
    let mut wanted = Row::default();
    engine.row(id, &mut wanted);
    let numbers = |name: &str| -> Vec<f64> {
        row[name].as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect()
    };
    let (columns, factors): (Vec<f64>, Vec<f64>) =
        wanted.entries().map(|(j, f)| (f64::from(j.0), f)).unzip();
    assert!(columns.len() > 10);
    assert_eq!(numbers("columns"), columns);
    assert_eq!(numbers("factors"), factors);
    assert_eq!(viewer.get("row?version=999&facet=0&at=0.3,0.4,0.3").0, 404, "another version");
    assert_eq!(viewer.get(&format!("hemicube?patch={}&version=0", id.0)).0, 404);
    let version = viewer.json("state")["version"].as_u64().unwrap();
    let (status, png) = viewer.get(&format!("hemicube?patch={}&version={version}", id.0));
    assert_eq!(status, 200);
    assert_eq!(&png[..8], b"\x89PNG\r\n\x1a\n");
    assert_eq!(&png[16..24], [0, 0, 2, 0, 0, 0, 2, 0], "512 x 512 pixels");
    let interrupt = Command::new("kill").args(["-INT", &viewer.child.id().to_string()]).status();
    assert!(interrupt.unwrap().success());
    assert_eq!(viewer.child.wait().unwrap().code(), Some(130));
}
