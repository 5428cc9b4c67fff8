//! How surfaces reflect and emit. Form factors never see this.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};
use serde::{Deserialize, Serialize};

use super::Rgb;
use super::geometry::{Side, TriangleId};
use super::texture::Texture;

/// What the user gave for a group of triangles.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Material {
    /// Name in the file.
    pub name: String,
    /// Diffuse reflectance, 0..1 per channel, before the texture is multiplied in.
    pub reflectance: Rgb,
    /// Index in [`Optics::textures`] of what multiplies the reflectance.
    pub reflectance_texture: Option<u32>,
    /// Emitted radiance in W/(m² sr) or cd/m², before the texture is multiplied in.
    pub radiance: Rgb,
    /// Index in [`Optics::textures`] of what multiplies the radiance.
    pub radiance_texture: Option<u32>,
    /// Whether the back emits too (glTF `doubleSided`); OBJ emits from the front alone.
    pub emits_both: bool,
    /// Mean alpha, 0 for clear to 1 for opaque, before the texture is multiplied in. Below
    /// [`OPAQUE_ALPHA`] light passes.
    pub alpha: f64,
    /// Index in [`Optics::textures`] of the image whose alpha channel multiplies `alpha`.
    pub alpha_texture: Option<u32>,
    /// Alpha at or above this counts as 1 and below it as 0, point by point (glTF `MASK`).
    pub alpha_cutoff: Option<f64>,
    /// Whether the file says that it reflects as a mirror, glass or metal does, which is taken for
    /// diffuse reflection.
    #[serde(default)]
    pub specular: bool,
}

/// Triangles whose alpha is below this let light through and are left out of visibility.
pub const OPAQUE_ALPHA: f64 = 0.5;

/// Radiances, intensities and reflectances beyond this overflow when irradiances are squared for a
/// residual.
pub const MOST_RADIANCE: f64 = 1e30;

/// What stands in, in all channels, for a texture that is missing or does not decode.
pub const ASSUMED_TEXTURE: f64 = 0.5;

impl Material {
    /// Whether any texture belongs to it.
    #[must_use]
    pub fn is_textured(&self) -> bool {
        [self.reflectance_texture, self.radiance_texture, self.alpha_texture]
            .iter()
            .any(Option::is_some)
    }

    /// The textures that belong to it, each once.
    pub(super) fn textures(&self) -> impl Iterator<Item = u32> + use<> {
        let all = [self.reflectance_texture, self.radiance_texture, self.alpha_texture];
        (0..all.len()).filter(move |&i| !all[..i].contains(&all[i])).filter_map(move |i| all[i])
    }
}

impl Default for Material {
    /// White-grey paper: reflectance .5, no emission, opaque.
    fn default() -> Self {
        Self {
            name: String::from("default"),
            reflectance: DVec3::splat(0.5),
            reflectance_texture: None,
            radiance: DVec3::ZERO,
            radiance_texture: None,
            emits_both: false,
            alpha: 1.0,
            alpha_texture: None,
            alpha_cutoff: None,
            specular: false,
        }
    }
}

/// Reflectance and emission of each source triangle, and what the picture needs to evaluate them
/// at a point.
#[derive(Debug, Clone, Default)]
pub struct Optics {
    /// Mean reflectance ρ of each triangle, 0..1 per channel: the texture's mean over the
    /// triangle's own UV footprint times the material's factor, clamped to the largest allowed.
    pub reflectance: Vec<Rgb>,
    /// What multiplies the reflectance of each triangle's material: the mean of its corners'
    /// colours; empty if none has any.
    pub tint: Vec<Rgb>,
    /// Mean emission E of each triangle: self-emitted exitance in W/m² or lm/m², π × radiance.
    pub emission: Vec<Rgb>,
    /// Index in [`materials`](Self::materials) of each triangle.
    pub material_of: Vec<u32>,
    /// Texture coordinates of each triangle's corners; empty if no triangle has a texture.
    pub uv: Vec<[DVec2; 3]>,
    /// The materials.
    pub materials: Vec<Material>,
    /// The textures, still encoded.
    pub textures: Vec<Texture>,
    /// Reflectances are clamped to this.
    pub max_reflectance: f64,
}

impl Optics {
    /// The material of a triangle.
    #[must_use]
    pub fn material(&self, id: TriangleId) -> &Material {
        &self.materials[self.material_of[id.index()] as usize]
    }

    /// What multiplies the reflectance of a triangle's material.
    #[must_use]
    pub fn tint(&self, id: TriangleId) -> Rgb {
        self.tint.get(id.index()).copied().unwrap_or(Rgb::ONE)
    }

    /// Mean emission E (exitance) of one side of a triangle.
    #[must_use]
    pub fn emission(&self, id: TriangleId, side: Side) -> Rgb {
        if side == Side::Front || self.material(id).emits_both {
            self.emission[id.index()]
        } else {
            DVec3::ZERO
        }
    }

    /// Clamps reflectances to `limit`, in the picture too.
    pub fn limit_reflectance(&mut self, limit: f64) {
        self.max_reflectance = limit;
        for rho in &mut self.reflectance {
            *rho = rho.min(Rgb::splat(limit));
        }
    }

    /// Lets the material of that index emit `radiance` (W/(m² sr) or cd/m²), alike everywhere.
    pub fn set_radiance(&mut self, material: usize, radiance: Rgb) {
        let m = &mut self.materials[material];
        (m.radiance, m.radiance_texture) = (radiance, None);
        for (e, _) in self
            .emission
            .iter_mut()
            .zip(&self.material_of)
            .filter(|(_, i)| **i as usize == material)
        {
            *e = radiance * PI;
        }
    }

    /// Multiplies what the material of that index emits.
    pub fn scale_radiance(&mut self, material: usize, factor: f64) {
        self.materials[material].radiance *= factor;
        for (e, _) in self
            .emission
            .iter_mut()
            .zip(&self.material_of)
            .filter(|(_, i)| **i as usize == material)
        {
            *e *= factor;
        }
    }

    /// Lets the material of that index reflect `reflectance` (0..1 per channel), alike everywhere
    /// but for colours of vertices, and no more than is allowed.
    pub fn set_reflectance(&mut self, material: usize, reflectance: Rgb) {
        let m = &mut self.materials[material];
        (m.reflectance, m.reflectance_texture) = (reflectance, None);
        let most = Rgb::splat(self.max_reflectance);
        for t in (0..self.reflectance.len()).filter(|&t| self.material_of[t] as usize == material) {
            let tint = self.tint.get(t).copied().unwrap_or(Rgb::ONE);
            self.reflectance[t] = (reflectance * tint).clamp(Rgb::ZERO, most);
        }
    }

    /// Whether any triangle emits.
    #[must_use]
    pub fn emits(&self) -> bool {
        self.emission.iter().any(|e| e.max_element() > 0.0)
    }

    /// Lets [`ASSUMED_TEXTURE`] stand for a texture in every material, for good: the picture must
    /// assume what the solution did.
    pub(super) fn forget_texture(&mut self, texture: u32) {
        for material in &mut self.materials {
            if material.reflectance_texture.take_if(|t| *t == texture).is_some() {
                material.reflectance *= ASSUMED_TEXTURE;
            }
            if material.radiance_texture.take_if(|t| *t == texture).is_some() {
                material.radiance *= ASSUMED_TEXTURE;
            }
            material.alpha_texture.take_if(|t| *t == texture);
        }
    }
}
