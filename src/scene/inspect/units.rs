//! The unit that a model was probably made in.

use glam::DVec3;

use crate::scene::geometry::Geometry;
use crate::scene::{Finding, Setting, Severity};

/// Largest plausible extent in metres of what one lights: a large building.
const LARGE: f64 = 100.0;

/// From here on millimetres are the most likely unit.
const VERY_LARGE: f64 = 1000.0;

/// Smallest plausible extent in metres.
const SMALL: f64 = 0.1;

/// Doubts about the scale of a model, from its bounds.
pub fn doubt(g: &Geometry) -> Option<Finding> {
    let (low, high) = g.bounds()?;
    let size = high - low;
    let longest = size.max_element();
    let (question, likely): (_, &[&str]) = if longest >= VERY_LARGE {
        ("millimetres?", &["mm"])
    } else if longest >= LARGE {
        ("centimetres, millimetres or inches?", &["cm", "mm", "in"])
    } else if longest < SMALL {
        ("is it in another unit?", &[])
    } else {
        return None;
    };
    let message = format!("it measures {}: {question}", metres(size));
    if likely.is_empty() {
        let remedy = "scale it when exporting, in metres";
        return Some(Finding::new(Severity::Warning, "model", message, remedy));
    }
    let read_as =
        likely.iter().map(|unit| format!("in {unit} it is {}", metres(size * length(unit))));
    let remedy = read_as.collect::<Vec<_>>().join(", ");
    let found = Finding::new(Severity::Warning, "model", message, remedy);
    Some(found.settled_by(Setting::Unit(likely)))
}

/// A unit in metres.
fn length(symbol: &str) -> f64 {
    match symbol {
        "mm" => 1e-3,
        "cm" => 1e-2,
        "in" => 0.0254,
        _ => 1.0,
    }
}

/// `5,200 x 2,700 x 3,100 m`.
fn metres(size: DVec3) -> String {
    let [x, y, z] = size.to_array().map(grouped);
    format!("{x} x {y} x {z} m")
}

/// Three significant digits, thousands apart.
fn grouped(v: f64) -> String {
    if !v.is_finite() || v >= 1e12 {
        return format!("{v:.2e}");
    }
    if v < 100.0 {
        let places = if v <= 0.0 { 0 } else { (2 - v.log10().floor() as i32).clamp(0, 9) };
        let text = format!("{v:.*}", places as usize);
        return if text.contains('.') {
            text.trim_end_matches('0').trim_end_matches('.').into()
        } else {
            text
        };
    }
    let digits = format!("{v:.0}");
    let mut out = String::new();
    for (i, c) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            out.push(',');
        }
        out.push(c);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_read_well() {
        assert_eq!(metres(DVec3::new(5200.0, 2700.4, 3_100_000.0)), "5,200 x 2,700 x 3,100,000 m");
        assert_eq!(metres(DVec3::new(5.2, 0.0, 0.001_234)), "5.2 x 0 x 0.00123 m");
    }
}
