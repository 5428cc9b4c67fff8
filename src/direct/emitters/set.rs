//! The emitting sides of a scene, in groups and in a hierarchy.

use std::f64::consts::PI;
use std::ops::Range;

use glam::DVec3;

use super::receiver::Receiver;
use super::sources::{Source, grouped, sphere, unit_of};
use super::tree::Tree;
use super::workspace::Workspace;
use crate::direct::{Analytic, DirectOptions, MOST_SHADOW};
use crate::patches::{PatchId, Patches, side_index};
use crate::scene::{Geometry, Optics, Rgb, Side, luminance};
use crate::visibility::{Bvh, NOTHING};

/// Emitting sides of a scene.
pub struct Emitters<'a> {
    pub(super) geometry: &'a Geometry,
    pub(super) bvh: &'a Bvh,
    pub(super) options: DirectOptions,
    pub(super) sources: Vec<Source>,
    pub(super) tree: Tree,
    /// Consecutive sources whose visible fraction is found together.
    pub(super) groups: Vec<Range<usize>>,
    /// Centre and radius of each group.
    pub(super) reaches: Vec<(DVec3, f64)>,
    /// The source of each side, or [`NOTHING`].
    pub(super) source_of: Vec<u32>,
    /// Points in the unit squares of receiver and emitter, for each of two sequences.
    pub(super) pairs: [Vec<[f32; 4]>; 2],
    /// What all sides would receive on average if all flux arrived at once, W/m² or lx.
    pub(super) typical: f64,
}

impl<'a> Emitters<'a> {
    /// The emitting sides of `geometry`. The triangles of a cluster are analytic all or none, so
    /// that the patch alone tells whether they are.
    ///
    /// `reflected` estimates the radiosity (W/m² or lm/m²) that a side reflects, by the index of
    /// the side. It is added to what the side emits; callers take it away again where rays meet
    /// the side, so any estimate will do.
    #[must_use]
    pub fn new(
        geometry: &'a Geometry,
        optics: &Optics,
        patches: &Patches,
        bvh: &'a Bvh,
        options: DirectOptions,
        reflected: impl Fn(usize) -> Rgb,
    ) -> Self {
        let mut sources: Vec<Source> = geometry
            .ids()
            .flat_map(|t| Side::BOTH.map(|s| (t, s)))
            .filter(|&(t, s)| geometry.exchanges(t, s))
            .filter(|&(t, s)| optics.emission(t, s).max_element() > 0.0)
            .map(|(triangle, side)| {
                let emission = optics.emission(triangle, side);
                let exitance = emission + reflected(side_index(triangle, side));
                Source {
                    triangle,
                    side,
                    radiance: exitance / PI,
                    corners: geometry.corners(triangle),
                    normal: geometry.normal(triangle, side),
                    area: geometry.area(triangle),
                }
            })
            .collect();
        let groups = grouped(geometry, &mut sources);
        let unit = |s: &Source| unit_of(geometry, patches, s);
        let tree = Tree::new(bvh, &mut sources, &groups, unit);
        let mut source_of = vec![NOTHING; 2 * geometry.len()];
        for (k, s) in sources.iter().enumerate() {
            source_of[side_index(s.triangle, s.side)] = k as u32;
        }
        let flux: f64 = sources.iter().map(|s| PI * luminance(s.radiance) * s.area).sum();
        let area: f64 = patches.ids().map(|i| patches.area(i)).sum();
        let reaches = groups
            .iter()
            .map(|g| {
                let corners = sources[g.clone()].iter().flat_map(|s| s.corners);
                sphere(&corners.collect::<Vec<_>>())
            })
            .collect();
        let pairs = [0, 1].map(|half| {
            let sequence = 0x5eed_0000 ^ (2 * options.seed + half);
            (0..MOST_SHADOW as u32 / 2).map(|i| sobol_burley::sample_4d(i, 0, sequence)).collect()
        });
        let typical = if area > 0.0 { flux / area } else { 0.0 };
        Self { geometry, bvh, options, sources, tree, groups, reaches, source_of, pairs, typical }
    }

    /// Number of emitting sides.
    #[must_use]
    pub fn len(&self) -> usize {
        self.sources.len()
    }

    /// Whether nothing emits.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.sources.is_empty()
    }

    /// A patch as receiver.
    #[must_use]
    pub fn patch(&self, patches: &Patches, id: PatchId) -> Receiver {
        Receiver::of_patch(self.geometry, self.bvh, patches, id)
    }

    /// A point as receiver; `seed` tells points apart.
    #[must_use]
    pub fn point(&self, at: DVec3, normal: DVec3, seed: u64) -> Receiver {
        Receiver::of_point(self.bvh, at, normal, seed)
    }

    /// Whether the emitter that a side is or belongs to is analytic for a receiver, so that its
    /// rays must not count its emission; `false` for sides that emit nothing.
    #[must_use]
    pub fn is_analytic(&self, receiver: &Receiver, side: usize) -> bool {
        let source = self.source_of[side];
        source != NOTHING && self.source_is_analytic(receiver, source as usize)
    }

    /// Whether source `k` is analytic for a receiver.
    pub(super) fn source_is_analytic(&self, r: &Receiver, k: usize) -> bool {
        match self.options.analytic {
            Analytic::All => true,
            Analytic::None => false,
            Analytic::Suitable => self.tree.is_suitable(r, k),
        }
    }

    /// Prepares for receivers that lie together: what follows is fast for any of them, and wrong
    /// for others.
    pub fn look(&self, receivers: &[Receiver], work: &mut Workspace) {
        if self.options.analytic == Analytic::None {
            return;
        }
        self.tree.cut(receivers, self.options.analytic == Analytic::All, &mut work.cut);
    }
}
