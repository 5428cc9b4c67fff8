//! Packets of rays, and what they meet.

use glam::Vec3;

use crate::simd::LANES;
use crate::visibility::NOTHING;

/// One number for each ray of a packet.
pub type Lanes = [f32; LANES];

/// Rays that are traced together, the faster the more alike they are.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(align(64))]
pub struct Packet {
    /// Where rays begin, in coordinates of [`Bvh::local`](super::Bvh::local); within the scene or
    /// some radii of it ([`Bvh::approach`](super::Bvh::approach)).
    pub origin: [Lanes; 3],
    /// Where they go; of any length that is a normal number.
    pub direction: [Lanes; 3],
    /// Where they end, in units of the direction; may be infinite. There is no ray where it is not
    /// positive.
    pub far: Lanes,
    /// The solid triangle that a ray begins on and does not meet; [`NOTHING`] for none.
    pub own: [u32; LANES],
}

impl Packet {
    /// No ray at all.
    pub const EMPTY: Self = Self {
        origin: [[0.0; LANES]; 3],
        direction: [[0.0; LANES]; 3],
        far: [0.0; LANES],
        own: [NOTHING; LANES],
    };

    /// Puts a ray into a lane.
    pub fn set(&mut self, lane: usize, origin: Vec3, direction: Vec3, far: f32, own: Option<u32>) {
        for axis in 0..3 {
            self.origin[axis][lane] = origin[axis];
            self.direction[axis][lane] = direction[axis];
        }
        self.far[lane] = far;
        self.own[lane] = own.unwrap_or(NOTHING);
    }
}

/// What the rays of a packet meet.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(align(64))]
pub struct Hits {
    /// Twice the index of the solid triangle, plus 1 if its back is met; [`NOTHING`] for none.
    pub item: [u32; LANES],
    /// Barycentric coordinate of the triangle's corner b.
    pub u: Lanes,
    /// Barycentric coordinate of the triangle's corner c.
    pub v: Lanes,
    /// Distance in units of the direction; infinite for none.
    pub distance: Lanes,
}

impl Hits {
    /// Nothing met by any ray.
    pub const NONE: Self = Self {
        item: [NOTHING; LANES],
        u: [0.0; LANES],
        v: [0.0; LANES],
        distance: [f32::INFINITY; LANES],
    };
}
