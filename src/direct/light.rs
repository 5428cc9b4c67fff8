//! Direct irradiance, and what two halves of the shadow rays make of it.

use crate::scene::Rgb;

/// Direct irradiance of a receiver, W/m² or lx.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct DirectLight {
    /// The best estimate.
    pub irradiance: Rgb,
    /// What each of two independent halves of the shadow rays alone would give.
    pub halves: [Rgb; 2],
}

impl DirectLight {
    /// Its numbers, as ranks send them.
    pub(super) fn to_array(self) -> [[f64; 3]; 3] {
        [self.irradiance, self.halves[0], self.halves[1]].map(|v| v.to_array())
    }

    /// Light of these numbers.
    pub(super) fn from_array(numbers: [[f64; 3]; 3]) -> Self {
        let [irradiance, first, second] = numbers.map(Rgb::from_array);
        Self { irradiance, halves: [first, second] }
    }
}

impl From<Rgb> for DirectLight {
    /// Light that is known without shadow rays.
    fn from(irradiance: Rgb) -> Self {
        Self { irradiance, halves: [irradiance; 2] }
    }
}

impl std::ops::AddAssign<Rgb> for DirectLight {
    /// Adds light that is known without shadow rays.
    fn add_assign(&mut self, more: Rgb) {
        self.irradiance += more;
        self.halves.iter_mut().for_each(|h| *h += more);
    }
}
