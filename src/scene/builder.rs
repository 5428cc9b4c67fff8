//! Assembles a [`Scene`]: every importer and every built-in goes through here.

use std::collections::HashMap;
use std::f64::consts::PI;

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::cutout;
use super::geometry::{Sides, Surface, TriangleState};
use super::optics::{ASSUMED_TEXTURE, Material, OPAQUE_ALPHA, Optics};
use super::texture::Texture;
use super::{Camera, Finding, Lamp, Rgb, Scene, Setting, Severity};

/// Largest reflectance unless the user says otherwise: brighter "white" is a modelling default
/// rather than a paint, and light would hardly ever be absorbed.
pub const MAX_REFLECTANCE: f64 = 0.9;

/// Collects triangles and materials; [`finish`](Self::finish) cuts out masks, flags flaws,
/// averages textures, clamps reflectances and says what it did.
#[derive(Debug, Clone)]
pub struct SceneBuilder {
    scene: Scene,
    has_uv: bool,
}

impl SceneBuilder {
    /// An empty scene with `y` upwards.
    #[must_use]
    pub fn new(name: impl Into<String>) -> Self {
        let optics = Optics { max_reflectance: MAX_REFLECTANCE, ..Optics::default() };
        let scene = Scene { name: name.into(), optics, up: DVec3::Y, ..Scene::default() };
        Self { scene, has_uv: false }
    }

    /// Reflectances above `limit` will be clamped to it.
    pub fn max_reflectance(&mut self, limit: f64) {
        self.scene.optics.max_reflectance = limit;
    }

    /// The direction that points upwards.
    pub fn up(&mut self, up: DVec3) {
        self.scene.up = up;
    }

    /// Adds a position in metres and returns its index.
    pub fn vertex(&mut self, position: DVec3) -> u32 {
        self.scene.geometry.vertices.push(position);
        (self.scene.geometry.vertices.len() - 1) as u32
    }

    /// Adds a material and returns its index.
    pub fn material(&mut self, material: Material) -> u32 {
        self.scene.optics.materials.push(material);
        (self.scene.optics.materials.len() - 1) as u32
    }

    /// Adds a texture and returns its index.
    pub fn texture(&mut self, texture: Texture) -> u32 {
        self.scene.optics.textures.push(texture);
        (self.scene.optics.textures.len() - 1) as u32
    }

    /// Adds a named surface, of no object, and returns its index.
    pub fn surface(&mut self, surface: Surface) -> u32 {
        self.surface_in(surface, "")
    }

    /// Adds a named surface of the named object and returns its index.
    pub fn surface_in(&mut self, surface: Surface, object: &str) -> u32 {
        self.scene.geometry.surfaces.push(surface);
        self.scene.object_of.push(object.into());
        (self.scene.geometry.surfaces.len() - 1) as u32
    }

    /// Adds a triangle, counter-clockwise seen from its front. All indices must be valid.
    pub fn triangle(
        &mut self,
        vertices: [u32; 3],
        uv: Option<[DVec2; 3]>,
        surface: u32,
        material: u32,
        sides: Sides,
    ) {
        let (g, o) = (&mut self.scene.geometry, &mut self.scene.optics);
        g.triangles.push(vertices);
        g.sides.push(sides);
        g.surface_of.push(surface);
        g.state.push(if o.materials[material as usize].alpha < OPAQUE_ALPHA {
            TriangleState::Transparent
        } else {
            TriangleState::Solid
        });
        o.material_of.push(material);
        self.has_uv |= uv.is_some();
        o.uv.push(uv.unwrap_or([DVec2::ZERO; 3]));
    }

    /// Multiplies the reflectance of the triangle that was added last, 0..1 a channel.
    pub(super) fn tint(&mut self, tint: Rgb) {
        let o = &mut self.scene.optics;
        o.tint.resize(o.material_of.len(), Rgb::ONE);
        if let Some(last) = o.tint.last_mut() {
            *last = if tint.is_nan() { Rgb::ONE } else { tint.clamp(Rgb::ZERO, Rgb::ONE) };
        }
    }

    /// Adds a mesh as a surface of its own, all of one material, and returns the surface's index.
    ///
    /// `vertices` are in metres; `triangles` are indices of them, counter-clockwise seen from the
    /// front. They must be valid, and so must `material`.
    ///
    /// ```
    /// use glam::DVec3;
    /// use hemicube::scene::{Material, SceneBuilder, Sides};
    ///
    /// let mut builder = SceneBuilder::new("sheet");
    /// let paper = builder.material(Material::default());
    /// let corners = [DVec3::ZERO, DVec3::X, DVec3::X + DVec3::Y, DVec3::Y];
    /// builder.mesh("square metre", &corners, &[[0, 1, 2], [0, 2, 3]], paper, Sides::Two);
    /// let geometry = builder.finish().geometry;
    /// assert_eq!(geometry.ids().map(|t| geometry.area(t)).sum::<f64>(), 1.0);
    /// ```
    pub fn mesh(
        &mut self,
        name: &str,
        vertices: &[DVec3],
        triangles: &[[u32; 3]],
        material: u32,
        sides: Sides,
    ) -> u32 {
        let surface = self.surface(Surface { name: name.into(), node: 0, primitive: 0 });
        let base = self.scene.geometry.vertices.len() as u32;
        self.scene.geometry.vertices.extend(vertices);
        for triangle in triangles {
            self.triangle(triangle.map(|v| base + v), None, surface, material, sides);
        }
        surface
    }

    /// Adds a source of light without extent.
    pub fn lamp(&mut self, lamp: Lamp) {
        self.scene.lamps.push(lamp);
    }

    /// Adds a point of view.
    pub fn camera(&mut self, camera: Camera) {
        self.scene.cameras.push(camera);
    }

    /// Adds something worth knowing.
    pub fn finding(
        &mut self,
        severity: Severity,
        place: impl Into<String>,
        message: impl Into<String>,
        remedy: impl Into<String>,
    ) {
        self.add_finding(Finding::new(severity, place, message, remedy));
    }

    /// Adds something worth knowing that a choice of the caller's settles.
    pub(super) fn add_finding(&mut self, finding: Finding) {
        self.scene.findings.push(finding);
    }

    /// The finished scene.
    #[must_use]
    pub fn finish(mut self) -> Scene {
        cutout::cut(&mut self.scene);
        self.average_textures();
        self.scene.geometry.flag_flaws();
        if !self.has_uv {
            self.scene.optics.uv = Vec::new();
        }
        self.name_transparent();
        self.clamp_reflectances();
        self.scene.findings = grouped(std::mem::take(&mut self.scene.findings));
        self.scene
    }

    /// Reflectance and emission of every triangle: the material's, times the texture's mean over
    /// the triangle's own footprint. One texture is decoded at a time.
    fn average_textures(&mut self) {
        let optics = &mut self.scene.optics;
        let material = |m: &u32| &optics.materials[*m as usize];
        optics.reflectance = optics.material_of.iter().map(|m| material(m).reflectance).collect();
        if optics.tint.iter().any(|tint| *tint != Rgb::ONE) {
            optics.tint.resize(optics.material_of.len(), Rgb::ONE);
            optics.reflectance.iter_mut().zip(&optics.tint).for_each(|(rho, tint)| *rho *= *tint);
        } else {
            optics.tint = Vec::new();
        }
        optics.emission = optics.material_of.iter().map(|m| material(m).radiance * PI).collect();
        let mut triangles_of = vec![Vec::new(); optics.materials.len()];
        for (t, &m) in optics.material_of.iter().enumerate() {
            if optics.materials[m as usize].is_textured() {
                triangles_of[m as usize].push(t);
            }
        }
        let mut users = vec![Vec::new(); optics.textures.len()];
        for (material, triangles) in optics.materials.iter().zip(&triangles_of) {
            material.textures().for_each(|t| users[t as usize].extend(triangles));
        }
        for (index, users) in (0..).zip(users) {
            if !users.is_empty() {
                self.average_texture(index, &users);
            }
        }
    }

    fn average_texture(&mut self, index: u32, users: &[usize]) {
        let optics = &mut self.scene.optics;
        let sampler = match optics.textures[index as usize].decode() {
            Ok(sampler) => sampler,
            Err(error) => {
                self.scene.findings.push(Finding::new(
                    Severity::Warning,
                    format!("texture {}", error.name),
                    format!(
                        "does not decode ({}); a mid-grey of {ASSUMED_TEXTURE} is assumed",
                        error.problem
                    ),
                    "save it as PNG or JPEG, and no larger than it need be",
                ));
                for &t in users {
                    let material = &optics.materials[optics.material_of[t] as usize];
                    if material.reflectance_texture == Some(index) {
                        optics.reflectance[t] *= ASSUMED_TEXTURE;
                    }
                    if material.radiance_texture == Some(index) {
                        optics.emission[t] *= ASSUMED_TEXTURE;
                    }
                }
                optics.forget_texture(index);
                return;
            }
        };
        // Cards and tiles have the same place in the texture over and over.
        let mut number: HashMap<[[u64; 2]; 3], usize> = HashMap::new();
        let mut places = Vec::new();
        let place_of: Vec<usize> = users
            .iter()
            .map(|&t| {
                let uv = optics.uv[t];
                *number.entry(uv.map(|at| at.to_array().map(f64::to_bits))).or_insert_with(|| {
                    places.push(uv);
                    places.len() - 1
                })
            })
            .collect();
        let share = sampler.texel_share(places.iter().copied());
        let means: Vec<Rgb> =
            places.par_iter().map(|&uv| sampler.mean_within(uv, None, share).0).collect();
        for (&t, place) in users.iter().zip(place_of) {
            let mean = means[place];
            let material = &optics.materials[optics.material_of[t] as usize];
            if material.reflectance_texture == Some(index) {
                optics.reflectance[t] *= mean;
            }
            if material.radiance_texture == Some(index) {
                optics.emission[t] *= mean;
            }
        }
    }

    fn name_transparent(&mut self) {
        let optics = &self.scene.optics;
        let mut count = vec![0_usize; optics.materials.len()];
        for (state, &m) in self.scene.geometry.state.iter().zip(&optics.material_of) {
            count[m as usize] += usize::from(*state == TriangleState::Transparent);
        }
        for (material, count) in optics.materials.iter().zip(count) {
            if count > 0 {
                self.scene.findings.push(Finding::new(
                    Severity::Note,
                    format!("material {}", material.name),
                    format!("lets light through: {count} triangles are left out as if not there"),
                    "make it opaque (alpha, or d of MTL, of at least .5) if it should block light",
                ));
            }
        }
    }

    fn clamp_reflectances(&mut self) {
        let limit = self.scene.optics.max_reflectance;
        let optics = &mut self.scene.optics;
        let mut brightest = vec![0.0_f64; optics.materials.len()];
        for (rho, &m) in optics.reflectance.iter_mut().zip(&optics.material_of) {
            let b = &mut brightest[m as usize];
            *b = b.max(rho.max_element());
            *rho = rho.clamp(Rgb::ZERO, Rgb::splat(limit));
        }
        for (material, brightest) in optics.materials.iter().zip(brightest) {
            if brightest > limit {
                let clamped = Finding::new(
                    Severity::Note,
                    format!("material {}", material.name),
                    format!("reflectance {brightest:.3} is clamped to {limit}"),
                    "give it a measured reflectance",
                );
                self.scene.findings.push(clamped.settled_by(Setting::MaxReflectance));
            }
        }
    }
}

/// Findings that are equal but for their place, as one.
fn grouped(findings: Vec<Finding>) -> Vec<Finding> {
    /// Places that are named.
    const NAMED: usize = 4;
    let mut groups: Vec<(Finding, usize)> = Vec::new();
    let mut group_of: HashMap<(String, String), usize> = HashMap::new();
    for finding in findings {
        let key = (finding.message.clone(), finding.remedy.clone());
        let &mut group = group_of.entry(key).or_insert(groups.len());
        match groups.get_mut(group) {
            Some((first, count)) => {
                *count += 1;
                if *count <= NAMED {
                    first.place += &format!(", {}", finding.place);
                }
            }
            None => groups.push((finding, 1)),
        }
    }
    let said = |(finding, count): (Finding, usize)| match count.saturating_sub(NAMED) {
        0 => finding,
        more => Finding { place: format!("{} and {more} more", finding.place), ..finding },
    };
    groups.into_iter().map(said).collect()
}
