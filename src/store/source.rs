//! What emits, and which of it is solved for together.

use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::PI;

use serde::{Deserialize, Serialize};

use super::error::{GroupError, MixError};
use crate::scene::{Lamp, Optics, Rgb, Scene, luminance};

/// What emits light in a scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Emitter {
    /// The surfaces of a material, by its index in the scene's optics.
    Material(usize),
    /// A lamp, by its index in the scene.
    Lamp(usize),
    /// The surroundings.
    Sky,
}

/// An emitter as it was solved.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Member {
    /// Which.
    pub emitter: Emitter,
    /// What it emitted then: radiance, or intensity, or irradiance on what faces it.
    pub emission: Rgb,
    /// Whether a texture multiplied that.
    pub textured: bool,
}

/// Emitters that are solved together, and can only change together.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Source {
    /// The name of its emitters, or of their group.
    pub name: String,
    /// The emitters; at least one.
    pub members: Vec<Member>,
}

/// Names of materials and lamps that are to be one source.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Group {
    /// The name of the source.
    pub name: String,
    /// What is in it. All of it emits, or nothing of it yet.
    pub members: Vec<String>,
}

impl Emitter {
    /// What it emits, before a texture or a photometry is multiplied in: radiance of surfaces and
    /// the sky, W/(m² sr) or cd/m²; of lamps see [`Lamp::emission`]. `None` if there is none.
    #[must_use]
    pub fn emission(self, scene: &Scene) -> Option<Rgb> {
        match self {
            Self::Material(m) => scene.optics.materials.get(m).map(|m| m.radiance),
            Self::Lamp(l) => scene.lamps.get(l).map(Lamp::emission),
            Self::Sky => Some(scene.sky),
        }
    }

    /// Lets it emit so much, alike everywhere.
    pub fn set_emission(self, scene: &mut Scene, emission: Rgb) {
        match self {
            Self::Material(m) => scene.optics.set_radiance(m, emission),
            Self::Lamp(l) => scene.lamps[l].set_emission(emission),
            Self::Sky => scene.sky = emission,
        }
    }

    /// Multiplies what it emits.
    pub fn scale(self, scene: &mut Scene, factor: f64) {
        match self {
            Self::Material(m) => scene.optics.scale_radiance(m, factor),
            Self::Lamp(l) => {
                let lamp = &mut scene.lamps[l];
                lamp.set_emission(lamp.emission() * factor);
            }
            Self::Sky => scene.sky *= factor,
        }
    }

    fn emits(self, scene: &Scene) -> bool {
        self.emission(scene).is_some_and(|e| e != Rgb::ZERO)
    }

    fn is_textured(self, scene: &Scene) -> bool {
        match self {
            Self::Material(m) => {
                scene.optics.materials.get(m).is_some_and(|m| m.radiance_texture.is_some())
            }
            Self::Lamp(_) | Self::Sky => false,
        }
    }
}

/// The name of the sky as a source.
const SKY: &str = "sky";

/// What surfaces, lamps and the sky of a scene emit or might emit, with their names.
#[must_use]
pub fn emitters(scene: &Scene) -> Vec<(String, Emitter)> {
    let used: BTreeSet<u32> = scene.optics.material_of.iter().copied().collect();
    let materials = used.into_iter().filter_map(|m| {
        let material = scene.optics.materials.get(m as usize)?;
        Some((material.name.clone(), Emitter::Material(m as usize)))
    });
    let lamps = scene.lamps.iter().enumerate();
    let lamps = lamps.map(|(l, lamp)| (lamp.name().to_owned(), Emitter::Lamp(l)));
    materials.chain(lamps).chain([(SKY.to_owned(), Emitter::Sky)]).collect()
}

/// The sources of a scene: groups first, then all else that emits by name; what has one name is one
/// source.
///
/// # Errors
/// If a group cannot be.
pub fn sources(scene: &Scene, groups: &[Group]) -> Result<Vec<Source>, GroupError> {
    let all = emitters(scene);
    let mut taken: BTreeSet<Emitter> = BTreeSet::new();
    let mut sources = Vec::new();
    for group in groups {
        let mut members = Vec::new();
        for name in &group.members {
            let wrong = || (group.name.clone(), name.clone());
            let found = all.iter().filter(|e| e.0 == *name).map(|e| e.1).collect::<Vec<_>>();
            if found.is_empty() {
                let (group, name) = wrong();
                return Err(GroupError::Unknown { group, name });
            }
            for emitter in found {
                if !taken.insert(emitter) {
                    let (group, name) = wrong();
                    return Err(GroupError::Twice { group, name });
                }
                members.push((name, emitter));
            }
        }
        // What is dark has no share in what others emit, and a texture alone no strength.
        let lit = members.iter().any(|m| m.1.emits(scene));
        let dark = |m: &&(&String, Emitter)| !m.1.emits(scene) && (lit || m.1.is_textured(scene));
        if let Some((name, _)) = members.iter().find(dark) {
            let (group, name) = (group.name.clone(), (*name).clone());
            return Err(GroupError::Dark { group, name });
        }
        let members: Vec<Emitter> = members.into_iter().map(|m| m.1).collect();
        sources.push((group.name.clone(), members));
    }
    let mut rest: BTreeMap<&str, Vec<Emitter>> = BTreeMap::new();
    for (name, emitter) in all.iter().filter(|e| e.1.emits(scene) && !taken.contains(&e.1)) {
        rest.entry(name).or_default().push(*emitter);
    }
    sources.extend(rest.into_iter().map(|(name, members)| (name.to_owned(), members)));
    let names: Vec<&String> = sources.iter().map(|s| &s.0).collect();
    for (i, group) in groups.iter().enumerate() {
        let other = all.iter().any(|e| e.0 == group.name && !sources[i].1.contains(&e.1));
        if other || names.iter().filter(|n| **n == &group.name).count() > 1 {
            return Err(GroupError::Name(group.name.clone()));
        }
    }
    Ok(sources.into_iter().map(|(name, members)| source(scene, name, &members)).collect())
}

/// A source as it is solved: white, where its members have one colour and no texture, and else as
/// they are. The brightest is 1 if it is white.
fn source(scene: &Scene, name: String, members: &[Emitter]) -> Source {
    let now: Vec<Rgb> = members.iter().map(|e| e.emission(scene).unwrap_or(Rgb::ZERO)).collect();
    let textured = members.iter().any(|e| e.is_textured(scene));
    let colour = |e: &Rgb| *e / luminance(*e);
    let lit: Vec<&Rgb> = now.iter().filter(|e| **e != Rgb::ZERO).collect();
    let alike = lit.iter().all(|e| (colour(e) - colour(lit[0])).abs().max_element() < 1e-9);
    let brightest = now.iter().map(|e| luminance(*e)).fold(0.0, f64::max);
    let solved = |e: Rgb| match (textured || !alike, brightest > 0.0) {
        (true, _) => e,
        (false, true) => Rgb::splat(luminance(e) / brightest),
        (false, false) => Rgb::ONE,
    };
    let member = |(&emitter, e): (&Emitter, &Rgb)| Member {
        emitter,
        emission: solved(*e),
        textured: emitter.is_textured(scene),
    };
    Source { name, members: members.iter().zip(&now).map(member).collect() }
}

impl Source {
    /// Whether the light of some channels can only be made stronger or weaker together with others.
    #[must_use]
    pub fn keeps_its_colour(&self) -> bool {
        let white = |m: &Member| m.emission.x == m.emission.y && m.emission.y == m.emission.z;
        !self.members.iter().all(white) || self.members.iter().any(|m| m.textured)
    }

    /// By what the source's light is to be multiplied for it to be that of `scene`.
    ///
    /// # Errors
    /// If no factor does.
    pub fn weight(&self, scene: &Scene) -> Result<Rgb, MixError> {
        /// Ratios of members may differ by rounding.
        const ROUNDING: f64 = 1e-9;
        let mut weight: [Option<f64>; 3] = [None; 3];
        for member in &self.members {
            let now = member.emitter.emission(scene).ok_or(MixError::Foreign)?;
            if now != Rgb::ZERO && member.textured != member.emitter.is_textured(scene) {
                return Err(MixError::Texture(self.name.clone()));
            }
            for (c, weight) in weight.iter_mut().enumerate() {
                if member.emission[c] <= 0.0 {
                    if now[c] != 0.0 {
                        return Err(MixError::Colour(self.name.clone()));
                    }
                    continue;
                }
                let ratio = now[c] / member.emission[c];
                let first = *weight.get_or_insert(ratio);
                if (ratio - first).abs() > ROUNDING * first.abs().max(ratio) {
                    return Err(MixError::Apart(self.name.clone()));
                }
            }
        }
        Ok(Rgb::from_array(weight.map(|w| w.unwrap_or(0.0))))
    }
}

/// Lets some sources of a scene alone emit, as they were solved. `into` is a copy of `scene`.
pub(super) fn shine(scene: &Scene, sources: &[&Source], into: &mut Scene) {
    into.sky = Rgb::ZERO;
    into.lamps.clone_from(&scene.lamps);
    into.lamps.iter_mut().for_each(|l| l.set_emission(Rgb::ZERO));
    for material in &mut into.optics.materials {
        material.radiance = Rgb::ZERO;
    }
    for member in sources.iter().flat_map(|s| &s.members) {
        match member.emitter {
            Emitter::Material(m) => into.optics.materials[m].radiance = member.emission,
            Emitter::Lamp(l) => into.lamps[l].set_emission(member.emission),
            Emitter::Sky => into.sky = member.emission,
        }
    }
    let Optics { emission, materials, material_of, .. } = &mut into.optics;
    for (t, e) in emission.iter_mut().enumerate() {
        let material = &materials[material_of[t] as usize];
        // A texture's mean is part of what each triangle emits; such materials are solved as they
        // were, and may have been dimmed since.
        let textured = material.radiance_texture.is_some() && material.radiance != Rgb::ZERO;
        let now = scene.optics.materials[material_of[t] as usize].radiance;
        *e = match textured {
            true => scene.optics.emission[t] * ratio(material.radiance, now),
            false => material.radiance * PI,
        };
    }
}

/// By what `b` is to be multiplied to be `a`, channel by channel; 0 where that is dark.
fn ratio(a: Rgb, b: Rgb) -> Rgb {
    let of = |a: f64, b: f64| if b > 0.0 { a / b } else { 0.0 };
    Rgb::new(of(a.x, b.x), of(a.y, b.y), of(a.z, b.z))
}

/// Whether something emits in a scene that is not in any of the sources; its name.
pub(super) fn unsolved(scene: &Scene, sources: &[Source]) -> Option<String> {
    let solved: BTreeSet<Emitter> =
        sources.iter().flat_map(|s| s.members.iter().map(|m| m.emitter)).collect();
    let mut all = emitters(scene).into_iter();
    all.find(|(_, e)| e.emits(scene) && !solved.contains(e)).map(|e| e.0)
}
