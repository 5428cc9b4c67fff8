//! Runs the program in a folder of its own, and small models to give it.

#![allow(
    dead_code,
    clippy::unwrap_used,
    clippy::panic,
    reason = "each test file uses a part of it"
)]

pub mod matrix;
pub mod picture;

use std::fs;
use std::io::Write;
use std::path::PathBuf;
use std::process::{Command, Stdio};

use picture::Picture;
use tempfile::TempDir;

/// What is fast enough to run often.
pub const SMALL: [&str; 6] = ["--size", "64x48", "--patch-size", "1", "--resolution", "32"];

/// What the program did.
#[derive(Debug)]
pub struct Outcome {
    /// Exit code; `None` if a signal ended it.
    pub code: Option<i32>,
    /// All of stdout.
    pub stdout: String,
    /// All of stderr.
    pub stderr: String,
}

/// A folder that the program runs in, with models.
pub struct Bench {
    folder: TempDir,
}

impl Bench {
    /// An empty folder.
    pub fn new() -> Self {
        Self { folder: tempfile::tempdir().unwrap() }
    }

    /// Where a file lies.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Puts a file in the folder.
    pub fn with(self, name: &str, bytes: impl AsRef<[u8]>) -> Self {
        fs::write(self.path(name), bytes).unwrap();
        self
    }

    /// The program, about to run in the folder.
    pub fn command(&self, args: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_hemicube"));
        command.current_dir(self.folder.path()).args(args);
        command
    }

    /// Runs the program to its end.
    pub fn run(&self, args: &[&str]) -> Outcome {
        self.run_with(args, "")
    }

    /// Runs the program to its end, with something to read on stdin.
    pub fn run_with(&self, args: &[&str], input: &str) -> Outcome {
        let mut command = self.command(args);
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().unwrap();
        // A program that does not read it may have ended before.
        let _ = child.stdin.take().unwrap().write_all(input.as_bytes());
        let output = child.wait_with_output().unwrap();
        let outcome = Outcome {
            code: output.status.code(),
            stdout: String::from_utf8(output.stdout).unwrap(),
            stderr: String::from_utf8(output.stderr).unwrap(),
        };
        assert!(!outcome.stderr.contains("panicked"), "{args:?}: {outcome:?}");
        outcome
    }

    /// Renders a small picture.
    pub fn render(&self, scene: &str, more: &[&str]) -> Outcome {
        self.run(&[&["render", scene][..], &SMALL, more].concat())
    }

    /// A picture that the program wrote.
    pub fn picture(&self, name: &str) -> Picture {
        Picture::read(&self.path(name))
    }

    /// The names of all that lies in the folder.
    pub fn files(&self) -> Vec<String> {
        let mut names: Vec<String> = fs::read_dir(self.folder.path())
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }
}

impl Outcome {
    /// It worked.
    pub fn ok(self) -> Self {
        assert_eq!(self.code, Some(0), "{self:?}");
        self
    }

    /// It ended with one message of bad input that has all of `parts` in it.
    pub fn refused(self, parts: &[&str]) -> Self {
        assert_eq!(self.code, Some(2), "{self:?}");
        assert_eq!(self.stdout, "", "a result in spite of an error");
        assert_eq!(self.stderr.matches("error:").count(), 1, "{self:?}");
        for part in parts {
            assert!(self.stderr.contains(part), "'{part}' is not in {self:?}");
        }
        self
    }
}

/// The inside of a closed 2 m cube in two materials, without an emitter.
pub const CLOSED_ROOM: &str = "\
mtllib room.mtl
v 0 0 0\nv 2 0 0\nv 2 0 2\nv 0 0 2\nv 0 2 0\nv 2 2 0\nv 2 2 2\nv 0 2 2
usemtl plaster
f 4 3 2 1\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8
usemtl ceiling
f 5 6 7 8
";

/// Its materials.
pub const ROOM_MATERIALS: &str = "newmtl plaster\nKd .5 .5 .5\nnewmtl ceiling\nKd .7 .7 .7\n";

/// A floor with a step on it, open all around, without an emitter.
pub const OPEN_MODEL: &str = "\
v -1 0 -1\nv 1 0 -1\nv 1 0 1\nv -1 0 1
v -.5 .5 -.5\nv .5 .5 -.5\nv .5 .5 .5\nv -.5 .5 .5
f 4 3 2 1\nf 8 7 6 5
";

/// A binary glTF file of one triangle.
pub fn glb() -> Vec<u8> {
    glb_of(r#""scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}]"#)
}

/// A binary glTF file of one triangle and a point lamp `bulb` before it.
pub fn glb_with_lamp() -> Vec<u8> {
    glb_of(
        r#""extensionsUsed":["KHR_lights_punctual"],
"extensions":{"KHR_lights_punctual":{"lights":[{"type":"point","intensity":5}]}},
"scenes":[{"nodes":[0,1]}],"nodes":[{"mesh":0},{"name":"bulb","translation":[0.2,0.2,1],
"extensions":{"KHR_lights_punctual":{"light":0}}}]"#,
    )
}

fn glb_of(nodes: &str) -> Vec<u8> {
    let mut json = format!(
        r#"{{"asset":{{"version":"2.0"}},{nodes},
"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}}}}]}}],
"accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3",
"min":[0,0,0],"max":[1,1,0]}}],
"bufferViews":[{{"buffer":0,"byteLength":36}}],"buffers":[{{"byteLength":36}}]}}"#,
    );
    while json.len() % 4 != 0 {
        json.push(' ');
    }
    let corners: [f32; 9] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    let data: Vec<u8> = corners.iter().flat_map(|c| c.to_le_bytes()).collect();
    let mut bytes = Vec::new();
    let word = |bytes: &mut Vec<u8>, w: usize| bytes.extend((w as u32).to_le_bytes());
    bytes.extend(b"glTF");
    word(&mut bytes, 2);
    word(&mut bytes, 12 + 8 + json.len() + 8 + data.len());
    word(&mut bytes, json.len());
    bytes.extend(b"JSON");
    bytes.extend(json.as_bytes());
    word(&mut bytes, data.len());
    bytes.extend(b"BIN\0");
    bytes.extend(data);
    bytes
}

/// Bytes without sense, always the same.
pub fn noise(length: usize) -> Vec<u8> {
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    let mut next = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 24) as u8
    };
    (0..length).map(|_| next()).collect()
}
