//! The graphics device, where the program has been built with it and there is an adapter.

use hemicube::engines::{Draw, Engine};
use hemicube::patches::Patches;
use hemicube::scene::Geometry;

use super::conditions::Conditions;
use crate::failure::Failure;

#[cfg(feature = "gpu")]
use hemicube::engines::{Gpu, HemicubeGpu};

/// What there is to measure on, or why there is nothing.
pub struct Device {
    #[cfg(feature = "gpu")]
    gpu: Option<Gpu>,
    /// One sentence.
    pub says: String,
}

#[cfg(feature = "gpu")]
impl Device {
    /// The most able adapter. Software adapters would take longer than all the rest: only quick
    /// runs, which measure little, measure them.
    pub fn open(conditions: &Conditions) -> Self {
        match Gpu::open() {
            Ok(gpu) if gpu.adapter().is_software && !conditions.quick => {
                let name = &gpu.adapter().name;
                let says = format!("The graphics adapter, {name}, is software and not measured.");
                Self { gpu: None, says }
            }
            Ok(gpu) => {
                let adapter = gpu.adapter();
                let software = if adapter.is_software { " (software)" } else { "" };
                let says = format!("GPU: {}{software}, {}.", adapter.name, adapter.backend);
                Self { gpu: Some(gpu), says }
            }
            Err(error) => Self { gpu: None, says: format!("No GPU is measured: {error}.") },
        }
    }

    /// Whether there is a device to measure on.
    pub fn is_there(&self) -> bool {
        self.gpu.is_some()
    }

    /// Hemicubes on the device.
    pub fn hemicube<'a>(
        &self,
        geometry: &'a Geometry,
        patches: &'a Patches,
        conditions: &Conditions,
        draw: Draw,
    ) -> Result<Box<dyn Engine + 'a>, Failure> {
        /// Bytes for rows under way.
        const MEMORY: u64 = 1 << 30;
        let Some(gpu) = &self.gpu else { return Err(Failure::failed(&self.says)) };
        let options = conditions.hemicube(draw);
        let engine = HemicubeGpu::on(gpu, geometry, patches, options, MEMORY);
        Ok(Box::new(engine.map_err(Failure::failed)?))
    }
}

#[cfg(not(feature = "gpu"))]
impl Device {
    /// Nothing.
    pub fn open(_: &Conditions) -> Self {
        let says = "No GPU is measured: this program was built without --features gpu.";
        Self { says: says.to_owned() }
    }

    /// Whether there is a device to measure on.
    pub fn is_there(&self) -> bool {
        false
    }

    /// Why not.
    pub fn hemicube<'a>(
        &self,
        _: &'a Geometry,
        _: &'a Patches,
        _: &Conditions,
        _: Draw,
    ) -> Result<Box<dyn Engine + 'a>, Failure> {
        Err(Failure::failed(&self.says))
    }
}
