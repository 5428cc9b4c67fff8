//! What hemicubes of one scene have in common, and what one thread needs to make a row.

use crate::engines::delta::DeltaFormFactors;
use crate::engines::lookup::Lookups;
use crate::form_factors::tally::Tally;
use crate::patches::Patches;
use crate::scene::Geometry;
use crate::visibility::{Bodies, Edges, Face, ItemBuffer, NOTHING, Occluders, View};

/// The scene as the engine keeps it, and the five faces.
pub(super) struct Model<'a> {
    pub geometry: &'a Geometry,
    pub patches: &'a Patches,
    pub occluders: Occluders,
    pub bodies: Bodies,
    pub faces: [Face; 5],
    /// Delta form factors of top and side with the stride of the faces; padding weighs nothing.
    pub weights: [Vec<u32>; 2],
    pub lookups: Lookups<'a>,
}

impl<'a> Model<'a> {
    /// For hemicubes of `resolution` pixels along the top.
    pub fn new(geometry: &'a Geometry, patches: &'a Patches, resolution: usize) -> Self {
        let delta = DeltaFormFactors::new(resolution);
        let faces = Face::hemicube(resolution);
        let stride = faces[0].stride();
        let pad = |weights: &[u32]| -> Vec<u32> {
            let rows = weights.chunks(resolution);
            let padding = || std::iter::repeat_n(0, stride - resolution);
            rows.flat_map(|row| row.iter().copied().chain(padding())).collect()
        };
        let weights = [pad(&delta.top), pad(&delta.side)];
        let occluders = Occluders::new(geometry);
        let bodies = occluders.bodies(geometry);
        let lookups = Lookups::new(occluders.ids(), patches);
        Self { geometry, patches, occluders, bodies, faces, weights, lookups }
    }
}

/// The item buffers of one hemicube and what goes with them; reused.
#[derive(Default)]
pub(super) struct RowBuffers {
    pub view: View,
    /// Solid triangles whose back would be seen, if their body did not hide it.
    pub hidden: Vec<bool>,
    pub items: [ItemBuffer; 5],
    /// Edge functions of the triangles drawn: by solid triangle, or by source triangle when patches
    /// are drawn.
    pub edges: Vec<Edges>,
    /// Weight of each patch seen so far in this row.
    pub tally: Tally<u32>,
    /// The patch under each pixel of a row of pixels.
    pub places: Vec<u32>,
}

/// Mark of a back that does not reflect, in an item buffer of patches.
pub(super) const BACK: u32 = NOTHING - 1;
