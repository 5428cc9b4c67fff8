//! What to do about a scene that nothing lights: flags that do.

use glam::DVec3;
use hemicube::scene::{Scene, Side, TriangleId};
use hemicube::staging::{Kind, Model, Pendant};
use hemicube::units::significant;

use crate::args::{Look, StageArg};
use crate::failure::Failure;
use crate::input::{material_names, nothing_to_see};

/// Below this share of fronts around it a room is turned outside in.
const TURNED: f64 = 0.1;

/// Below this share of sides that reflect one sees little else but backs.
const BACKS: f64 = 0.5;

/// What to do about a closed room without light, with all flags that it takes to see it lit.
pub fn closed(scene: &Scene, args: &Look, eye: DVec3) -> Failure {
    let Some(model) = Model::of(scene) else { return nothing_to_see(scene) };
    let lamp = model.pendant(eye);
    let turn = match (lamp.lit < BACKS, lamp.fronts < TURNED) {
        (false, _) => None,
        (true, true) => Some("--flip"),
        (true, false) => Some("--sides two"),
    };
    let why = match turn {
        None => "it would be dark",
        Some(_) => "it would be dark, and as its faces look outwards, one would see backs",
    };
    let within = args.eye.is_some() && args.kind.is_none() && model.kind() == Kind::Object;
    let without = match (turn, args.stage) {
        _ if within => "the eye is in a body: leave --eye and --target out, or ".to_owned(),
        (None, StageArg::Off) => "leave --stage off out, or ".to_owned(),
        (Some(turn), StageArg::Off) => format!("use {turn} instead of --stage off, or "),
        _ => String::new(),
    };
    let turn = turn.map(|turn| format!("{turn} ")).unwrap_or_default();
    let mut text = format!(
        "{}: nothing emits light and the room is closed: {why}; {without}hang a lamp, for \
         example by {turn}{}",
        scene.name,
        lamp_flag(&lamp, model.size())
    );
    let downwards = if turn == "--flip " { Side::Back } else { Side::Front };
    let above = lamp.above.filter(|above| above.1 == downwards);
    let of = |t: TriangleId| scene.optics.material_of[t.index()];
    let some = |t: TriangleId| scene.optics.material_of.iter().any(|&m| m != of(t));
    if let Some((ceiling, _)) = above.filter(|above| some(above.0)) {
        text += &format!(
            ", or let a material emit, for example by {turn}--emission \"{}=10,10,10\"; the \
             materials are {}",
            scene.optics.material(ceiling).name,
            material_names(scene)
        );
    }
    Failure::Input(text)
}

/// The flag that hangs a lamp in sight of an eye.
pub fn lamp_before(scene: &Scene, eye: DVec3) -> String {
    let model = Model::of(scene);
    model.map_or_else(String::new, |model| lamp_flag(&model.pendant(eye), model.size()))
}

/// The flag that hangs a lamp in a scene of that size.
pub fn lamp_flag(lamp: &Pendant, size: f64) -> String {
    let unit = 10_f64.powf(lamp.flux.log10().floor());
    let flux = (lamp.flux / unit).round() * unit;
    format!("--lamp lamp={},{}", coordinates(lamp.position, size), significant(flux))
}

/// A position in a scene of that size, to four digits of it.
pub fn coordinates(v: DVec3, size: f64) -> String {
    let places = (4 - size.max(1e-12).log10().floor() as i32).clamp(0, 15) as usize;
    let digits = v.to_array().map(|x| {
        let text = format!("{x:.places$}");
        let text = if text.contains('.') {
            text.trim_end_matches('0').trim_end_matches('.')
        } else {
            &text
        };
        if text == "-0" { "0".to_owned() } else { text.to_owned() }
    });
    digits.join(",")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coordinates_have_digits_of_the_scene() {
        assert_eq!(coordinates(DVec3::new(-1e-9, 1.25, 100.0), 3.0), "0,1.25,100");
        assert_eq!(coordinates(DVec3::new(1.234_56e-3, 0.0, -2e-3), 1e-3), "0.0012346,0,-0.002");
        assert_eq!(coordinates(DVec3::new(12_345.6, 20.0, -3000.0), 9e3), "12345.6,20,-3000");
    }
}
