//! Rows a second of hemicubes on the graphics device; the rows are dropped.
//!
//! ```text
//! cargo run --release --features gpu --example gpu_rows -- room 0.01 128 sources
//! ```

#![allow(clippy::print_stdout)]

use std::error::Error;
use std::time::Instant;

use hemicube::engines::{Draw, Engine, Gpu, HemicubeGpu, HemicubeOptions};
use hemicube::form_factors::{RowBlock, RowSink, SinkError};
use hemicube::patches::{PatchId, Patches};
use hemicube::progress::Silent;
use hemicube::scene::builtin;

/// Counts entries and keeps nothing.
#[derive(Default)]
struct Count(u64);

impl RowSink for Count {
    fn take(&mut self, block: RowBlock) -> Result<(), SinkError> {
        self.0 += block.entries() as u64;
        Ok(())
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let [name, size, resolution, draw] = args.as_slice() else {
        return Err("usage: gpu_rows SCENE PATCH_SIZE RESOLUTION sources|patches".into());
    };
    let scene = builtin::build(name).ok_or("no built-in scene of that name")?;
    let patches = Patches::uniform(&scene.geometry, size.parse()?)?;
    let draw = if draw == "patches" { Draw::Patches } else { Draw::Sources };
    let options = HemicubeOptions { resolution: resolution.parse()?, draw };

    let start = Instant::now();
    let gpu = Gpu::open()?;
    println!("{:?}, opened in {:.3} s", gpu.adapter(), start.elapsed().as_secs_f64());
    let start = Instant::now();
    let mut engine = HemicubeGpu::on(&gpu, &scene.geometry, &patches, options, 1 << 30)?;
    println!(
        "{} source triangles, {} patches, engine ready in {:.3} s",
        scene.geometry.len(),
        patches.len(),
        start.elapsed().as_secs_f64()
    );
    let ids: Vec<PatchId> = patches.ids().collect();
    let start = Instant::now();
    let mut count = Count::default();
    engine.make(&ids, &mut count, &Silent)?;
    let seconds = start.elapsed().as_secs_f64();
    println!(
        "{} rows in {seconds:.3} s: {:.0} rows/s, {:.0} entries a row",
        ids.len(),
        ids.len() as f64 / seconds,
        count.0 as f64 / ids.len() as f64
    );
    println!("{:?}", engine.seconds());
    Ok(())
}
