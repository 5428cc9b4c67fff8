//! Disjoint sets of numbers that merge.
//!
//! R.E. Tarjan 1975, "Efficiency of a good but not linear set union algorithm".

/// Disjoint sets of the numbers below n (union-find), each known by its smallest member.
#[derive(Debug, Clone)]
pub(crate) struct DisjointSets(Vec<u32>);

impl DisjointSets {
    /// Every number below `n` alone.
    pub fn new(n: usize) -> Self {
        Self((0..n as u32).collect())
    }

    /// The smallest number of the set that `i` is in.
    pub fn find(&mut self, mut i: u32) -> u32 {
        while self.0[i as usize] != i {
            let up = self.0[self.0[i as usize] as usize];
            self.0[i as usize] = up;
            i = up;
        }
        i
    }

    /// Makes one of the sets that `a` and `b` are in.
    pub fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.find(a), self.find(b));
        self.0[a.max(b) as usize] = a.min(b);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sets_are_known_by_their_smallest_member() {
        let mut sets = DisjointSets::new(7);
        for (a, b) in [(5, 3), (6, 5), (1, 2), (3, 6)] {
            sets.join(a, b);
        }
        let all: Vec<u32> = (0..7).map(|i| sets.find(i)).collect();
        assert_eq!(all, [0, 1, 1, 3, 4, 3, 3]);
        sets.join(2, 6);
        assert_eq!((sets.find(5), sets.find(0)), (1, 0));
    }

    #[test]
    fn a_long_chain_is_found_as_well() {
        let mut sets = DisjointSets::new(10_000);
        (1..10_000).rev().for_each(|i| sets.join(i, i - 1));
        assert!((0..10_000).all(|i| sets.find(i) == 0));
    }
}
