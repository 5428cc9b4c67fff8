//! Photometry of type A, that of headlights and signals, turned into type C.
//!
//! Planes are vertical, as those of type C, but H counts them clockwise seen from above, and V is
//! the elevation above the horizon (ANSI/IESNA LM-63-2002):
//!
//! ```text
//! γ = V + 90°        C = -H
//! ```
//!
//! So the aim (H = V = 0) is level and lies in plane C0.

/// Luminous intensity measured at angles V and H.
pub(super) struct TypeA {
    /// Angles V in degrees, ascending, from 0 (then alike below) or less.
    pub vertical: Vec<f64>,
    /// Angles H in degrees, ascending, from 0 (then alike to the left) or less.
    pub horizontal: Vec<f64>,
    /// Intensity in cd: for each H all V.
    pub candela: Vec<f64>,
}

/// What was not measured is dark from this many degrees beyond.
const EDGE: f64 = 1e-3;

impl TypeA {
    /// Angles γ and C, and the intensity at all of them: for each C all γ.
    pub fn as_type_c(&self) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
        let rows: Vec<&[f64]> = self.candela.chunks(self.vertical.len()).collect();
        let vertical = unfolded(&self.vertical);
        // Each H with its row, from straight ahead to the right and from the left to there.
        let planes = unfolded(&self.horizontal);
        let (first, last) = (planes[0].0, planes[planes.len() - 1].0);
        let row = |at: usize| -> Vec<f64> { vertical.iter().map(|v| rows[at][v.1]).collect() };
        let dark = || vec![0.0; vertical.len()];
        let ahead = planes.partition_point(|p| p.0 < 0.0);
        let mut c: Vec<(f64, Vec<f64>)> = Vec::new();
        if planes[ahead].0 > 0.0 {
            c.push((0.0, between(planes[ahead - 1], planes[ahead], &row)));
        }
        let left = planes[..ahead + usize::from(planes[ahead].0 == 0.0)].iter().rev();
        c.extend(left.map(|&(h, at)| (-h + 0.0, row(at))));
        c.push((-first + EDGE, dark()));
        c.push((360.0 - last - EDGE, dark()));
        let right = planes[ahead..].iter().rev();
        c.extend(right.map(|&(h, at)| (360.0 - h, row(at))));
        if planes[ahead].0 > 0.0 {
            c.push((360.0, c[0].1.clone()));
        }
        let gamma = vertical.iter().map(|v| v.0 + 90.0).collect();
        let (c, candela): (Vec<f64>, Vec<Vec<f64>>) = c.into_iter().unzip();
        (gamma, c, candela.concat())
    }
}

/// Angles with their index; those from 0 on stand for the negative ones, too.
fn unfolded(angles: &[f64]) -> Vec<(f64, usize)> {
    let own = angles.iter().copied().zip(0..);
    let mirrored = own.clone().filter(|a| angles[0] == 0.0 && a.0 > 0.0).map(|(a, i)| (-a, i));
    let mut all: Vec<(f64, usize)> = mirrored.chain(own).collect();
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    all
}

/// The row straight ahead, between those of two planes.
fn between(
    (a, from): (f64, usize),
    (b, to): (f64, usize),
    row: &impl Fn(usize) -> Vec<f64>,
) -> Vec<f64> {
    let t = -a / (b - a);
    row(from).iter().zip(row(to)).map(|(x, y)| x * (1.0 - t) + y * t).collect()
}
