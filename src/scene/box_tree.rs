//! A tree of bounding boxes: which of many things come near each other, or near something else.

use glam::DVec3;

/// Least and greatest coordinates.
pub(crate) type Bounds = (DVec3, DVec3);

/// Binary tree by halving at the median of the longest axis.
#[derive(Debug, Clone, Default)]
pub(crate) struct BoxTree {
    order: Vec<u32>,
    nodes: Vec<Node>,
}

#[derive(Debug, Clone)]
struct Node {
    bounds: Bounds,
    /// Range in `order`.
    from: u32,
    to: u32,
    /// Where the second child is; the first follows its parent. 0 for a leaf.
    second: u32,
}

/// Leaves hold at most so many boxes.
const LEAF: usize = 4;

impl BoxTree {
    /// The tree of these boxes, which are known by their index.
    pub fn new(boxes: &[Bounds]) -> Self {
        let mut me = Self { order: (0..boxes.len() as u32).collect(), nodes: Vec::new() };
        if !boxes.is_empty() {
            me.build(0, boxes.len(), boxes);
        }
        me
    }

    fn build(&mut self, from: usize, to: usize, boxes: &[Bounds]) {
        let order = &mut self.order[from..to];
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for &i in order.iter() {
            low = low.min(boxes[i as usize].0);
            high = high.max(boxes[i as usize].1);
        }
        let at = self.nodes.len();
        self.nodes.push(Node { bounds: (low, high), from: from as u32, to: to as u32, second: 0 });
        if to - from <= LEAF {
            return;
        }
        let extent = high - low;
        let axis = (0..3).fold(0, |best, k| if extent[k] > extent[best] { k } else { best });
        let key = |i: &u32| boxes[*i as usize].0[axis] + boxes[*i as usize].1[axis];
        let along = |a: &u32, b: &u32| key(a).total_cmp(&key(b)).then(a.cmp(b));
        let middle = (to - from) / 2;
        order.select_nth_unstable_by(middle, along);
        // What is not parted any more is in a fixed order all the same.
        let (first, second) = order.split_at_mut(middle);
        for half in [first, second].into_iter().filter(|half| half.len() <= LEAF) {
            half.sort_unstable_by(along);
        }
        self.build(from, from + middle, boxes);
        self.nodes[at].second = self.nodes.len() as u32;
        self.build(from + middle, to, boxes);
    }

    /// All boxes, those that are near each other together.
    pub fn order(&self) -> &[u32] {
        &self.order
    }

    /// Hands over all boxes of leaves that are not `outside`, in a fixed order.
    pub fn near(&self, outside: impl Fn(DVec3, DVec3) -> bool, mut each: impl FnMut(u32)) {
        self.near_while(outside, |i| {
            each(i);
            true
        });
    }

    /// The same until `each` returns false; whether it never did.
    pub fn near_while(
        &self,
        outside: impl Fn(DVec3, DVec3) -> bool,
        mut each: impl FnMut(u32) -> bool,
    ) -> bool {
        let mut stack = Vec::with_capacity(64);
        stack.extend((!self.nodes.is_empty()).then_some(0));
        while let Some(at) = stack.pop() {
            let node = &self.nodes[at as usize];
            if outside(node.bounds.0, node.bounds.1) {
                continue;
            }
            if node.second != 0 {
                stack.extend([node.second, at + 1]);
            } else if !self.order[node.from as usize..node.to as usize].iter().all(|&i| each(i)) {
                return false;
            }
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Boxes of many sizes, some of them flat, some alike.
    fn boxes() -> Vec<Bounds> {
        let mut state = 1_u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (state >> 40) as f64 / (1_u64 << 24) as f64
        };
        let mut boxes: Vec<Bounds> = (0..300)
            .map(|i| {
                let low = DVec3::from([0; 3].map(|_| random()));
                let size = DVec3::from([0; 3].map(|_| random())) * 0.2;
                (low, low + if i % 3 == 0 { size * DVec3::new(1.0, 0.0, 1.0) } else { size })
            })
            .collect();
        boxes.extend_from_within(..20);
        boxes
    }

    #[test]
    fn overlaps_are_those_of_all_pairs() {
        let boxes = boxes();
        let meets = |a: &Bounds, b: &Bounds| (0..3).all(|k| a.0[k] <= b.1[k] && b.0[k] <= a.1[k]);
        let tree = BoxTree::new(&boxes);
        for own in &boxes {
            let all = 0..boxes.len() as u32;
            let expected: Vec<u32> = all.filter(|&k| meets(own, &boxes[k as usize])).collect();
            let mut found = Vec::new();
            tree.near(|low, high| !meets(own, &(low, high)), |k| found.push(k));
            found.retain(|&k| meets(own, &boxes[k as usize]));
            found.sort_unstable();
            assert_eq!(found, expected);
            let mut tried = 0;
            let all = tree.near_while(
                |_, _| false,
                |_| {
                    tried += 1;
                    tried < 7
                },
            );
            assert!(!all && tried == 7);
        }
    }

    #[test]
    fn everything_is_near_what_misses_nothing_and_only_once() {
        let boxes = boxes();
        let mut all = Vec::new();
        BoxTree::new(&boxes).near(|_, _| false, |i| all.push(i));
        all.sort_unstable();
        assert!(all.into_iter().eq(0..boxes.len() as u32));
        BoxTree::new(&boxes).near(|_, _| true, |_| panic!("nothing is near"));
        BoxTree::default().near(|_, _| false, |_| panic!("there is nothing"));
    }
}
