//! Groups of patches that lie together and are turned alike.

use glam::DVec3;

use crate::patches::PatchId;
use crate::scene::Rgb;

/// Neighbours whose squares are averaged, at least.
const NEIGHBOURS: usize = 16;

/// How far apart opposite normals are, in diameters of the scene.
pub(super) const TURN: f64 = 0.5;

/// A patch among others: where it is, how it is turned, and what is known of its error.
pub(super) struct Neighbour {
    pub patch: PatchId,
    /// Place and normal, in diameters of the scene.
    pub at: [DVec3; 2],
    /// Squares.
    pub noise: Rgb,
    pub off: Rgb,
}

/// Sorts so that patches of a group are neighbours: halves of halves, each along its longest axis.
pub(super) fn halve(patches: &mut [Neighbour]) {
    if patches.len() < 2 * NEIGHBOURS {
        return;
    }
    let infinite = [(DVec3::INFINITY, DVec3::NEG_INFINITY); 2];
    let bounds = patches.iter().fold(infinite, |[p, n], patch| {
        [(p.0.min(patch.at[0]), p.1.max(patch.at[0])), (n.0.min(patch.at[1]), n.1.max(patch.at[1]))]
    });
    let (mut which, mut axis, mut longest) = (0, 0, -1.0);
    for (k, (low, high)) in bounds.iter().enumerate() {
        for a in 0..3 {
            if high[a] - low[a] > longest {
                (which, axis, longest) = (k, a, high[a] - low[a]);
            }
        }
    }
    let middle = patches.len() / 2;
    patches.select_nth_unstable_by(middle, |a, b| {
        a.at[which][axis].total_cmp(&b.at[which][axis]).then(a.patch.cmp(&b.patch))
    });
    let (a, b) = patches.split_at_mut(middle);
    rayon::join(|| halve(a), || halve(b));
}

/// The groups that [`halve`] leaves.
pub(super) fn groups(patches: &[Neighbour]) -> Vec<&[Neighbour]> {
    if patches.len() < 2 * NEIGHBOURS {
        return if patches.is_empty() { Vec::new() } else { vec![patches] };
    }
    let (a, b) = patches.split_at(patches.len() / 2);
    [groups(a), groups(b)].concat()
}
