//! Segments on a source triangle, in its coordinates `uv`.

use glam::{DVec2, DVec3};

/// A segment of contact in the coordinates `uv` of a source triangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Line {
    pub from: DVec2,
    pub to: DVec2,
}

/// Barycentric coordinates below this lie on the edge.
const EDGE: f64 = 1e-6;

/// Barycentric coordinates in the plane of a triangle.
pub(super) struct Plane {
    origin: DVec3,
    u: DVec3,
    v: DVec3,
}

impl Plane {
    pub fn of([a, b, c]: [DVec3; 3]) -> Self {
        let (e, f) = (b - a, c - a);
        let (ee, ef, ff) = (e.dot(e), e.dot(f), f.dot(f));
        let determinant = ee * ff - ef * ef;
        Self { origin: a, u: (e * ff - f * ef) / determinant, v: (f * ee - e * ef) / determinant }
    }

    /// Coordinates `uv` of the foot of a point.
    pub fn uv(&self, p: DVec3) -> DVec2 {
        DVec2::new((p - self.origin).dot(self.u), (p - self.origin).dot(self.v))
    }

    pub fn barycentric(&self, p: DVec3) -> DVec3 {
        let uv = self.uv(p);
        DVec3::new(1.0 - uv.x - uv.y, uv.x, uv.y)
    }
}

/// The part of a segment within the triangle; `None` if it is empty, a point, or lies on an edge.
pub(super) fn clip(from: DVec3, to: DVec3) -> Option<Line> {
    let (mut t0, mut t1) = (0.0_f64, 1.0_f64);
    for k in 0..3 {
        let (a, b) = (from[k], to[k]);
        if a <= EDGE && b <= EDGE {
            return None;
        }
        if a < 0.0 {
            t0 = t0.max(a / (a - b));
        } else if b < 0.0 {
            t1 = t1.min(a / (a - b));
        }
    }
    let (from, to) = (from.lerp(to, t0), from.lerp(to, t1));
    let line = Line { from: DVec2::new(from.y, from.z), to: DVec2::new(to.y, to.z) };
    (t1 > t0 && line.from.distance(line.to) > EDGE).then_some(line)
}

/// The edge, from corner k to the next, that a segment runs along for some way.
pub(super) fn edge_under(from: DVec3, to: DVec3) -> Option<usize> {
    let zero = (0..3).find(|&k| from[k].abs() <= EDGE && to[k].abs() <= EDGE)?;
    let k = (zero + 1) % 3;
    // Places along the edge, 0..1, counted from its far end.
    let (a, b) = (from[k], to[k]);
    (a.max(b).min(1.0) - a.min(b).max(0.0) > EDGE).then_some(k)
}

impl Line {
    /// Whether the way from `a` to `b` crosses this line. Ways that only touch it do not.
    pub fn separates(&self, a: DVec2, b: DVec2) -> bool {
        let turn = |p: DVec2, q: DVec2, r: DVec2| (q - p).perp_dot(r - p);
        let (sa, sb) = (turn(self.from, self.to, a), turn(self.from, self.to, b));
        if sa * sb >= 0.0 {
            return false;
        }
        // Lines of one outline meet at their ends: no way leads through between them.
        let (s, t) = (turn(a, b, self.from), turn(a, b, self.to));
        let slack = 1e-9 * (b - a).length();
        s.min(t) <= slack && s.max(t) >= -slack
    }

    /// Distance of a point.
    pub fn distance(&self, p: DVec2) -> f64 {
        let along = self.to - self.from;
        let t = (p - self.from).dot(along) / along.length_squared();
        p.distance(self.from.lerp(self.to, t.clamp(0.0, 1.0)))
    }

    /// Whether the line comes within the box of half size `reach` about `centre`.
    pub fn near(&self, centre: DVec2, reach: f64) -> bool {
        let (mut t0, mut t1) = (0.0_f64, 1.0_f64);
        for k in 0..2 {
            let (a, b) = (self.from[k] - centre[k], self.to[k] - centre[k]);
            for (a, b) in [(a + reach, b + reach), (reach - a, reach - b)] {
                if a < 0.0 && b < 0.0 {
                    return false;
                }
                if a < 0.0 {
                    t0 = t0.max(a / (a - b));
                } else if b < 0.0 {
                    t1 = t1.min(a / (a - b));
                }
            }
        }
        t0 <= t1
    }

    /// Whether the line passes through the inside of a triangle.
    pub fn enters(&self, [a, b, c]: [DVec2; 3]) -> bool {
        let (low, high) = (self.from.min(self.to), self.from.max(self.to));
        if high.cmplt(a.min(b).min(c)).any() || low.cmpgt(a.max(b).max(c)).any() {
            return false;
        }
        let area = (b - a).perp_dot(c - a);
        let barycentric = |p: DVec2| {
            let (l1, l2) = ((p - a).perp_dot(c - a) / area, (b - a).perp_dot(p - a) / area);
            DVec3::new(1.0 - l1 - l2, l1, l2)
        };
        clip(barycentric(self.from), barycentric(self.to)).is_some()
    }

    /// Whether the line may [separate](Self::separates) a point of a triangle from `target`: true
    /// in doubt.
    pub fn may_part(&self, [a, b, c]: [DVec2; 3], target: DVec2) -> bool {
        /// Points that lie this near to the triangle count as its own.
        const MARGIN: f64 = 1e-6;
        let ends = [self.from, self.to];
        let low = a.min(b).min(c).min(target) - MARGIN;
        let high = a.max(b).max(c).max(target) + MARGIN;
        if ends[0].max(ends[1]).cmplt(low).any() || ends[0].min(ends[1]).cmpgt(high).any() {
            return false;
        }
        if beside(self.from, self.to, &[a, b, c, target], MARGIN) {
            return false;
        }
        // Beside an edge of the hull: all of the hull on one side of it, the line on the other.
        let corners = [a, b, c, target];
        !(0..4).any(|i| {
            (0..4).any(|j| {
                let (p, q) = (corners[i], corners[j]);
                let reach = MARGIN * (q - p).length();
                let turn = |r: DVec2| (q - p).perp_dot(r - p);
                i != j
                    && ends.iter().all(|&e| turn(e) < -reach)
                    && corners.iter().all(|&r| turn(r) >= 0.0)
            })
        })
    }
}

/// Whether all of `points` lie on one side of the line through `a` and `b`, by more than `margin`.
fn beside(a: DVec2, b: DVec2, points: &[DVec2], margin: f64) -> bool {
    let least = margin * (b - a).length();
    let turn = |p: &DVec2| (b - a).perp_dot(*p - a);
    points.iter().all(|p| turn(p) > least) || points.iter().all(|p| turn(p) < -least)
}
