//! Inputs that are sound.

pub mod gltf;
pub mod images;
pub mod models;
pub mod parts;
pub mod solids;
pub mod stored;
pub mod tables;

use std::error::Error;
use std::path::{Path, PathBuf};
use std::{fs, io};

/// Sound inputs of a kind, or why there are none.
pub type Sound = Result<Vec<Input>, Box<dyn Error>>;

/// Files by their names; the first is the one that is opened.
#[derive(Clone)]
pub struct Input {
    pub files: Vec<(String, Vec<u8>)>,
}

impl Input {
    pub fn new(name: &str, bytes: impl Into<Vec<u8>>) -> Self {
        Self { files: vec![(name.into(), bytes.into())] }
    }

    /// With another file beside it.
    pub fn and(mut self, name: &str, bytes: impl Into<Vec<u8>>) -> Self {
        self.files.push((name.into(), bytes.into()));
        self
    }

    /// Writes it into a folder, in which nothing else is then.
    pub fn write(&self, folder: &Path) -> io::Result<PathBuf> {
        if folder.exists() {
            fs::remove_dir_all(folder)?;
        }
        fs::create_dir_all(folder)?;
        for (name, bytes) in &self.files {
            fs::write(folder.join(name), bytes)?;
        }
        Ok(folder.join(&self.files[0].0))
    }
}

/// The files of a folder with one of some extensions, each with those that it names.
pub fn of_folder(folder: &Path, endings: &[&str]) -> io::Result<Vec<Input>> {
    /// Larger ones would take too long.
    const MOST: u64 = 1 << 20;
    let mut paths: Vec<PathBuf> =
        fs::read_dir(folder)?.map(|entry| Ok(entry?.path())).collect::<io::Result<_>>()?;
    paths.retain(|p| p.metadata().is_ok_and(|m| m.is_file() && m.len() <= MOST));
    paths.sort();
    let name = |path: &Path| path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let mut found = Vec::new();
    for path in &paths {
        let ending = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        if !endings.contains(&ending.as_str()) {
            continue;
        }
        let mut input = Input::new(&name(path), fs::read(path)?);
        for other in paths.iter().filter(|other| *other != path) {
            let text = String::from_utf8_lossy(&input.files[0].1);
            if text.contains(&name(other)) {
                input = input.and(&name(other), fs::read(other)?);
            }
        }
        found.push(input);
    }
    Ok(found)
}
