//! Arguments that are more than a word or a number, as they are read.

use std::path::PathBuf;

use glam::DVec3;
use hemicube::engines::rays::MOST_SAMPLES;
use hemicube::gather::{FEWEST_RAYS, MOST_RAYS};

use super::{Emission, Exposure};

/// Three numbers with commas between.
pub fn vector(text: &str) -> Result<DVec3, String> {
    let parts: Vec<f64> = text
        .split(',')
        .map(str::trim)
        .map(str::parse)
        .collect::<Result<_, _>>()
        .map_err(|_| format!("'{text}' is not three numbers; write them like 1.5,-2,0"))?;
    match parts[..] {
        [x, y, z] if parts.iter().all(|p| p.is_finite()) => Ok(DVec3::new(x, y, z)),
        _ => Err(format!("'{text}' is not three numbers; write them like 1.5,-2,0")),
    }
}

/// The name of a lamp or material, and its emission.
pub fn emission(text: &str) -> Result<(String, Emission), String> {
    let wrong = || format!("'{text}' is not an emission; write it like lamp=10,10,8 or lamp=50%");
    let (name, value) = text.rsplit_once('=').ok_or_else(wrong)?;
    let emission = match value.strip_suffix('%') {
        Some(percent) => {
            let percent: f64 = percent.trim().parse().map_err(|_| wrong())?;
            Emission::Share(percent / 100.0)
        }
        None => Emission::Radiance(vector(value).map_err(|_| wrong())?),
    };
    let valid = match emission {
        Emission::Share(s) => (0.0..MOST_RADIANCE).contains(&s),
        Emission::Radiance(r) => r.min_element() >= 0.0 && r.max_element() < MOST_RADIANCE,
    };
    if valid && !name.is_empty() { Ok((name.to_owned(), emission)) } else { Err(wrong()) }
}

/// A lamp, and the file of its photometry.
pub fn photometry(text: &str) -> Result<(String, PathBuf), String> {
    match text.split_once('=') {
        Some((lamp, file)) if !lamp.is_empty() && !file.is_empty() => {
            Ok((lamp.to_owned(), PathBuf::from(file)))
        }
        _ => Err(format!("'{text}' is no lamp and file; write it like bulb=bulb.ies")),
    }
}

/// Radiances beyond this overflow when they are squared for a residual.
pub const MOST_RADIANCE: f64 = 1e30;

/// A share from 0 to below 1.
pub fn reflectance(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(rho) if (0.0..1.0).contains(&rho) => Ok(rho),
        _ => Err(format!("'{text}' is not a reflectance from 0 to below 1")),
    }
}

/// Two whole numbers with an x between.
pub fn size(text: &str) -> Result<(usize, usize), String> {
    let wrong = || format!("'{text}' is not a size; write it like 800x600");
    let (w, h) = text.split_once(['x', 'X']).ok_or_else(wrong)?;
    Ok((w.parse().map_err(|_| wrong())?, h.parse().map_err(|_| wrong())?))
}

/// `auto`, or a number of stops.
pub fn exposure(text: &str) -> Result<Exposure, String> {
    if text == "auto" {
        return Ok(Exposure::Auto);
    }
    match text.parse() {
        Ok(stops) if (-100.0..=100.0).contains(&stops) => Ok(Exposure::Stops(stops)),
        _ => Err(format!("'{text}' is neither auto nor a number of stops from -100 to 100")),
    }
}

/// Per cent, with or without the sign, as a share of 1.
pub fn percent(text: &str) -> Result<f64, String> {
    /// Below it are the limits of single precision.
    const LEAST: f64 = 1e-4;
    match text.trim().trim_end_matches('%').trim_end().parse::<f64>() {
        Ok(percent) if (LEAST..=100.0).contains(&percent) => Ok(percent / 100.0),
        _ => Err(format!(
            "'{text}' is not an error in per cent from {LEAST} to 100; write it like .1 or .1%, \
             which both \
             mean one in a thousand"
        )),
    }
}

/// Rays a row.
pub fn samples(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(n) if (32..=MOST_SAMPLES).contains(&n) => Ok(n),
        _ => Err(format!("'{text}' is not a number of rays from 32 to {MOST_SAMPLES}")),
    }
}

/// Rays a point.
pub fn point_rays(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(n) if (FEWEST_RAYS..=MOST_RAYS).contains(&n) => Ok(n),
        _ => Err(format!("'{text}' is not a number of rays from {FEWEST_RAYS} to {MOST_RAYS}")),
    }
}

/// An amount of memory in bytes, with or without a unit.
pub fn bytes(text: &str) -> Result<u64, String> {
    let wrong = || format!("'{text}' is not an amount of memory; write it like 800M or 4G");
    let (number, shift) = match text.trim_end_matches(['b', 'B', 'i']).char_indices().last() {
        Some((at, 'k' | 'K')) => (&text[..at], 10),
        Some((at, 'm' | 'M')) => (&text[..at], 20),
        Some((at, 'g' | 'G')) => (&text[..at], 30),
        _ => (text, 0),
    };
    let number: f64 = number.trim().parse().map_err(|_| wrong())?;
    if number.is_finite() && number > 0.0 {
        Ok((number * f64::from(1_u32 << shift)) as u64)
    } else {
        Err(wrong())
    }
}
