//! Photometry of type B, that of floodlights, turned into type C.
//!
//! Planes turn about a horizontal axis: V says which, positive upwards, and H goes along it,
//! positive to the right, from the direction of aim (ANSI/IESNA LM-63-2002):
//!
//! ```text
//! d = cos H (cos V aim + sin V up) + sin H right
//! ```
//!
//! The aim is γ = 0, right lies in plane C0 and up in plane C90.

/// Luminous intensity measured at angles V and H.
pub(super) struct TypeB {
    /// Angles V in degrees, ascending, from 0 (then alike below) or less.
    pub vertical: Vec<f64>,
    /// Angles H in degrees, ascending, from 0 (then alike to the left) or less.
    pub horizontal: Vec<f64>,
    /// Intensity in cd: for each H all V.
    pub candela: Vec<f64>,
}

/// Steps of C, in degrees.
const C_STEP: u32 = 3;

/// Finest and coarsest steps of γ, in degrees: as the file's, within these.
const GAMMA_STEPS: [f64; 2] = [0.25, 5.0];

impl TypeB {
    /// Angles γ and C, and the intensity at all of them: for each C all γ.
    pub fn as_type_c(&self) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
        let gaps = [&self.vertical, &self.horizontal].into_iter().flat_map(|a| a.windows(2));
        let finest = gaps.map(|w| w[1] - w[0]).fold(f64::INFINITY, f64::min);
        let steps = (90.0 / finest.clamp(GAMMA_STEPS[0], GAMMA_STEPS[1])).ceil() as u32;
        let gamma: Vec<f64> = (0..=steps).map(|k| 90.0 * f64::from(k) / f64::from(steps)).collect();
        let c: Vec<f64> = (0..=360).step_by(C_STEP as usize).map(f64::from).collect();
        let at = |&c: &f64| gamma.iter().map(move |&gamma| self.towards(c, gamma));
        let candela = c.iter().flat_map(at).collect();
        (gamma.clone(), c, candela)
    }

    /// Intensity at angles C and γ in degrees.
    fn towards(&self, c: f64, gamma: f64) -> f64 {
        let ((sin_c, cos_c), (sin, cos)) = (c.to_radians().sin_cos(), gamma.to_radians().sin_cos());
        let [aim, right, up] = [cos, sin * cos_c, sin * sin_c];
        let h = right.clamp(-1.0, 1.0).asin().to_degrees();
        let v = up.atan2(aim).to_degrees();
        let found = place(&self.horizontal, h).zip(place(&self.vertical, v));
        let Some(((i, s), (j, t))) = found else { return 0.0 };
        let (rows, n) = (self.horizontal.len(), self.vertical.len());
        let value = |i: usize, j: usize| self.candela[i.min(rows - 1) * n + j.min(n - 1)];
        let along = |i: usize| value(i, j) * (1.0 - t) + value(i, j + 1) * t;
        along(i) * (1.0 - s) + along(i + 1) * s
    }
}

/// Which of ascending angles is the last that is not above `angle`, and how far it is on the way to
/// the next; `None` beyond what was measured.
fn place(angles: &[f64], angle: f64) -> Option<(usize, f64)> {
    /// Rounding of the way there and back, in degrees.
    const ROUNDING: f64 = 1e-9;
    let (first, last) = (*angles.first()?, *angles.last()?);
    let angle = if first == 0.0 { angle.abs() } else { angle };
    if angle < first - ROUNDING || angle > last + ROUNDING {
        return None;
    }
    let low = angles.partition_point(|&a| a <= angle).saturating_sub(1);
    let share = angles
        .get(low + 1)
        .map_or(0.0, |next| ((angle - angles[low]) / (next - angles[low])).clamp(0.0, 1.0));
    Some((low, share))
}
