//! Numbers that look random, and what is drawn from them. Nothing here is the engine's.

use std::f64::consts::{PI, TAU};

use glam::{DMat3, DQuat, DVec3};

/// A sequence of numbers from a seed (Steele, Lea & Flood 2014, "Fast splittable pseudorandom
/// number generators").
#[derive(Debug, Clone)]
pub struct Random(u64);

impl Random {
    pub fn new(seed: u64) -> Self {
        let mut me = Self(seed ^ 0x6a09_e667_f3bc_c908);
        me.bits();
        me
    }

    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform in 0..1.
    pub fn number(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Uniform between two numbers.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.number()
    }

    /// Uniform in 0..n.
    pub fn below(&mut self, n: usize) -> usize {
        ((self.number() * n as f64) as usize).min(n - 1)
    }

    /// Uniform in a box.
    pub fn inside(&mut self, low: DVec3, high: DVec3) -> DVec3 {
        DVec3::new(
            self.between(low.x, high.x),
            self.between(low.y, high.y),
            self.between(low.z, high.z),
        )
    }

    /// A rotation; none is likelier than another (Shoemake 1992, "Uniform random rotations").
    pub fn rotation(&mut self) -> DMat3 {
        let u = self.number();
        let (s, c) = (TAU * self.number()).sin_cos();
        let (t, d) = (TAU * self.number()).sin_cos();
        let (a, b) = ((1.0 - u).sqrt(), u.sqrt());
        DMat3::from_quat(DQuat::from_xyzw(a * s, a * c, b * t, b * d).normalize())
    }

    /// A unit direction of density cos θ / π about a unit normal.
    pub fn diffuse(&mut self, normal: DVec3) -> DVec3 {
        let (u, (sin, cos)) = (self.number(), (2.0 * PI * self.number()).sin_cos());
        let (x, y) = normal.any_orthonormal_pair();
        x * (u.sqrt() * cos) + y * (u.sqrt() * sin) + normal * (1.0 - u).sqrt()
    }
}

/// Points that fill the unit cube of four dimensions evenly, shifted at random: point k is
/// (shift + k α) modulo 1 with α_d = φ^-d, φ⁵ = φ + 1 (Roberts 2018, "The unreasonable
/// effectiveness of quasirandom sequences").
#[derive(Debug, Clone)]
pub struct Even {
    at: [f64; 4],
    step: [f64; 4],
}

impl Even {
    /// A sequence of another shift.
    pub fn new(random: &mut Random) -> Self {
        const PHI: f64 = 1.167_303_978_261_418_7;
        let mut step = [1.0; 4];
        let mut power = 1.0;
        for s in &mut step {
            power /= PHI;
            *s = power;
        }
        Self { at: std::array::from_fn(|_| random.number()), step }
    }

    /// The next point.
    pub fn point(&mut self) -> [f64; 4] {
        for (at, step) in self.at.iter_mut().zip(self.step) {
            *at = (*at + step).fract();
        }
        self.at
    }
}
