//! A tree of bounding boxes: which of many triangles come near each other.

use glam::DVec3;
use rayon::prelude::*;

type Bounds = (DVec3, DVec3);

/// Binary tree by halving at the median of the longest axis.
pub(crate) struct BoxTree {
    boxes: Vec<Bounds>,
    order: Vec<u32>,
    nodes: Vec<Node>,
}

struct Node {
    bounds: Bounds,
    /// Range in `order` of a leaf; children follow a branch: the next node, and `right`.
    from: u32,
    to: u32,
    right: u32,
}

const LEAF: usize = 8;

impl BoxTree {
    pub fn new(boxes: Vec<Bounds>) -> Self {
        let order = (0..boxes.len() as u32).collect();
        let mut me = Self { boxes, order, nodes: Vec::new() };
        if !me.boxes.is_empty() {
            me.build(0, me.boxes.len());
        }
        me
    }

    fn build(&mut self, from: usize, to: usize) -> u32 {
        let order = &mut self.order[from..to];
        let boxes = &self.boxes;
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for &i in order.iter() {
            low = low.min(boxes[i as usize].0);
            high = high.max(boxes[i as usize].1);
        }
        let id = self.nodes.len();
        self.nodes.push(Node { bounds: (low, high), from: from as u32, to: to as u32, right: 0 });
        if to - from > LEAF {
            let extent = high - low;
            let axis = (0..3).max_by(|&a, &b| extent[a].total_cmp(&extent[b])).unwrap_or(0);
            let middle = (to - from) / 2;
            let key = |i: u32| boxes[i as usize].0[axis] + boxes[i as usize].1[axis];
            order
                .select_nth_unstable_by(middle, |&a, &b| key(a).total_cmp(&key(b)).then(a.cmp(&b)));
            self.build(from, from + middle);
            self.nodes[id].right = self.build(from + middle, to);
        }
        id as u32
    }

    /// Calls `map(i, others)` for every box with the boxes that overlap it, ascending.
    pub fn map_overlaps<T: Send>(&self, map: impl Fn(usize, &[u32]) -> T + Sync) -> Vec<T> {
        (0..self.boxes.len())
            .into_par_iter()
            .map_init(Vec::new, |near: &mut Vec<u32>, i| {
                near.clear();
                self.collect(i, near);
                near.sort_unstable();
                map(i, near)
            })
            .collect()
    }

    fn collect(&self, i: usize, near: &mut Vec<u32>) {
        let own = self.boxes[i];
        let overlaps = |b: &Bounds| own.0.cmple(b.1).all() && b.0.cmple(own.1).all();
        let mut stack = vec![0_u32];
        while let Some(n) = stack.pop() {
            let node = &self.nodes[n as usize];
            if !overlaps(&node.bounds) {
                continue;
            }
            if node.right == 0 {
                let members = &self.order[node.from as usize..node.to as usize];
                near.extend(
                    members
                        .iter()
                        .filter(|&&k| k as usize != i && overlaps(&self.boxes[k as usize])),
                );
            } else {
                stack.extend([n + 1, node.right]);
            }
        }
    }
}
