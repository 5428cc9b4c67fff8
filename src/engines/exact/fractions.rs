//! The points that look from a triangle, 16 at a time, and what is hidden from each.

use crate::simd::LANES;

/// The error of the middle of a range over its width, if all of it is equally likely.
const UNIFORM: f64 = 0.288_675_134_594_812_9;

/// Points of a triangle: the centroids of its 16 sub-triangles.
pub(super) const POINTS: [[f64; 3]; LANES] = {
    let mut points = [[0.0; 3]; LANES];
    let (mut i, mut k) = (0, 0);
    while i < 4 {
        let mut j = 0;
        while j < 4 - i {
            let (x, y) = (i as f64, j as f64);
            let (u, v) = ((x + 1.0 / 3.0) / 4.0, (y + 1.0 / 3.0) / 4.0);
            points[k] = [1.0 - u - v, u, v];
            k += 1;
            if j < 3 - i {
                let (u, v) = ((x + 2.0 / 3.0) / 4.0, (y + 2.0 / 3.0) / 4.0);
                points[k] = [1.0 - u - v, u, v];
                k += 1;
            }
            j += 1;
        }
        i += 1;
    }
    points
};

/// Nodes lie this fraction of the way from the triangle's rim to its centroid: what stands on a
/// corner or an edge would be seen edge-on from there.
const INSET: f64 = 1.0 / 256.0;

/// The corners of the 16 sub-triangles, and once more the centroid.
pub(super) const NODES: [[f64; 3]; LANES] = {
    let mut nodes = [[1.0 / 3.0; 3]; LANES];
    let (mut i, mut k) = (0, 0);
    while i < 5 {
        let mut j = 0;
        while j < 5 - i {
            let (u, v) = (i as f64 / 4.0, j as f64 / 4.0);
            let mut c = 0;
            while c < 3 {
                let at = [1.0 - u - v, u, v][c];
                nodes[k][c] = at + INSET * (1.0 / 3.0 - at);
                c += 1;
            }
            k += 1;
            j += 1;
        }
        i += 1;
    }
    nodes
};

/// The number of sub-triangles that meet at each node, over 3: the trapezoidal rule, of weight 16.
pub(super) const NODE_WEIGHTS: [f64; LANES] = {
    const CORNER: f64 = 1.0 / 3.0;
    const EDGE: f64 = 1.0;
    const INSIDE: f64 = 2.0;
    [
        CORNER, EDGE, EDGE, EDGE, CORNER, EDGE, INSIDE, INSIDE, EDGE, EDGE, INSIDE, EDGE, EDGE,
        EDGE, CORNER, 0.0,
    ]
};

/// The points that are the centroids of the triangle's quarters.
pub(super) const OF_QUARTERS: [usize; 4] = [1, 13, 5, 9];

/// Fractions that are hidden from 16 points.
#[derive(Clone)]
pub(super) struct Fractions {
    /// Between these, whatever overlaps.
    pub least: [f32; LANES],
    pub most: [f32; LANES],
    /// If blockers of different sheets hide independently of each other.
    pub likely: [f32; LANES],
}

impl Fractions {
    /// Sets what is hidden from one point, and how wide a range is left for it.
    pub fn set(&mut self, l: usize, hidden: f32, width: f32) {
        self.likely[l] = hidden;
        self.least[l] = (hidden - 0.5 * width).max(0.0);
        self.most[l] = (hidden + 0.5 * width).min(1.0);
    }
}

/// The error of what is hidden for not knowing what overlaps, in the unit of the weights.
pub(super) fn uncertainty(found: &Fractions, weights: &[f64; LANES]) -> f64 {
    let widths = found.least.iter().zip(&found.most).map(|(a, b)| f64::from(b - a));
    UNIFORM * widths.zip(weights).map(|(width, weight)| width * weight).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nodes_integrate_what_is_linear() {
        let area: f64 = NODE_WEIGHTS.iter().sum();
        assert!((area - LANES as f64).abs() < 1e-12);
        for c in 0..3 {
            let mean = |w: f64| w / area;
            let sum: f64 = NODES.iter().zip(NODE_WEIGHTS).map(|(p, w)| mean(w) * p[c]).sum();
            assert!((sum - 1.0 / 3.0).abs() < 1e-12, "{sum}");
        }
        let corners = [0, 4, 14].map(|k| (NODES[k], NODE_WEIGHTS[k]));
        assert!(corners.iter().all(|(p, w)| p.iter().any(|&b| b > 0.99) && *w < 0.4));
    }

    #[test]
    fn four_points_are_the_centroids_of_the_quarters() {
        let (sixth, rest) = (1.0 / 6.0, 2.0 / 3.0);
        let third = 1.0 / 3.0;
        let centroids =
            [[rest, sixth, sixth], [sixth, rest, sixth], [sixth, sixth, rest], [third; 3]];
        for (l, centroid) in OF_QUARTERS.into_iter().zip(centroids) {
            assert!(POINTS[l].iter().zip(centroid).all(|(a, b)| (a - b).abs() < 1e-12));
        }
    }
}
