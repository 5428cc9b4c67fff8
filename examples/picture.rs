//! A picture of a model: `cargo run --release --example picture -- MODEL OUT.png`.
//!
//! Without arguments: the built-in room, as room.png in the folder for temporary files.

use std::error::Error;

use hemicube::{LightOptions, Scene, Silent, View};

fn main() -> Result<(), Box<dyn Error>> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let (scene, path) = match &args[..] {
        [model, path] => (Scene::load(model)?, path.into()),
        _ => (Scene::builtin("room")?, std::env::temp_dir().join("room.png")),
    };
    let lit = scene.light(&LightOptions::default(), &Silent)?;
    let picture = lit.look(&View::of(&scene)?, &Silent)?;
    picture.save(path)?;
    Ok(())
}
