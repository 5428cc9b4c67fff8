//! Remnants: small parts that the cuts left join a neighbour where both together fit.

use rayon::prelude::*;

use super::region::{Fit, NONE, Region, Shape};

/// Clusters below this fraction of the largest area try to join a neighbour.
const REMNANT: f64 = 0.4;

/// Clusters while remnants join their neighbours: chains of parts.
pub(super) struct Joined<'a> {
    region: &'a Region,
    order: &'a [u32],
    /// First facet in `order` of each part, and the end.
    starts: Vec<u32>,
    /// The part whose cluster each facet belongs to.
    cluster_of: Vec<u32>,
    /// The next part of the same cluster, or [`NONE`].
    next: Vec<u32>,
    last: Vec<u32>,
    shapes: Vec<Shape>,
}

impl<'a> Joined<'a> {
    pub fn new(region: &'a Region, order: &'a [u32], lengths: &[u32]) -> Self {
        let n = lengths.len();
        let mut starts = Vec::with_capacity(n + 1);
        starts.push(0);
        for length in lengths {
            starts.push(starts[starts.len() - 1] + length);
        }
        let mut cluster_of = vec![0; order.len()];
        for (part, ends) in starts.windows(2).enumerate() {
            for &i in &order[ends[0] as usize..ends[1] as usize] {
                cluster_of[i as usize] = part as u32;
            }
        }
        let shapes = starts
            .par_windows(2)
            .map(|w| Shape::of(region.facets_of(&order[w[0] as usize..w[1] as usize])))
            .collect();
        let last = (0..n as u32).collect();
        Self { region, order, starts, cluster_of, next: vec![NONE; n], last, shapes }
    }

    /// Joins remnants, the smallest first, and yields the cluster of each facet.
    pub fn join(mut self) -> Vec<u32> {
        let small = REMNANT * self.region.max_area;
        let mut remnants: Vec<u32> = (0..self.shapes.len() as u32)
            .filter(|&p| self.shapes[p as usize].area < small)
            .collect();
        let areas: Vec<f64> = self.shapes.iter().map(|s| s.area).collect();
        remnants.sort_unstable_by(|&a, &b| {
            areas[a as usize].total_cmp(&areas[b as usize]).then(a.cmp(&b))
        });
        let mut borders: Vec<(u32, f32)> = Vec::new();
        for p in remnants {
            // A remnant that others have joined is known by its first part.
            if self.shapes[p as usize].area < small {
                self.join_one(p, &mut borders);
            }
        }
        self.cluster_of
    }

    fn join_one(&mut self, p: u32, borders: &mut Vec<(u32, f32)>) {
        borders.clear();
        for i in self.facets(p) {
            let around = self.region.neighbours[i as usize].iter();
            for (&j, &length) in around.zip(&self.region.lengths[i as usize]) {
                if j != NONE && self.cluster_of[j as usize] != p {
                    borders.push((self.cluster_of[j as usize], length));
                }
            }
        }
        borders.sort_unstable_by_key(|b| b.0);
        borders.dedup_by(|b, a| {
            let same = a.0 == b.0;
            a.1 += if same { b.1 } else { 0.0 };
            same
        });
        borders.sort_unstable_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        let fits = borders.iter().map(|b| b.0).find(|&q| {
            let [a, b] = [p, q].map(|c| self.shapes[c as usize].area);
            let facets = || self.facets(p).chain(self.facets(q));
            let facets = || facets().map(|i| &self.region.facets[i as usize]);
            a + b <= self.region.max_area
                && self.region.fit(&Shape::of(facets()), facets()) == Fit::Fits
        });
        let Some(q) = fits else { return };
        let facets = self.facets(p).chain(self.facets(q));
        self.shapes[q as usize] = Shape::of(facets.map(|i| &self.region.facets[i as usize]));
        self.shapes[p as usize].area = f64::INFINITY;
        let moved: Vec<u32> = self.facets(p).collect();
        for i in moved {
            self.cluster_of[i as usize] = q;
        }
        let tail = self.last[q as usize];
        self.next[tail as usize] = p;
        self.last[q as usize] = self.last[p as usize];
    }

    /// The facets of the cluster that begins with part `p`.
    fn facets(&self, p: u32) -> impl Iterator<Item = u32> + '_ {
        std::iter::successors(Some(p), |&p| Some(self.next[p as usize]).filter(|&n| n != NONE))
            .flat_map(|p| {
                let range = self.starts[p as usize] as usize..self.starts[p as usize + 1] as usize;
                self.order[range].iter().copied()
            })
    }
}
