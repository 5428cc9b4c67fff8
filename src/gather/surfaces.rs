//! What surfaces reflect and emit at a point, textures included.

use std::f64::consts::PI;

use rayon::prelude::*;

use crate::patches::SurfacePoint;
use crate::scene::{Rgb, Scene, TextureSampler};

/// Reflectance and emission at points, with textures decoded.
#[derive(Debug)]
pub(crate) struct Surfaces {
    textures: Vec<Option<TextureSampler>>,
}

impl Surfaces {
    /// Textures that do not decode were named when the scene was read, and count as their mean.
    pub fn new(scene: &Scene) -> Self {
        let materials = &scene.optics.materials;
        let used = |t: usize| {
            let t = Some(t as u32);
            materials.iter().any(|m| m.reflectance_texture == t || m.radiance_texture == t)
        };
        let textures = scene
            .optics
            .textures
            .par_iter()
            .enumerate()
            .map(|(t, texture)| if used(t) { texture.decode().ok() } else { None })
            .collect();
        Self { textures }
    }

    /// Reflectance ρ(x) at a point.
    pub fn reflectance(&self, scene: &Scene, p: SurfacePoint) -> Rgb {
        let optics = &scene.optics;
        let material = optics.material(p.triangle);
        match self.texel(scene, material.reflectance_texture, p) {
            Some(texel) => {
                let rho = material.reflectance * texel * optics.tint(p.triangle);
                rho.clamp(Rgb::ZERO, Rgb::splat(optics.max_reflectance))
            }
            None => optics.reflectance[p.triangle.index()],
        }
    }

    /// Emitted radiance L_e(x) at a point, W/(m² sr) or cd/m².
    pub fn emitted(&self, scene: &Scene, p: SurfacePoint) -> Rgb {
        let optics = &scene.optics;
        let mean = optics.emission(p.triangle, p.side) / PI;
        if mean == Rgb::ZERO {
            return mean;
        }
        let material = optics.material(p.triangle);
        match self.texel(scene, material.radiance_texture, p) {
            Some(texel) => material.radiance * texel,
            None => mean,
        }
    }

    fn texel(&self, scene: &Scene, texture: Option<u32>, p: SurfacePoint) -> Option<Rgb> {
        let sampler = self.textures.get(texture? as usize)?.as_ref()?;
        let [a, b, c] = *scene.optics.uv.get(p.triangle.index())?;
        let l = p.barycentric();
        Some(sampler.sample(a * l.x + b * l.y + c * l.z))
    }
}
