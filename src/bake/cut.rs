//! Sides of source triangles, cut along the contact lines on them: what lies beyond a wall gets
//! texels of its own.

use glam::{DVec2, DVec3};

/// Of a source triangle's coordinates `uv`: points nearer than this to a line lie on it.
const ON: f64 = 1e-7;

/// More parts than this are not made of a side.
const MOST_PARTS: usize = 1024;

/// Parts whose corners are more than this are not searched for corners of others on their edges.
const MOST_CORNERS: usize = 4096;

/// A convex part of a side, in the coordinates `uv` of its source triangle.
#[derive(Debug, Clone)]
struct Part {
    corners: Vec<DVec2>,
    /// Whether something stands on the edge from each corner to the next.
    stood_on: Vec<bool>,
}

/// A triangle of a part: its corners, and whether something stands on the edge from each to the
/// next.
pub(super) type Cut = ([DVec2; 3], [bool; 3]);

/// A side in parts.
#[derive(Debug, Clone)]
pub(super) struct Parts(Vec<Part>);

impl Parts {
    /// Cuts a side along lines; `edges` tells on which of its own something stands. Parts that are
    /// small, by their corners, are not cut any more.
    pub fn new(
        lines: impl IntoIterator<Item = [DVec2; 2]>,
        edges: [bool; 3],
        is_small: impl Fn(&[DVec2]) -> bool,
    ) -> Self {
        let corners = vec![DVec2::ZERO, DVec2::X, DVec2::Y];
        let mut parts = vec![Part { corners, stood_on: edges.to_vec() }];
        for line in lines {
            if parts.len() >= MOST_PARTS {
                break;
            }
            let mut next = Vec::with_capacity(parts.len() + 2);
            for part in parts {
                if is_small(&part.corners) {
                    next.push(part);
                } else {
                    part.split(line, &mut next);
                }
            }
            parts = next;
        }
        if parts.len() > 1 {
            share_corners(&mut parts);
        }
        Self(parts)
    }

    /// Corners on edge `k` of the side, within it: how far along it, 0..1.
    pub fn on_edge(&self, k: usize) -> Vec<f64> {
        let all = self.0.iter().flat_map(|p| &p.corners);
        let on = all.filter_map(|&p| place_on(k, p));
        on.filter(|t| *t > ON && *t < 1.0 - ON).collect()
    }

    /// Puts corners at places along edge `k`, so that those beyond it have them too.
    pub fn put_on_edge(&mut self, k: usize, places: &[f64]) {
        let at = |t: f64| match k {
            0 => DVec2::new(t, 0.0),
            1 => DVec2::new(1.0 - t, t),
            _ => DVec2::new(0.0, 1.0 - t),
        };
        for part in &mut self.0 {
            let mut shared = Part { corners: Vec::new(), stood_on: Vec::new() };
            for (a, b, stood_on) in part.edges() {
                shared.corners.push(a);
                shared.stood_on.push(stood_on);
                let Some((from, to)) = place_on(k, a).zip(place_on(k, b)) else { continue };
                let between = |t: &f64| *t > from + SAME && *t < to - SAME;
                for &t in places.iter().filter(|t| between(t)) {
                    shared.corners.push(at(t));
                    shared.stood_on.push(stood_on);
                }
            }
            *part = shared;
        }
    }

    /// Triangles of all parts.
    pub fn triangles(&self) -> Vec<Cut> {
        self.0.iter().flat_map(Part::triangles).collect()
    }
}

/// Corners nearer than this along an edge are one.
const SAME: f64 = 10.0 * ON;

/// How far along edge `k` of a side a point on it lies, 0..1.
fn place_on(k: usize, p: DVec2) -> Option<f64> {
    let (off, place) = match k {
        0 => (p.y, p.x),
        1 => (1.0 - p.x - p.y, p.y),
        _ => (p.x, 1.0 - p.y),
    };
    (off.abs() <= ON).then_some(place)
}

impl Part {
    fn edges(&self) -> impl Iterator<Item = (DVec2, DVec2, bool)> + '_ {
        let n = self.corners.len();
        (0..n).map(move |k| (self.corners[k], self.corners[(k + 1) % n], self.stood_on[k]))
    }

    /// Its parts on both sides of the straight line through a segment, if the segment enters it.
    fn split(self, [from, to]: [DVec2; 2], into: &mut Vec<Self>) {
        let along = (to - from).normalize_or_zero();
        let height = |p: DVec2| along.perp_dot(p - from);
        let (low, high) = (0.0, (to - from).dot(along));
        let place = |p: DVec2| (p - from).dot(along);
        let heights: Vec<f64> = self.corners.iter().map(|&p| height(p)).collect();
        let is_split = heights.iter().any(|h| *h > ON) && heights.iter().any(|h| *h < -ON);
        if !is_split {
            into.push(self.with_wall([from, to], &heights));
            return;
        }
        // Where the straight line crosses the part.
        let n = self.corners.len();
        let crossing = |k: usize| {
            let (a, b) = (heights[k], heights[(k + 1) % n]);
            let (p, q) = (self.corners[k], self.corners[(k + 1) % n]);
            (a * b < 0.0 && a.abs() > ON && b.abs() > ON).then(|| p.lerp(q, a / (a - b)))
        };
        let on = |k: usize| (heights[k].abs() <= ON).then_some(self.corners[k]);
        let mut ends: Vec<DVec2> = (0..n).flat_map(|k| [on(k), crossing(k)]).flatten().collect();
        ends.sort_by(|a, b| place(*a).total_cmp(&place(*b)));
        let (Some(&first), Some(&last)) = (ends.first(), ends.last()) else {
            into.push(self);
            return;
        };
        let (begin, end) = (place(first).max(low), place(last).min(high));
        if end - begin <= ON {
            into.push(self);
            return;
        }
        // Along the cut: free, stood on, free.
        let mut stops = vec![(first, begin - place(first) <= ON)];
        if begin - place(first) > ON {
            stops.push((from + along * begin, true));
        }
        if place(last) - end > ON {
            stops.push((from + along * end, false));
        }
        for above in [true, false] {
            let sign = if above { 1.0 } else { -1.0 };
            let mut half = Self { corners: Vec::new(), stood_on: Vec::new() };
            for k in 0..n {
                if heights[k] * sign > ON {
                    half.corners.push(self.corners[k]);
                    half.stood_on.push(self.stood_on[k]);
                }
                let leaves = heights[k] * sign > ON && heights[(k + 1) % n] * sign <= ON;
                let enters = heights[k] * sign <= ON && heights[(k + 1) % n] * sign > ON;
                if leaves {
                    // The part above runs the cut forwards or backwards, as its corners turn.
                    let at = on((k + 1) % n).or_else(|| crossing(k)).unwrap_or(last);
                    let forwards = at.distance_squared(first) < at.distance_squared(last);
                    let count = stops.len();
                    for i in 0..count {
                        let (corner, stood_on) = if forwards {
                            stops[i]
                        } else {
                            // The end of a stretch begins it.
                            let end = if i == 0 { last } else { stops[count - i].0 };
                            (end, stops[count - 1 - i].1)
                        };
                        half.corners.push(corner);
                        half.stood_on.push(stood_on);
                    }
                }
                if enters {
                    let at = on(k).or_else(|| crossing(k)).unwrap_or(first);
                    half.corners.push(at);
                    half.stood_on.push(self.stood_on[k]);
                }
            }
            into.push(half);
        }
    }

    /// It, with a segment that may lie on its edges.
    fn with_wall(self, [from, to]: [DVec2; 2], heights: &[f64]) -> Self {
        let (n, along) = (self.corners.len(), (to - from).normalize_or_zero());
        if (0..n).all(|k| heights[k].abs() > ON || heights[(k + 1) % n].abs() > ON) {
            return self;
        }
        let place = |p: DVec2| (p - from).dot(along);
        let length = from.distance(to);
        let mut walled = Self { corners: Vec::new(), stood_on: Vec::new() };
        for (k, (a, b, stood_on)) in self.edges().enumerate() {
            walled.corners.push(a);
            walled.stood_on.push(stood_on);
            let on = heights[k].abs() <= ON && heights[(k + 1) % n].abs() <= ON;
            let (begin, end) = (place(a).clamp(0.0, length), place(b).clamp(0.0, length));
            if !on || stood_on || (end - begin).abs() <= ON {
                continue;
            }
            if (begin - place(a)).abs() <= ON {
                walled.stood_on.pop();
            } else {
                walled.corners.push(from + along * begin);
            }
            walled.stood_on.push(true);
            if (place(b) - end).abs() > ON {
                walled.corners.push(from + along * end);
                walled.stood_on.push(false);
            }
        }
        walled
    }

    /// Triangles of it: a fan from a corner, or from within where corners lie on straight edges.
    fn triangles(&self) -> Vec<Cut> {
        let n = self.corners.len();
        let turn = |k: usize| {
            let [a, b, c] = [0, 1, 2].map(|i| self.corners[(k + i) % n]);
            (b - a).perp_dot(c - b)
        };
        let edges: Vec<_> = self.edges().collect();
        if n == 3 || (0..n).all(|k| turn(k) > ON * ON) {
            let fan = |k: usize| {
                let (a, b, stood_on) = edges[k];
                let hub = self.corners[0];
                ([hub, a, b], [k == 1 && edges[0].2, stood_on, k == n - 2 && edges[n - 1].2])
            };
            return (1..n - 1).map(fan).collect();
        }
        let centre = self.corners.iter().sum::<DVec2>() / n as f64;
        edges.iter().map(|&(a, b, stood_on)| ([centre, a, b], [false, stood_on, false])).collect()
    }
}

/// Parts get the corners of others that lie on their edges, so that no crack opens.
fn share_corners(parts: &mut [Part]) {
    let all: Vec<DVec2> = parts.iter().flat_map(|p| p.corners.clone()).collect();
    if all.len() > MOST_CORNERS {
        return;
    }
    for part in parts {
        let mut shared = Part { corners: Vec::new(), stood_on: Vec::new() };
        for (a, b, stood_on) in part.edges() {
            let (way, length) = ((b - a).normalize_or_zero(), a.distance(b));
            let mut stops: Vec<f64> = all
                .iter()
                .filter(|p| way.perp_dot(**p - a).abs() <= ON)
                .map(|p| (*p - a).dot(way))
                .filter(|t| *t > SAME && *t < length - SAME)
                .collect();
            stops.sort_by(f64::total_cmp);
            stops.dedup_by(|a, b| *a - *b <= SAME);
            shared.corners.push(a);
            shared.stood_on.push(stood_on);
            for t in stops {
                shared.corners.push(a + way * t);
                shared.stood_on.push(stood_on);
            }
        }
        *part = shared;
    }
}

/// Barycentric coordinates of coordinates `uv`.
pub(super) fn barycentric(uv: DVec2) -> DVec3 {
    DVec3::new(1.0 - uv.x - uv.y, uv.x, uv.y)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(cuts: &[Cut]) -> f64 {
        cuts.iter().map(|([a, b, c], _)| 0.5 * (*b - *a).perp_dot(*c - *a)).sum()
    }

    #[test]
    fn parts_cover_the_triangle_whatever_cuts_it() {
        let at = DVec2::new;
        let leg = |x: f64, y: f64| {
            let corners = [at(x, y), at(x + 0.1, y), at(x + 0.1, y + 0.1), at(x, y + 0.1)];
            [0, 1, 2, 3].map(|k| [corners[k], corners[(k + 1) % 4]])
        };
        let mut lines: Vec<[DVec2; 2]> = vec![[at(0.5, 0.0), at(0.5, 0.2)]];
        lines.extend(leg(0.1, 0.1));
        lines.extend(leg(0.55, 0.05));
        // A wall of two panels.
        lines.extend([[at(0.3, 0.3), at(0.35, 0.35)], [at(0.35, 0.35), at(0.4, 0.4)]]);
        for count in 0..=lines.len() {
            let mut parts =
                Parts::new(lines[..count].iter().copied(), [true, false, false], |_| false);
            assert!(parts.on_edge(0).len() >= usize::from(count > 0), "the wall's foot");
            (0..3).for_each(|k| parts.put_on_edge(k, &[0.25, 0.75]));
            let cuts = parts.triangles();
            assert!((area(&cuts) - 0.5).abs() < 1e-12, "{count} lines");
            for ([a, b, c], _) in &cuts {
                assert!((*b - *a).perp_dot(*c - *a) > 1e-12, "none is empty or turned over");
            }
        }
        // What stands on edges is as long as the lines on them, from both sides, and the own edge.
        let stood_on: f64 = Parts::new(lines.iter().copied(), [true, false, false], |_| false)
            .triangles()
            .iter()
            .flat_map(|(c, s)| (0..3).map(move |k| (c[k].distance(c[(k + 1) % 3]), s[k])))
            .filter_map(|(length, stood_on)| stood_on.then_some(length))
            .sum();
        let drawn: f64 = lines.iter().map(|[a, b]| a.distance(*b)).sum();
        assert!((stood_on - 2.0 * drawn - 1.0).abs() < 1e-9, "{stood_on} of {drawn}");
    }
}
