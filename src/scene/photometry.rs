//! How the intensity of a luminaire depends on direction: type C photometry.
//!
//! Half-planes C through the luminaire's axis are counted in degrees from plane C0,
//! counter-clockwise seen from above; angles γ in each of them from straight down (0°, the nadir)
//! to straight up (180°) (CIE 121-1996; ANSI/IESNA LM-63-2002).

use std::f64::consts::PI;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::optics::MOST_RADIANCE;

/// Luminous intensity in all directions, measured at angles C and γ and bilinear between them. What
/// lies beyond the measured γ is dark.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Photometry {
    /// Angles γ in degrees, ascending: from 0 or 90 to 90 or 180, or those that were measured of a
    /// luminaire that is aimed.
    pub(super) vertical: Vec<f64>,
    /// Angles C in degrees, ascending: 0 alone, 0 to 90, 180 or 360, or 90 to 270. The rest follows
    /// by symmetry.
    pub(super) horizontal: Vec<f64>,
    /// Intensity in cd, not negative: for each C all γ.
    pub(super) candela: Vec<f64>,
    /// Luminous flux of the bare lamps in lm; `None` in absolute photometry.
    pub(super) rated: Option<f64>,
    /// Longest edge of the luminous opening in m; 0 for a point.
    pub(super) opening: f64,
}

impl Photometry {
    /// Luminous intensity (cd) at angles C and γ (degrees).
    #[must_use]
    pub fn intensity(&self, c: f64, gamma: f64) -> f64 {
        let n = self.vertical.len();
        if gamma < self.vertical[0] || gamma > self.vertical[n - 1] {
            return 0.0;
        }
        let (v, s) = between(&self.vertical, gamma);
        let (h, t) = between(&self.horizontal, self.measured(c));
        let at = |h: usize| {
            let row = &self.candela[h * n..(h + 1) * n];
            row[v] + (row[(v + 1).min(n - 1)] - row[v]) * s
        };
        let next = (h + 1).min(self.horizontal.len() - 1);
        at(h) + (at(next) - at(h)) * t
    }

    /// Luminous intensity (cd) in a unit direction, away from a luminaire that hangs as `axes` say.
    #[must_use]
    pub fn towards(&self, axes: &Axes, direction: DVec3) -> f64 {
        let gamma = direction.dot(axes.nadir).clamp(-1.0, 1.0).acos();
        let c = direction.dot(axes.c90).atan2(direction.dot(axes.c0));
        self.intensity(c.to_degrees(), gamma.to_degrees())
    }

    /// Luminous flux (lm) that leaves the luminaire: the integral of the intensity over all
    /// directions,
    ///
    /// ```text
    /// Φ = ∫ dC ∫ I sin γ dγ        exact for what is linear between the measured angles
    /// ```
    ///
    /// In relative photometry it is the flux of the bare lamps times the luminaire's efficiency.
    #[must_use]
    pub fn flux(&self) -> f64 {
        let zones: Vec<f64> = self
            .candela
            .chunks(self.vertical.len())
            .map(|row| zonal(&self.vertical, row))
            .collect();
        let (angles, last) = (&self.horizontal, self.horizontal.len() - 1);
        if last == 0 {
            return 2.0 * PI * zones[0];
        }
        let sum: f64 =
            (0..last).map(|h| 0.5 * (zones[h] + zones[h + 1]) * (angles[h + 1] - angles[h])).sum();
        2.0 * PI * sum / (angles[last] - angles[0])
    }

    /// Luminous flux of the bare lamps in lm; `None` in absolute photometry.
    #[must_use]
    pub fn rated_flux(&self) -> Option<f64> {
        self.rated
    }

    /// Longest edge of the luminous opening in m; 0 for a point. It is for information: all light
    /// comes from one point.
    #[must_use]
    pub fn opening(&self) -> f64 {
        self.opening
    }

    /// Whether it could have been measured: angles ascend, and there is an intensity for each.
    pub(crate) fn is_sound(&self) -> bool {
        let [v, h] = [&self.vertical, &self.horizontal];
        let ascend = |a: &[f64], most: f64| {
            let within = a.iter().all(|x| (0.0..=most).contains(x));
            !a.is_empty() && within && a.is_sorted_by(|a, b| a < b)
        };
        let strong = |i: &f64| (0.0..=MOST_RADIANCE).contains(i);
        ascend(v, 180.0)
            && ascend(h, 360.0)
            && self.candela.len() == v.len() * h.len()
            && self.candela.iter().all(strong)
    }

    /// The measured angle that C has the intensity of by symmetry: about one plane if half of all
    /// angles are measured, about two at right angles if a quarter is.
    fn measured(&self, c: f64) -> f64 {
        let first = self.horizontal[0];
        let span = self.horizontal[self.horizontal.len() - 1] - first;
        let mut from_first = (c - first).rem_euclid(360.0);
        if span <= 180.0 && from_first > 180.0 {
            from_first = 360.0 - from_first;
        }
        if span <= 90.0 && from_first > 90.0 {
            from_first = 180.0 - from_first;
        }
        first + from_first
    }
}

/// Between which of ascending angles another one lies: the index of the lower, and how far it is on
/// the way to the next, 0..1.
fn between(angles: &[f64], angle: f64) -> (usize, f64) {
    let above = angles.partition_point(|&a| a <= angle);
    match (above.checked_sub(1), angles.get(above)) {
        (Some(low), Some(high)) => (low, (angle - angles[low]) / (high - angles[low])),
        (Some(low), None) => (low, 0.0),
        (None, _) => (0, 0.0),
    }
}

/// ∫ I sin γ dγ for an intensity that is linear between the angles (degrees).
fn zonal(angles: &[f64], intensity: &[f64]) -> f64 {
    angles
        .windows(2)
        .zip(intensity.windows(2))
        .map(|(angle, i)| {
            let (from, to) = (angle[0].to_radians(), angle[1].to_radians());
            let slope = (i[1] - i[0]) / (to - from);
            i[0] * from.cos() - i[1] * to.cos() + slope * (to.sin() - from.sin())
        })
        .sum()
}

/// How a luminaire hangs: unit vectors at right angles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Axes {
    nadir: DVec3,
    c0: DVec3,
    c90: DVec3,
}

/// Directions nearer than this (sine) to the nadir do not say where C0 is.
const ALIGNED: f64 = 1e-3;

impl Axes {
    /// A luminaire whose γ = 0 is the unit direction `nadir`, and whose plane C0 contains `along`;
    /// if that is parallel to the nadir or zero, the x axis, or else the z axis.
    #[must_use]
    pub fn new(nadir: DVec3, along: DVec3) -> Self {
        let across = |v: DVec3| v - nadir * v.dot(nadir);
        let c0 = [along, DVec3::X]
            .into_iter()
            .map(|v| across(v.normalize_or_zero()))
            .find(|v| v.length() > ALIGNED)
            .unwrap_or_else(|| across(DVec3::Z))
            .normalize_or_zero();
        Self { nadir, c0, c90: c0.cross(nadir) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn photometry(horizontal: &[f64], vertical: &[f64], i: impl Fn(f64, f64) -> f64) -> Photometry {
        let candela = horizontal.iter().flat_map(|&c| vertical.iter().map(move |&v| (c, v)));
        Photometry {
            vertical: vertical.to_vec(),
            horizontal: horizontal.to_vec(),
            candela: candela.map(|(c, v)| i(c, v)).collect(),
            rated: None,
            opening: 0.0,
        }
    }

    fn steps(from: u32, to: u32, step: u32) -> Vec<f64> {
        (from..=to).step_by(step as usize).map(f64::from).collect()
    }

    #[test]
    fn flux_is_the_integral_of_the_intensity() {
        let cases: [(f64, f64, Photometry); 4] = [
            (4.0 * PI * 7.0, 1e-12, photometry(&[0.0], &steps(0, 180, 90), |_, _| 7.0)),
            (PI * 100.0, 1e-4, {
                photometry(&[0.0], &steps(0, 90, 1), |_, v| 100.0 * v.to_radians().cos())
            }),
            (2.0 * PI * 5.0, 1e-12, photometry(&[0.0, 90.0], &steps(90, 180, 45), |_, _| 5.0)),
            // The mean over C of 1 + cos C is 1.
            (PI * 100.0, 1e-3, {
                photometry(&steps(0, 180, 5), &steps(0, 90, 2), |c, v| {
                    100.0 * v.to_radians().cos() * (1.0 + c.to_radians().cos())
                })
            }),
        ];
        for (exact, tolerance, photometry) in cases {
            let flux = photometry.flux();
            assert!((flux / exact - 1.0).abs() < tolerance, "{flux} {exact}");
        }
    }

    #[test]
    fn angles_that_were_not_measured_follow_by_symmetry() {
        let ranges = [
            (&[0.0][..], [(0.0, 0.0), (77.0, 0.0), (200.0, 0.0), (-5.0, 0.0)]),
            (&[0.0, 45.0, 90.0][..], [(100.0, 80.0), (200.0, 20.0), (350.0, 10.0), (-30.0, 30.0)]),
            (
                &[0.0, 90.0, 180.0][..],
                [(100.0, 100.0), (200.0, 160.0), (350.0, 10.0), (180.0, 180.0)],
            ),
            (
                &[90.0, 180.0, 270.0][..],
                [(100.0, 100.0), (80.0, 100.0), (350.0, 190.0), (0.0, 180.0)],
            ),
            (
                &[0.0, 180.0, 360.0][..],
                [(100.0, 100.0), (200.0, 200.0), (350.0, 350.0), (-90.0, 270.0)],
            ),
        ];
        for (horizontal, cases) in ranges {
            // Linear in C and γ: interpolation is exact.
            let p = photometry(horizontal, &[0.0, 90.0], |c, v| c + 0.1 * v);
            for (c, same) in cases {
                for gamma in [0.0, 13.0, 90.0] {
                    let got = p.intensity(c, gamma);
                    assert!((got - same - 0.1 * gamma).abs() < 1e-9, "{horizontal:?} {c}: {got}");
                }
            }
            assert_eq!(p.intensity(0.0, 90.1), 0.0, "above what was measured");
        }
    }

    #[test]
    fn planes_are_counted_counter_clockwise_seen_from_above() {
        let p = photometry(&[0.0, 90.0, 180.0, 270.0, 360.0], &[0.0, 180.0], |c, _| c % 360.0);
        let axes = Axes::new(DVec3::NEG_Z, DVec3::X);
        let diagonal = (DVec3::X + DVec3::Y + DVec3::Z).normalize();
        for (direction, c) in
            [(DVec3::X, 0.0), (DVec3::Y, 90.0), (DVec3::NEG_X, 180.0), (diagonal, 45.0)]
        {
            assert!((p.towards(&axes, direction) - c).abs() < 1e-9, "{direction}");
        }
        // With y upwards north is -z.
        let axes = Axes::new(DVec3::NEG_Y, DVec3::X);
        assert!((p.towards(&axes, DVec3::NEG_Z) - 90.0).abs() < 1e-9);
    }

    #[test]
    fn axes_are_found_whatever_the_lamp_says() {
        for nadir in [DVec3::NEG_Y, DVec3::X, DVec3::new(0.6, 0.0, -0.8)] {
            for along in [DVec3::X, nadir, DVec3::ZERO, DVec3::new(0.0, 3.0, 4.0)] {
                let Axes { nadir, c0, c90 } = Axes::new(nadir, along);
                let turn = glam::DMat3::from_cols(c0, c90, -nadir);
                assert!((turn.determinant() - 1.0).abs() < 1e-9, "{nadir} {along}");
                assert!(c0.dot(nadir).abs() < 1e-9 && c0.is_normalized());
            }
        }
    }
}
