//! Materials: the diffuse part of glTF's metallic-roughness model, and what it emits.

use std::collections::HashMap;
use std::sync::Arc;

use glam::{DAffine2, DMat2, DVec2};
use gltf::json;
use gltf::json::material::AlphaMode;
use gltf::json::texture::WrappingMode;
use gltf::json::validation::Checked;

use super::document::{Document, label};
use super::uri;
use crate::scene::builder::SceneBuilder;
use crate::scene::geometry::Sides;
use crate::scene::optics::{ASSUMED_TEXTURE, MOST_RADIANCE, Material};
use crate::scene::source::{EXPORT_AGAIN, ImportError};
use crate::scene::texture::{Texture, Wrap};
use crate::scene::{Rgb, Severity};

/// A material that is in use, and what the triangles with it need to know.
#[derive(Debug, Clone, Copy)]
pub struct Used {
    pub index: u32,
    pub sides: Sides,
    /// The `TEXCOORD` set of its textures, if it has any.
    pub uv_set: Option<u32>,
    pub uv_transform: DAffine2,
}

/// The materials met so far.
#[derive(Default)]
pub struct Materials {
    used: HashMap<Option<usize>, Used>,
    /// By texture index; `None` for those that could not be read.
    textures: HashMap<usize, Option<u32>>,
    images: HashMap<usize, Result<Arc<[u8]>, String>>,
}

/// A texture of the document and how coordinates get onto it.
struct Map {
    texture: Option<u32>,
    uv_set: u32,
    uv_transform: DAffine2,
}

/// Transmission above this lets light pass.
const TRANSPARENT: f64 = 0.5;

/// Metallic factors above this are named: what they reflect is not diffuse.
const METALLIC: f32 = 0.5;

/// `alphaCutoff` where the file has none.
const DEFAULT_CUTOFF: f64 = 0.5;

impl Materials {
    /// A material by its index; `None` is glTF's default, pure white.
    pub fn get(
        &mut self,
        document: &Document<'_>,
        index: Option<usize>,
        builder: &mut SceneBuilder,
    ) -> Result<Used, ImportError> {
        if let Some(used) = self.used.get(&index) {
            return Ok(*used);
        }
        // The default material is metallic by omission only: that is no doubt to name.
        let mut default = json::Material::default();
        default.pbr_metallic_roughness.metallic_factor.0 = 0.0;
        let (given, name) = match index {
            None => (&default, "default".to_owned()),
            Some(i) => {
                let Some(given) = document.root.materials.get(i) else {
                    return Err(document.malformed(
                        format!("material {i}"),
                        "does not exist",
                        EXPORT_AGAIN,
                    ));
                };
                let name = given.name.clone().filter(|n| !n.is_empty());
                (given, name.unwrap_or_else(|| format!("{i}")))
            }
        };
        let used = self.add(document, given, name, builder)?;
        self.used.insert(index, used);
        Ok(used)
    }

    fn add(
        &mut self,
        document: &Document<'_>,
        given: &json::Material,
        name: String,
        builder: &mut SceneBuilder,
    ) -> Result<Used, ImportError> {
        let place = format!("material {name}");
        let pbr = &given.pbr_metallic_roughness;
        let extensions = given.extensions.as_ref();
        let glossy = extensions.and_then(|e| e.pbr_specular_glossiness.as_ref());
        let (factor, base_map) = match glossy {
            Some(glossy) => (glossy.diffuse_factor.0, glossy.diffuse_texture.as_ref()),
            None => (pbr.base_color_factor.0, pbr.base_color_texture.as_ref()),
        };
        let factor = factor.map(f64::from);
        let strength = extensions
            .and_then(|e| e.emissive_strength.as_ref())
            .map_or(1.0, |e| f64::from(e.emissive_strength.0));
        let mut material = Material {
            name,
            reflectance: Rgb::new(factor[0], factor[1], factor[2]),
            radiance: Rgb::from(given.emissive_factor.0.map(f64::from)) * strength,
            emits_both: given.double_sided,
            specular: is_metallic(given),
            ..Material::default()
        };
        if let Some(glossy) = glossy
            && material.reflectance == Rgb::ZERO
            && base_map.is_none()
        {
            material.reflectance = Rgb::from(glossy.specular_factor.0.map(f64::from));
            builder.finding(
                Severity::Note,
                place.clone(),
                "has no diffuse colour; its specular colour counts as diffuse reflectance",
                "give it a diffuse colour of the same mean reflectance if that matters",
            );
        }
        for (value, what) in
            [(material.reflectance, "base colour"), (material.radiance, "emission")]
        {
            let valid = value.min_element() >= 0.0 && value.max_element() <= MOST_RADIANCE;
            if !valid || value.is_nan() {
                return Err(document.malformed(
                    place,
                    format!("its {what} is negative or exceeds {MOST_RADIANCE:e}"),
                    "correct the material and export the model again",
                ));
            }
        }

        let base = base_map.map(|info| self.map(document, info, &place, builder)).transpose()?;
        let emissive = match &given.emissive_texture {
            // A black factor switches the texture off.
            Some(info) if material.radiance != Rgb::ZERO => {
                Some(self.map(document, info, &place, builder)?)
            }
            _ => None,
        };
        match base.as_ref().map(|m| m.texture) {
            Some(None) => material.reflectance *= ASSUMED_TEXTURE,
            Some(texture) => material.reflectance_texture = texture,
            None => {}
        }
        match emissive.as_ref().map(|m| m.texture) {
            Some(None) => material.radiance *= ASSUMED_TEXTURE,
            Some(texture) => material.radiance_texture = texture,
            None => {}
        }
        set_alpha(&mut material, given, factor[3]);
        name_doubts(given, &place, builder);

        if let (Some(a), Some(b)) = (&base, &emissive)
            && (a.uv_set != b.uv_set || a.uv_transform != b.uv_transform)
        {
            builder.finding(
                Severity::Warning,
                place,
                "its emissive texture has texture coordinates of its own; those of the base \
                 colour are taken for both",
                "use one set of texture coordinates",
            );
        }
        let map = base.or(emissive);
        Ok(Used {
            sides: if given.double_sided { Sides::Two } else { Sides::One },
            uv_set: map.as_ref().filter(|_| material.is_textured()).map(|m| m.uv_set),
            uv_transform: map.map_or(DAffine2::IDENTITY, |m| m.uv_transform),
            index: builder.material(material),
        })
    }

    fn map(
        &mut self,
        document: &Document<'_>,
        info: &json::texture::Info,
        place: &str,
        builder: &mut SceneBuilder,
    ) -> Result<Map, ImportError> {
        let index = info.index.value();
        let Some(texture) = document.root.textures.get(index) else {
            return Err(document.malformed(
                place,
                format!("its texture {index} does not exist"),
                EXPORT_AGAIN,
            ));
        };
        let transform = info.extensions.as_ref().and_then(|e| e.texture_transform.as_ref());
        let uv_set = transform.and_then(|t| t.tex_coord).unwrap_or(info.tex_coord);
        let uv_transform = transform.map_or(DAffine2::IDENTITY, |t| {
            let (sin, cos) = f64::from(t.rotation.0).sin_cos();
            let [sx, sy] = t.scale.0.map(f64::from);
            // Counter-clockwise in the image, whose v points down: the extension's text and its
            // test model, against the sign in its sample shader.
            let rotation = DMat2::from_cols(DVec2::new(cos, -sin), DVec2::new(sin, cos));
            DAffine2::from_mat2_translation(
                rotation * DMat2::from_diagonal(DVec2::new(sx, sy)),
                DVec2::from(t.offset.0.map(f64::from)),
            )
        });
        let texture = match self.textures.get(&index) {
            Some(known) => *known,
            None => {
                let added = self.texture(document, index, texture, builder);
                self.textures.insert(index, added);
                added
            }
        };
        Ok(Map { texture, uv_set, uv_transform })
    }

    fn texture(
        &mut self,
        document: &Document<'_>,
        index: usize,
        texture: &json::Texture,
        builder: &mut SceneBuilder,
    ) -> Option<u32> {
        let webp = texture
            .extensions
            .as_ref()
            .and_then(|e| e.others.get("EXT_texture_webp")?.get("source")?.as_u64());
        let source = webp.map_or(texture.source.value(), |s| s as usize);
        let image = document.root.images.get(source);
        let name =
            label("texture", index, texture.name.as_deref().or_else(|| image?.name.as_deref()));
        let encoded = self.images.entry(source).or_insert_with(|| image_bytes(document, image));
        match encoded {
            Ok(encoded) => {
                let encoded = encoded.clone();
                let sampler = texture.sampler.and_then(|s| document.root.samplers.get(s.value()));
                let wrap = sampler.map_or([Wrap::Repeat; 2], |s| [s.wrap_s, s.wrap_t].map(wrap));
                Some(builder.texture(Texture { name, encoded, wrap, v_up: false, opacity: false }))
            }
            Err(problem) => {
                builder.finding(
                    Severity::Warning,
                    name,
                    format!("{problem}; a mid-grey of {ASSUMED_TEXTURE} is assumed"),
                    "put the image beside the model, as PNG or JPEG",
                );
                None
            }
        }
    }
}

pub(super) fn image_bytes(
    document: &Document<'_>,
    image: Option<&json::Image>,
) -> Result<Arc<[u8]>, String> {
    match image {
        Some(json::Image { uri: Some(name), .. }) => uri::read(document.source, name),
        Some(json::Image { buffer_view: Some(view), .. }) => {
            document.view(view.value()).map(|(bytes, _)| bytes.into()).map_err(|e| e.to_string())
        }
        _ => Err("has no image that can be read".into()),
    }
}

fn wrap(mode: Checked<WrappingMode>) -> Wrap {
    match mode {
        Checked::Valid(WrappingMode::ClampToEdge) => Wrap::Clamp,
        Checked::Valid(WrappingMode::MirroredRepeat) => Wrap::Mirror,
        _ => Wrap::Repeat,
    }
}

fn set_alpha(material: &mut Material, given: &json::Material, factor: f64) {
    let cutoff = given.alpha_cutoff.map_or(DEFAULT_CUTOFF, |c| f64::from(c.0));
    match given.alpha_mode {
        Checked::Valid(AlphaMode::Blend) => {
            material.alpha = factor;
            material.alpha_texture = material.reflectance_texture;
        }
        Checked::Valid(AlphaMode::Mask) if material.reflectance_texture.is_some() => {
            material.alpha = factor;
            material.alpha_texture = material.reflectance_texture;
            material.alpha_cutoff = Some(cutoff);
        }
        Checked::Valid(AlphaMode::Mask) => {
            material.alpha = if factor >= cutoff { 1.0 } else { 0.0 };
        }
        _ => {}
    }
    let transmission = given
        .extensions
        .as_ref()
        .and_then(|e| e.transmission.as_ref())
        .map_or(0.0, |t| f64::from(t.transmission_factor.0));
    if transmission > TRANSPARENT {
        material.alpha = material.alpha.min(1.0 - transmission);
        material.alpha_texture = None;
        material.alpha_cutoff = None;
    }
}

/// Whether it reflects as a metal does.
fn is_metallic(given: &json::Material) -> bool {
    let extensions = given.extensions.as_ref();
    let glossy = extensions.is_some_and(|e| e.pbr_specular_glossiness.is_some());
    !glossy && given.pbr_metallic_roughness.metallic_factor.0 > METALLIC
}

/// Names what of the material is taken for something else.
fn name_doubts(given: &json::Material, place: &str, builder: &mut SceneBuilder) {
    let pbr = &given.pbr_metallic_roughness;
    if is_metallic(given) {
        let textured =
            if pbr.metallic_roughness_texture.is_some() { " where its map says so" } else { "" };
        builder.finding(
            Severity::Note,
            place,
            format!("is metallic{textured}; its base colour counts as diffuse reflectance"),
            "give it a diffuse material of the same mean reflectance if that matters",
        );
    }
    let extensions = given.extensions.as_ref();
    if extensions.is_some_and(|e| e.unlit.is_some()) {
        builder.finding(
            Severity::Note,
            place,
            "is unlit in the file; its base colour counts as diffuse reflectance",
            "give it an emissive colour if it is a source of light",
        );
    }
    let transmission = extensions.and_then(|e| e.transmission.as_ref());
    if transmission.is_some_and(|t| t.transmission_texture.is_some()) {
        builder.finding(
            Severity::Note,
            place,
            "its transmission map is ignored; the factor counts everywhere",
            "",
        );
    }
}
