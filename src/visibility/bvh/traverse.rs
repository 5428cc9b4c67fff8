//! Packets through the hierarchy: one box against 16 rays.

#![allow(clippy::needless_range_loop, reason = "loops over lanes, which become vectors")]

use super::hierarchy::Hierarchy;
use super::node::{DEEPEST, INNER, Node};
use super::packet::{Hits, Lanes, Packet};
use super::rays::{Rays, max, min};
use crate::simd::{LANES, multiversion};
use crate::visibility::NOTHING;

multiversion! {
    pub(super) fn closest(boxes: &Hierarchy, packets: &[Packet], hits: &mut [Hits]) = closest_kernel
}

multiversion! {
    pub(super) fn blocked(boxes: &Hierarchy, packets: &[Packet], blocked: &mut [u16])
        = blocked_kernel
}

#[inline(always)]
fn closest_kernel(boxes: &Hierarchy, packets: &[Packet], hits: &mut [Hits]) {
    let mut later = Later::EMPTY;
    for (packet, hits) in packets.iter().zip(hits) {
        *hits = Hits::NONE;
        let mut left = packet.lanes();
        while let Some(mut rays) = Rays::alike(packet, &mut left) {
            if rays.mixed {
                rays.trace::<true, false>(boxes, &mut later);
            } else {
                rays.trace::<false, false>(boxes, &mut later);
            }
            rays.write(hits);
        }
    }
}

#[inline(always)]
fn blocked_kernel(boxes: &Hierarchy, packets: &[Packet], blocked: &mut [u16]) {
    let mut later = Later::EMPTY;
    for (packet, blocked) in packets.iter().zip(blocked) {
        *blocked = 0;
        let mut left = packet.lanes();
        while let Some(mut rays) = Rays::alike(packet, &mut left) {
            if rays.mixed {
                rays.trace::<true, true>(boxes, &mut later);
            } else {
                rays.trace::<false, true>(boxes, &mut later);
            }
            for l in 0..LANES {
                *blocked |= u16::from(rays.item[l] != NOTHING) << l;
            }
        }
    }
}

/// At each level below the root at most one node waits; a power of two spares checks of indices.
const STACK: usize = DEEPEST.next_power_of_two();

/// Nodes still to be visited, and where rays enter them; reused from packet to packet.
#[repr(align(64))]
struct Later {
    from: [Lanes; STACK],
    node: [u32; STACK],
}

impl Later {
    const EMPTY: Self = Self { from: [[0.0; LANES]; STACK], node: [0; STACK] };
}

impl Rays {
    /// Visits the boxes that rays enter before their best hit. Both children are tested at once:
    /// the second test then costs little, as it need not wait for the first to be decided.
    #[inline(always)]
    fn trace<const MIXED: bool, const ANY: bool>(&mut self, boxes: &Hierarchy, later: &mut Later) {
        let mut at = 0;
        let mut top = 0;
        loop {
            let node = &boxes.nodes[at as usize];
            if node.kind() >= INNER {
                let backwards = self.backwards >> (node.kind() & 3) & 1;
                let (near, far) = (node.first() + backwards, node.first() + 1 - backwards);
                let mut from = [0.0; LANES];
                let enters_near = self.enters::<MIXED>(&boxes.nodes[near as usize], &mut from);
                let put = top % STACK;
                let from = &mut later.from[put];
                let enters_far = self.enters::<MIXED>(&boxes.nodes[far as usize], from);
                if enters_near {
                    later.node[put] = far;
                    top += usize::from(enters_far);
                    at = near;
                    continue;
                }
                if enters_far {
                    at = far;
                    continue;
                }
            } else {
                let first = node.first() as usize;
                for triangle in &boxes.triangles[first..first + node.kind() as usize] {
                    self.test::<ANY>(boxes, triangle);
                }
                if ANY && self.best.iter().all(|&b| b == f32::NEG_INFINITY) {
                    return;
                }
            }
            loop {
                if top == 0 {
                    return;
                }
                top -= 1;
                if self.reaches(&later.from[top % STACK]) {
                    break;
                }
            }
            at = later.node[top % STACK];
        }
    }

    /// Whether any ray gets as far as `from` without a hit.
    #[inline(always)]
    fn reaches(&self, from: &Lanes) -> bool {
        let mut any = 0_u32;
        for l in 0..LANES {
            any |= u32::from(from[l] <= self.best[l]);
        }
        any != 0
    }

    /// Whether any ray enters the box before its best hit; and where, or NaN if it does not.
    #[inline(always)]
    fn enters<const MIXED: bool>(&self, node: &Node, entry: &mut Lanes) -> bool {
        let plane = |i: usize| node.0[i % 8];
        let [ex, ey, ez] = self.enter;
        let (ex, ey, ez) = (plane(ex), plane(ey), plane(ez));
        let [lx, ly, lz] = self.leave;
        let (lx, ly, lz) = (plane(lx), plane(ly), plane(lz));
        let ([ix, iy, iz], [ox, oy, oz]) = (&self.inverse, &self.offset);
        let mut any = 0_u32;
        for l in 0..LANES {
            let (x0, x1) = (ex * ix[l] - ox[l], lx * ix[l] - ox[l]);
            let (y0, y1) = (ey * iy[l] - oy[l], ly * iy[l] - oy[l]);
            let (z0, z1) = (ez * iz[l] - oz[l], lz * iz[l] - oz[l]);
            let (x0, x1) = if MIXED { (min(x0, x1), max(x0, x1)) } else { (x0, x1) };
            let (y0, y1) = if MIXED { (min(y0, y1), max(y0, y1)) } else { (y0, y1) };
            let (z0, z1) = if MIXED { (min(z0, z1), max(z0, z1)) } else { (z0, z1) };
            let from = max(max(x0, y0), max(z0, 0.0));
            let to = min(min(x1, y1), min(z1, self.best[l]));
            entry[l] = if from <= to { from } else { f32::NAN };
            any |= u32::from(from <= to);
        }
        any != 0
    }
}
