//! Rays and triangles in double precision, and boxes that spare most tests.

use glam::DVec3;

/// Triangles that rays may meet.
pub struct Tracer {
    corners: Vec<[DVec3; 3]>,
    normals: Vec<DVec3>,
    areas: Vec<f64>,
    nodes: Vec<Node>,
    order: Vec<u32>,
    /// Those that each triangle faces in its own plane.
    touching: Vec<Vec<usize>>,
    /// Length of the diagonal of all, m.
    size: f64,
}

/// What a ray meets first.
pub struct Hit {
    pub triangle: usize,
    /// Whether it meets the front.
    pub front: bool,
}

/// A box of triangles `order[from..to]`; its children are the next node and `right`.
struct Node {
    low: DVec3,
    high: DVec3,
    from: u32,
    to: u32,
    /// 0 for a leaf.
    right: u32,
}

/// Triangles in a leaf.
const LEAF: usize = 4;

impl Tracer {
    pub fn new(corners: Vec<[DVec3; 3]>) -> Self {
        let twice: Vec<DVec3> = corners.iter().map(|[a, b, c]| (b - a).cross(c - a)).collect();
        let mut me = Self {
            normals: twice.iter().map(|n| n.normalize_or_zero()).collect(),
            areas: twice.iter().map(|n| 0.5 * n.length()).collect(),
            nodes: Vec::new(),
            order: (0..corners.len() as u32).collect(),
            touching: Vec::new(),
            corners,
            size: 0.0,
        };
        let middles: Vec<DVec3> = me.corners.iter().map(|t| t.iter().sum::<DVec3>()).collect();
        me.build(0, me.corners.len(), &middles);
        me.size = me.nodes.first().map_or(0.0, |n| (n.high - n.low).length());
        let touching = |i| (0..me.len()).filter(|&j| me.touch(i, j) || me.touch(j, i)).collect();
        me.touching = (0..me.len()).map(touching).collect();
        me
    }

    /// Number of triangles.
    pub fn len(&self) -> usize {
        self.corners.len()
    }

    pub fn corners(&self, i: usize) -> [DVec3; 3] {
        self.corners[i]
    }

    /// Unit normal of the front.
    pub fn normal(&self, i: usize) -> DVec3 {
        self.normals[i]
    }

    /// m².
    pub fn area(&self, i: usize) -> f64 {
        self.areas[i]
    }

    /// Whether two triangles face each other in one plane, so that rounding decides what they see.
    pub fn touch(&self, i: usize, j: usize) -> bool {
        /// Of the size of all: what single precision leaves of a plane.
        const TOUCH: f64 = 2e-6;
        let n = self.normals[i];
        let reach = TOUCH * self.size;
        let flat = |v: &DVec3| (v - self.corners[i][0]).dot(n).abs() <= reach;
        n.dot(self.normals[j]) < -0.99 && self.corners[j].iter().all(flat)
    }

    /// Whether another triangle lies on triangle `i` at a point of it, face to face: nothing sees
    /// that point.
    fn is_covered(&self, i: usize, p: DVec3) -> bool {
        self.touching[i].iter().any(|&t| {
            let n = self.normals[t];
            let [a, b, c] = self.corners[t];
            [(a, b), (b, c), (c, a)].iter().all(|(a, b)| n.cross(b - a).dot(p - a) >= 0.0)
        })
    }

    /// A point of a triangle, uniform if `u` and `v` are in 0..1.
    pub fn point(&self, i: usize, u: f64, v: f64) -> DVec3 {
        let [a, b, c] = self.corners[i];
        let s = u.sqrt();
        a + (b - a) * (s * (1.0 - v)) + (c - a) * (s * v)
    }

    /// Halves by the median of the longest extent.
    fn build(&mut self, from: usize, to: usize, middles: &[DVec3]) {
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for &t in &self.order[from..to] {
            for v in self.corners[t as usize] {
                (low, high) = (low.min(v), high.max(v));
            }
        }
        let me = self.nodes.len();
        // Boxes are a little wider than what they hold: a slab test is not exact.
        let margin = DVec3::splat(1e-12 * (high - low).max_element());
        let (low, high) = (low - margin, high + margin);
        self.nodes.push(Node { low, high, from: from as u32, to: to as u32, right: 0 });
        if to - from <= LEAF {
            return;
        }
        let axis = (0..3).max_by(|&a, &b| (high - low)[a].total_cmp(&(high - low)[b])).unwrap_or(0);
        let middle = (to - from) / 2;
        self.order[from..to].select_nth_unstable_by(middle, |&a, &b| {
            middles[a as usize][axis].total_cmp(&middles[b as usize][axis])
        });
        self.build(from, from + middle, middles);
        self.nodes[me].right = self.nodes.len() as u32;
        self.build(from + middle, to, middles);
    }

    /// Calls `meet` for all triangles whose boxes a ray passes within `reach` times its direction;
    /// `meet` returns how far it is still of interest.
    fn walk(&self, o: DVec3, d: DVec3, reach: f64, mut meet: impl FnMut(usize) -> f64) {
        let inverse = d.recip();
        let mut reach = reach;
        let mut stack = [0_u32; 64];
        let mut top = 1;
        while top > 0 {
            top -= 1;
            let k = stack[top];
            let node = &self.nodes[k as usize];
            let (a, b) = ((node.low - o) * inverse, (node.high - o) * inverse);
            let near = a.min(b).max_element().max(0.0);
            let far = a.max(b).min_element().min(reach);
            if near > far {
                continue;
            }
            if node.right == 0 {
                for &t in &self.order[node.from as usize..node.to as usize] {
                    reach = reach.min(meet(t as usize));
                }
            } else {
                stack[top] = node.right;
                stack[top + 1] = k + 1;
                top += 2;
            }
        }
    }

    /// Where a ray meets a triangle, in units of its direction (Möller & Trumbore 1997, "Fast,
    /// minimum storage ray/triangle intersection").
    fn meets(&self, t: usize, o: DVec3, d: DVec3) -> Option<f64> {
        let [a, b, c] = self.corners[t];
        let (e, f) = (b - a, c - a);
        let p = d.cross(f);
        let det = e.dot(p);
        if det == 0.0 {
            return None;
        }
        let s = o - a;
        let u = s.dot(p) / det;
        let q = s.cross(e);
        let v = d.dot(q) / det;
        (u >= 0.0 && v >= 0.0 && u + v <= 1.0).then(|| f.dot(q) / det)
    }

    /// Whether nothing but triangles `i` and `j` lies between two points.
    pub fn clear(&self, from: DVec3, to: DVec3, i: usize, j: usize) -> bool {
        let d = to - from;
        let mut clear = !self.is_covered(i, from) && !self.is_covered(j, to);
        self.walk(from, d, 1.0, |t| {
            if t != i && t != j && self.meets(t, from, d).is_some_and(|s| s > 0.0 && s < 1.0) {
                clear = false;
                return -1.0;
            }
            1.0
        });
        clear
    }

    /// The first triangle but `own` that a ray meets; what covers `own` there, or the triangle met,
    /// shows its back.
    pub fn first(&self, from: DVec3, d: DVec3, own: usize) -> Option<Hit> {
        if self.is_covered(own, from) {
            return Some(Hit { triangle: own, front: false });
        }
        let mut found: Option<(f64, usize)> = None;
        self.walk(from, d, f64::INFINITY, |t| {
            let nearest = found.map_or(f64::INFINITY, |f| f.0);
            let at = self.meets(t, from, d).filter(|&s| t != own && s > 0.0 && s < nearest);
            found = at.map(|s| (s, t)).or(found);
            found.map_or(f64::INFINITY, |f| f.0)
        });
        found.map(|(s, triangle)| {
            let front = d.dot(self.normals[triangle]) < 0.0;
            Hit { triangle, front: front && !self.is_covered(triangle, from + d * s) }
        })
    }

    /// All triangles but `own` whose fronts a ray meets, hidden or not.
    pub fn fronts(&self, from: DVec3, d: DVec3, own: usize) -> Vec<usize> {
        let mut found = Vec::new();
        self.walk(from, d, f64::INFINITY, |t| {
            let front = t != own && d.dot(self.normals[t]) < 0.0;
            if front && self.meets(t, from, d).is_some_and(|s| s > 0.0) {
                found.push(t);
            }
            f64::INFINITY
        });
        found
    }
}
