//! Arguments that are more than a word or a number, as they are read.

use std::path::PathBuf;

use glam::DVec3;
use hemicube::engines::rays::MOST_SAMPLES;
use hemicube::gather::{FEWEST_RAYS, MOST_RAYS};
use hemicube::store::Group;

use super::{CameraArg, Emission, Exposure, LampArg, SunArg};

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

/// An axis like `z` or `-x`, or three numbers.
pub fn direction(text: &str) -> Result<DVec3, String> {
    let (sign, axis) = text.strip_prefix('-').map_or((1.0, text), |axis| (-1.0, axis));
    match axis.trim_start_matches('+') {
        "x" | "X" => Ok(sign * DVec3::X),
        "y" | "Y" => Ok(sign * DVec3::Y),
        "z" | "Z" => Ok(sign * DVec3::Z),
        _ => {
            vector(text).map_err(|_| format!("'{text}' is no direction; write it like z or 0,0,1"))
        }
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

/// The name of a material, and its reflectance.
pub fn reflectances(text: &str) -> Result<(String, DVec3), String> {
    let wrong =
        || format!("'{text}' is not a reflectance; write it like wall=.7,.7,.6, each 0 to below 1");
    let (name, value) = text.rsplit_once('=').ok_or_else(wrong)?;
    let rho = vector(value).map_err(|_| wrong())?;
    let valid = rho.min_element() >= 0.0 && rho.max_element() < 1.0 && !name.is_empty();
    if valid { Ok((name.to_owned(), rho)) } else { Err(wrong()) }
}

/// The name of a group of sources, and of what is in it.
pub fn group(text: &str) -> Result<Group, String> {
    let wrong = || format!("'{text}' is no group; write it like desk=lamp-1,lamp-2");
    let (name, members) = text.split_once('=').ok_or_else(wrong)?;
    let members: Vec<String> = members.split(',').map(|m| m.trim().to_owned()).collect();
    if name.is_empty() || members.iter().any(String::is_empty) {
        return Err(wrong());
    }
    Ok(Group { name: name.to_owned(), members })
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

/// A lamp: its name, position, and its flux or the file of its photometry or both.
pub fn lamp(text: &str) -> Result<LampArg, String> {
    let wrong = || format!("'{text}' is no lamp; write it like desk=1,0.8,2,800 or desk=...,a.ies");
    let (name, rest) = text.split_once('=').ok_or_else(wrong)?;
    let parts: Vec<&str> = rest.splitn(4, ',').collect();
    let number = |text: &str| text.trim().parse::<f64>().ok();
    let [x, y, z, last] = parts[..] else { return Err(wrong()) };
    let place = [x, y, z].map(|part| number(part).filter(|n| n.is_finite()));
    let [Some(x), Some(y), Some(z)] = place else { return Err(wrong()) };
    let (first, rest) = last.split_once(',').map_or((last, None), |(a, b)| (a, Some(b)));
    let (flux, file) = match number(first) {
        Some(flux) => (Some(flux), rest),
        None => (None, Some(last)),
    };
    let file = file.map(PathBuf::from);
    let is_flux = |flux: f64| (0.0..MOST_RADIANCE).contains(&flux);
    if name.is_empty() || !flux.is_none_or(is_flux) || file.as_ref().is_some_and(|f| f == "") {
        return Err(wrong());
    }
    Ok(LampArg { name: name.to_owned(), position: DVec3::new(x, y, z), flux, file })
}

/// Azimuth and elevation in degrees, and perhaps an irradiance.
pub fn sun(text: &str) -> Result<SunArg, String> {
    /// Of clear sky at noon, lx.
    const USUAL: f64 = 1e5;
    let wrong = || {
        format!("'{text}' is no sun; write it like 135,40 or 135,40,80000, its elevation 0 to 90")
    };
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|n| n.trim().parse()).collect();
    let (azimuth, elevation, irradiance) = match numbers.as_deref() {
        Ok([azimuth, elevation]) => (*azimuth, *elevation, USUAL),
        Ok([azimuth, elevation, lux]) => (*azimuth, *elevation, *lux),
        _ => return Err(wrong()),
    };
    let valid = azimuth.is_finite()
        && (0.0..=90.0).contains(&elevation)
        && (0.0..MOST_RADIANCE).contains(&irradiance);
    if valid { Ok(SunArg { azimuth, elevation, irradiance }) } else { Err(wrong()) }
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

/// A camera's name, all, or orbit:N.
pub fn camera(text: &str) -> Result<CameraArg, String> {
    /// More views than this are a slip of the pen.
    const MOST: usize = 1000;
    if text == "all" {
        return Ok(CameraArg::All);
    }
    let Some(count) = text.strip_prefix("orbit:") else {
        return Ok(CameraArg::Named(text.into()));
    };
    match count.parse() {
        Ok(n) if (1..=MOST).contains(&n) => Ok(CameraArg::Orbit(n)),
        _ => Err(format!("'{count}' is not a number of views from 1 to {MOST}")),
    }
}

/// Two illuminances, the first the smaller.
pub fn range(text: &str) -> Result<[f64; 2], String> {
    let wrong = || format!("'{text}' is not a range; write it like 0,500");
    let (low, high) = text.split_once(',').ok_or_else(wrong)?;
    match (low.trim().parse::<f64>(), high.trim().parse::<f64>()) {
        (Ok(low), Ok(high)) if low >= 0.0 && low < high && high.is_finite() => Ok([low, high]),
        _ => Err(wrong()),
    }
}

/// A length in metres.
pub fn length(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(length) if length.is_finite() && length > 0.0 => Ok(length),
        _ => Err(format!("'{text}' is not a length in metres above 0")),
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

/// A number of threads; 0: one a core.
pub fn threads(text: &str) -> Result<usize, String> {
    /// More than any machine has cores, and few enough to be made.
    const MOST: usize = 1024;
    match text.parse() {
        Ok(n) if n <= MOST => Ok(n),
        _ => Err(format!("'{text}' is not a number of threads from 1 to {MOST}")),
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
