//! Disjoint sets of numbers that merge (union-find).

/// Disjoint sets, each known by its smallest number.
pub(crate) struct Sets(Vec<u32>);

impl Sets {
    /// The sets {0}, {1} to {n - 1}.
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

    /// The smaller number stands for both.
    pub fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.find(a), self.find(b));
        self.0[a.max(b) as usize] = a.min(b);
    }
}
