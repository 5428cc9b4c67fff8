//! Material libraries: what of them matters to diffuse light.

use std::collections::HashMap;

use glam::DVec2;

use crate::scene::Rgb;
use crate::scene::lines::{Statement, number, statements};
use crate::scene::optics::MOST_RADIANCE;
use crate::scene::source::{ImportError, Place, Source};

/// A material of a library, as far as it is given.
#[derive(Debug, Default, Clone, PartialEq)]
pub struct MtlMaterial {
    pub kd: Option<Rgb>,
    pub ke: Option<Rgb>,
    pub ks: Option<Rgb>,
    pub illum: Option<f64>,
    pub d: Option<f64>,
    pub tr: Option<f64>,
    pub map_kd: Option<Map>,
    pub map_ke: Option<Map>,
    pub map_d: Option<Map>,
}

/// A texture map.
#[derive(Debug, Clone, PartialEq)]
pub struct Map {
    pub file: String,
    pub clamp: bool,
    pub transform: UvTransform,
}

/// Options `-s` and `-o` of a texture map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UvTransform {
    pub scale: DVec2,
    pub offset: DVec2,
}

impl UvTransform {
    pub fn apply(&self, uv: DVec2) -> DVec2 {
        uv * self.scale + self.offset
    }
}

/// Texture coordinates as they are.
pub const NO_TRANSFORM: UvTransform = UvTransform { scale: DVec2::ONE, offset: DVec2::ZERO };

impl MtlMaterial {
    /// Opacity. `d` wins, as exporters disagree about which way `Tr` counts.
    pub fn alpha(&self) -> f64 {
        self.d.or(self.tr.map(|tr| 1.0 - tr)).unwrap_or(1.0)
    }

    /// Whether it is a mirror or glass (models of illumination from 3 on trace rays).
    pub fn is_specular(&self) -> bool {
        self.illum.is_some_and(|illum| illum >= 3.0)
    }
}

/// Adds the materials of a library. Yields whether all of them say `Tr 1` and nothing better: such
/// exporters mean opaque.
pub fn parse(
    source: &Source<'_>,
    library: &mut HashMap<String, MtlMaterial>,
) -> Result<bool, ImportError> {
    let mut own: HashMap<String, MtlMaterial> = HashMap::new();
    let mut name: Option<String> = None;
    statements(source.bytes, |s| {
        if s.keyword == "newmtl" {
            own.insert(s.rest.into(), MtlMaterial::default());
            name = Some(s.rest.into());
        } else if let Some(material) = name.as_ref().and_then(|n| own.get_mut(n)) {
            property(source, &s, material)?;
        }
        Ok(())
    })?;
    let inverse = !own.is_empty() && own.values().all(|m| m.d.is_none() && m.tr == Some(1.0));
    if inverse {
        own.values_mut().for_each(|m| m.tr = None);
    }
    library.extend(own);
    Ok(inverse)
}

fn property(
    source: &Source<'_>,
    s: &Statement<'_>,
    material: &mut MtlMaterial,
) -> Result<(), ImportError> {
    match s.keyword.to_ascii_lowercase().as_str() {
        "kd" => material.kd = Some(colour(source, s)?),
        "ke" => material.ke = Some(colour(source, s)?),
        "ks" => material.ks = colour(source, s).ok(),
        "illum" => material.illum = s.words().next().and_then(|word| word.parse().ok()),
        "d" => {
            let word = s.words().find(|w| *w != "-halo").unwrap_or_default();
            material.d = Some(number(source, s.line, word)?);
        }
        "tr" => material.tr = Some(number(source, s.line, s.words().next().unwrap_or_default())?),
        "map_kd" => material.map_kd = map(s.rest),
        "map_ke" => material.map_ke = map(s.rest),
        "map_d" => material.map_d = map(s.rest),
        _ => {}
    }
    Ok(())
}

/// Three numbers, or one for all channels.
fn colour(source: &Source<'_>, s: &Statement<'_>) -> Result<Rgb, ImportError> {
    let remedy = "give three numbers for red, green and blue";
    let fail = |problem: String| source.malformed(Place::Line(s.line), problem, remedy);
    let words: Vec<&str> = s.words().collect();
    if let Some(&kind @ ("spectral" | "xyz")) = words.first() {
        return Err(fail(format!("`{}` as {kind} cannot be read", s.keyword)));
    }
    let rgb = match words[..] {
        [y] => Rgb::splat(number(source, s.line, y)?),
        [r, g, b, ..] => Rgb::new(
            number(source, s.line, r)?,
            number(source, s.line, g)?,
            number(source, s.line, b)?,
        ),
        _ => return Err(fail(format!("`{}` needs one or three numbers", s.keyword))),
    };
    if rgb.min_element() < 0.0 {
        return Err(fail(format!("`{}` is negative", s.keyword)));
    }
    if rgb.max_element() > MOST_RADIANCE {
        return Err(fail(format!("`{}` exceeds {MOST_RADIANCE:e}", s.keyword)));
    }
    Ok(rgb)
}

/// Options, then a file name that may contain spaces.
fn map(rest: &str) -> Option<Map> {
    let mut map = Map { file: String::new(), clamp: false, transform: NO_TRANSFORM };
    let mut rest = rest.trim();
    while rest.starts_with('-') {
        let option = take_word(&mut rest);
        match option {
            "-s" | "-o" | "-t" => {
                let mut numbers = Vec::new();
                // The file name comes last, even if it looks like a number.
                while numbers.len() < 3 && rest.contains(char::is_whitespace) {
                    let Ok(x) = rest.split_ascii_whitespace().next().unwrap_or_default().parse()
                    else {
                        break;
                    };
                    numbers.push(x);
                    take_word(&mut rest);
                }
                let given = |default: f64| {
                    let at = |i: usize| numbers.get(i).copied().filter(|x: &f64| x.is_finite());
                    DVec2::new(at(0).unwrap_or(default), at(1).unwrap_or(default))
                };
                match option {
                    "-s" => map.transform.scale = given(1.0),
                    "-o" => map.transform.offset = given(0.0),
                    _ => {}
                }
            }
            "-clamp" => map.clamp = take_word(&mut rest) == "on",
            "-mm" => {
                take_word(&mut rest);
                take_word(&mut rest);
            }
            "-blendu" | "-blendv" | "-cc" | "-bm" | "-boost" | "-texres" | "-imfchan" | "-type" => {
                take_word(&mut rest);
            }
            _ => {}
        }
    }
    map.file = rest.trim_matches('"').into();
    (!map.file.is_empty()).then_some(map)
}

fn take_word<'a>(rest: &mut &'a str) -> &'a str {
    let (word, after) = rest.split_once(char::is_whitespace).unwrap_or((rest, ""));
    *rest = after.trim_start();
    word
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn map_options_are_taken_off_the_file_name() {
        let m = map("-blendu on -s 2 3 1 -o 0.5 -clamp on -mm 0 1 my wood.png").unwrap();
        assert_eq!(m.file, "my wood.png");
        assert!(m.clamp);
        assert_eq!(m.transform.scale, DVec2::new(2.0, 3.0));
        assert_eq!(m.transform.offset, DVec2::new(0.5, 0.0));
        assert_eq!(map("-s 1 1 1 007").unwrap().file, "007");
        assert_eq!(map("-s").map(|m| m.file), None);
        assert_eq!(map(""), None);
    }
}
