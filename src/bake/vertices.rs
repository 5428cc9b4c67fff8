//! Colours of vertices, on a mesh that is refined where light asks for it.
//!
//! An edge is split where light at its middle, or in the middle of a triangle at it, is not what
//! its ends say. All triangles that share the edge split it alike, so no crack opens.

use std::collections::HashSet;

use glam::{DVec2, DVec3};

use super::baked::Bake;
use super::charts::Piece;
use super::facet::Facet;
use crate::patches::at_barycentric;
use crate::scene::{Rgb, luminance};

/// Light that a mesh may be off by, as a share of the mean.
const OFF: f64 = 0.02;

/// Turns of splitting.
const MOST_SPLITS: usize = 7;

/// Most triangles of a refined mesh for each of the source, and in all.
const MOST_FACETS: usize = 1 << 21;

/// Places on an edge, from end to end, where light is looked at.
const PLACES: [f64; 3] = [0.25, 0.5, 0.75];

impl Bake<'_> {
    /// All surfaces as triangles with radiances at their corners, small where light changes.
    #[must_use]
    pub fn refined(&self) -> Vec<Facet> {
        let mut pieces = self.atlas.pieces.clone();
        let lit: Vec<f64> = self
            .irradiance
            .iter()
            .map(|e| luminance(DVec3::from_array(e.map(f64::from))))
            .filter(|e| *e > 0.0)
            .collect();
        let most = OFF * lit.iter().sum::<f64>() / lit.len().max(1) as f64;
        for _ in 0..MOST_SPLITS {
            let split = self.edges_to_split(&pieces, most);
            if split.is_empty() || pieces.len() + 2 * split.len() > MOST_FACETS {
                break;
            }
            pieces = pieces.iter().flat_map(|p| self.split(p, &split)).collect();
        }
        let radiance = |p: &Piece| [0, 1, 2].map(|k| self.radiance(p, k));
        pieces.iter().map(|p| self.atlas.facet(p, radiance(p))).collect()
    }

    /// Radiance at a corner of a piece.
    fn radiance(&self, piece: &Piece, corner: usize) -> [f32; 3] {
        let l = [DVec3::X, DVec3::Y, DVec3::Z][corner];
        let light = self.read(piece.texels[corner]);
        self.renderer.sight(piece.point(l), light).radiance.as_vec3().to_array()
    }

    /// Edges at which light is off by more than `most` (its luminance).
    fn edges_to_split(&self, pieces: &[Piece], most: f64) -> HashSet<Edge> {
        let mut split = HashSet::new();
        for piece in pieces {
            let ends = piece.texels.map(|t| self.read(t));
            let extent = (0..3).map(|k| piece.texels[k].distance(piece.texels[(k + 1) % 3]));
            // Texels know no more.
            if extent.fold(0.0, f64::max) < 2.0 {
                continue;
            }
            let off = |at: DVec2, said: Rgb| luminance((self.read(at) - said).abs()) > most;
            let edges = self.edges(piece);
            for (k, edge) in edges.iter().enumerate() {
                let (a, b) = (k, (k + 1) % 3);
                let at = |t: f64| piece.texels[a].lerp(piece.texels[b], t);
                if PLACES.iter().any(|&t| off(at(t), ends[a].lerp(ends[b], t))) {
                    split.insert(*edge);
                }
            }
            let inner = (1..6).flat_map(|i| (1..6 - i).map(move |j| (i, j))).any(|(i, j)| {
                let l = DVec3::new(f64::from(i), f64::from(j), f64::from(6 - i - j)) / 6.0;
                let [a, b, c] = piece.texels;
                off(a * l.x + b * l.y + c * l.z, ends[0] * l.x + ends[1] * l.y + ends[2] * l.z)
            });
            if inner {
                split.extend(edges);
            }
        }
        split
    }

    /// The edges of a piece, alike from both sides.
    fn edges(&self, piece: &Piece) -> [Edge; 3] {
        let g = &self.scene.geometry;
        let corners = g.corners(piece.triangle);
        let middle = |k: usize| {
            let uv = piece.corners[k].midpoint(piece.corners[(k + 1) % 3]);
            at_barycentric(corners, DVec3::new(1.0 - uv.x - uv.y, uv.x, uv.y))
        };
        // Where their middles are, to a fraction of a texel.
        let step = self.atlas.texel * 1e-4;
        [0, 1, 2].map(|k| (middle(k) / step).round().to_array().map(|c| c as i64))
    }

    /// A piece with the edges of it split that are to be.
    fn split(&self, piece: &Piece, split: &HashSet<Edge>) -> Vec<Piece> {
        let cut = self.edges(piece).map(|e| split.contains(&e));
        let (c, t) = (piece.corners, piece.texels);
        let middle = |k: usize| (c[k].midpoint(c[(k + 1) % 3]), t[k].midpoint(t[(k + 1) % 3]));
        let corner = |k: usize| (c[k], t[k]);
        let of = |corners: [(DVec2, DVec2); 3]| Piece {
            corners: corners.map(|p| p.0),
            texels: corners.map(|p| p.1),
            ..*piece
        };
        let count = cut.iter().filter(|c| **c).count();
        match count {
            0 => vec![*piece],
            1 => {
                let k = (0..3).find(|&k| cut[k]).unwrap_or(0);
                let (a, b, c) = (k, (k + 1) % 3, (k + 2) % 3);
                vec![of([corner(a), middle(a), corner(c)]), of([middle(a), corner(b), corner(c)])]
            }
            2 => {
                // The edge that stays runs from a to b.
                let k = (0..3).find(|&k| !cut[k]).unwrap_or(0);
                let (a, b, c) = (k, (k + 1) % 3, (k + 2) % 3);
                vec![
                    of([corner(a), corner(b), middle(b)]),
                    of([corner(a), middle(b), middle(c)]),
                    of([middle(c), middle(b), corner(c)]),
                ]
            }
            _ => vec![
                of([corner(0), middle(0), middle(2)]),
                of([middle(0), corner(1), middle(1)]),
                of([middle(2), middle(1), corner(2)]),
                of([middle(0), middle(1), middle(2)]),
            ],
        }
    }
}

/// Where the middle of an edge is, in small steps.
type Edge = [i64; 3];
