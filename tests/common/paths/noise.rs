//! Numbers that look random, and where they aim.

use std::f64::consts::TAU;

use glam::{DMat3, DVec2, DVec3};

/// Steele, Lea & Flood 2014, "Fast splittable pseudorandom number generators".
pub struct Noise(u64);

impl Noise {
    /// Others for each place and block.
    pub fn new(place: DVec3, block: u32) -> Self {
        let mut noise = Self(u64::from(block));
        for x in place.to_array() {
            noise.0 = noise.bits() ^ x.to_bits();
        }
        noise
    }

    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// In 0..1.
    pub fn next(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// In the unit square.
    pub fn square(&mut self) -> DVec2 {
        DVec2::new(self.next(), self.next())
    }

    /// In the `k`-th of n x n squares that the unit square is cut into.
    pub fn stratum(&mut self, k: usize, n: usize) -> DVec2 {
        (DVec2::new((k % n) as f64, (k / n) as f64) + self.square()) / n as f64
    }
}

/// A unit direction of density cos θ / π about a unit normal, if `u` is even in the unit square.
pub fn diffuse(normal: DVec3, u: DVec2) -> DVec3 {
    let (sin, cos) = (TAU * u.y).sin_cos();
    let (x, y) = normal.any_orthonormal_pair();
    let local = DVec3::new(u.x.sqrt() * cos, u.x.sqrt() * sin, (1.0 - u.x).sqrt());
    DMat3::from_cols(x, y, normal) * local
}
