//! Form factors by brute force: slow, plain, and without a line of the engines' code.
//!
//! `Tracer` meets rays and triangles in double precision. `pair` finds what two triangles exchange
//! by sampling both of them as the kernel weighs them; `row` finds a whole row by rays of density
//! cos θ / π. Both tell their standard error.

mod pair;
mod tracer;

pub use pair::{Pair, pair};
pub use tracer::{Hit, Tracer};

use super::random::Random;

/// What `rays` rays from one triangle's front end on.
pub struct Seen {
    /// Rays that end on the front of each triangle.
    pub fronts: Vec<u32>,
    /// Rays that end on backs.
    pub backs: u32,
    /// Rays that escape.
    pub escaped: u32,
}

/// Whence `rays` diffuse rays from the front of triangle `i` go.
pub fn row(tracer: &Tracer, i: usize, rays: u32, random: &mut Random) -> Seen {
    let mut seen = Seen { fronts: vec![0; tracer.len()], backs: 0, escaped: 0 };
    for _ in 0..rays {
        let from = tracer.point(i, random.number(), random.number());
        let direction = random.diffuse(tracer.normal(i));
        match tracer.first(from, direction, i) {
            Some(Hit { triangle, front: true }) => seen.fronts[triangle] += 1,
            Some(_) => seen.backs += 1,
            None => seen.escaped += 1,
        }
    }
    seen
}
