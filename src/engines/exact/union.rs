//! What one point does not see of a triangle because of several polygons, which may overlap: all of
//! them are subtracted from it, one after the other, and what is left has a closed form.

use glam::DVec3;

use crate::form_factors::kernel::point_to_polygon;
use crate::scene::clip::crossing;

/// More parts than this are left to other methods.
const MOST_PARTS: usize = 128;

/// Heights below this fraction of the numbers they come from are none.
const NOISE: f64 = 1e-12;

/// What is left of a triangle, in convex parts about the point; reused.
#[derive(Debug, Default)]
pub(super) struct Parts {
    now: Vec<Vec<DVec3>>,
    next: Vec<Vec<DVec3>>,
    spare: Vec<Vec<DVec3>>,
    planes: Vec<DVec3>,
}

/// Fraction of the form factor from `point`, in a plane with this normal, to the triangle `target`
/// that convex polygons hide, which lie in front of both planes. `None` if that takes too many
/// parts, or nothing of the target is above the horizon.
pub(super) fn hidden<'a>(
    (point, normal): (DVec3, DVec3),
    target: [DVec3; 3],
    polygons: impl Iterator<Item = &'a [DVec3]>,
    parts: &mut Parts,
) -> Option<f64> {
    let all = point_to_polygon(point, normal, &target);
    if all <= 0.0 {
        return None;
    }
    let Parts { now, next, spare, planes } = parts;
    spare.append(now);
    let mut whole = spare.pop().unwrap_or_default();
    whole.clear();
    whole.extend(target.map(|c| c - point));
    now.push(whole);
    for polygon in polygons {
        planes_about(polygon, point, planes);
        for part in now.drain(..) {
            subtract(part, planes, next, spare);
        }
        std::mem::swap(now, next);
        if now.is_empty() {
            return Some(1.0);
        }
        if now.len() > MOST_PARTS {
            return None;
        }
    }
    let seen: f64 = now.iter().map(|part| point_to_polygon(DVec3::ZERO, normal, part)).sum();
    Some((1.0 - seen / all).clamp(0.0, 1.0))
}

/// Inward normals of the planes through the point and each edge of a polygon.
fn planes_about(polygon: &[DVec3], point: DVec3, planes: &mut Vec<DVec3>) {
    planes.clear();
    let middle = polygon.iter().sum::<DVec3>() / polygon.len() as f64 - point;
    for (k, &from) in polygon.iter().enumerate() {
        let to = polygon[(k + 1) % polygon.len()];
        let normal = (from - point).cross(to - point);
        let normal = if normal.dot(middle) < 0.0 { -normal } else { normal };
        if normal != DVec3::ZERO {
            planes.push(normal);
        }
    }
}

/// Adds to `left` what of a convex part lies outside of a cone.
fn subtract(
    part: Vec<DVec3>,
    planes: &[DVec3],
    left: &mut Vec<Vec<DVec3>>,
    spare: &mut Vec<Vec<DVec3>>,
) {
    let size = |v: DVec3| v.abs().max_element();
    let noise = NOISE * part.iter().fold(DVec3::ZERO, |m, r| m.max(r.abs())).max_element();
    let outside = |n: DVec3| {
        let noise = noise * size(n);
        part.iter().all(|&r| n.dot(r) <= noise)
    };
    if planes.len() < 3 || planes.iter().any(|&n| outside(n)) {
        left.push(part);
        return;
    }
    let mut rest = part;
    for &n in planes {
        let noise = noise * size(n);
        let height = |r: DVec3| {
            let h = n.dot(r);
            if h.abs() <= noise { 0.0 } else { h }
        };
        if rest.iter().all(|&r| height(r) >= 0.0) {
            continue;
        }
        let (mut within, mut beyond) =
            (spare.pop().unwrap_or_default(), spare.pop().unwrap_or_default());
        within.clear();
        beyond.clear();
        let Some(&last) = rest.last() else { break };
        let mut from = (last, height(last));
        for &corner in &rest {
            let to = (corner, height(corner));
            if let Some(p) = crossing(from, to) {
                within.push(p);
                beyond.push(p);
            }
            if to.1 >= 0.0 {
                within.push(corner);
            }
            if to.1 <= 0.0 {
                beyond.push(corner);
            }
            from = to;
        }
        if beyond.len() > 2 {
            left.push(beyond);
        } else {
            spare.push(beyond);
        }
        spare.push(std::mem::replace(&mut rest, within));
        if rest.len() < 3 {
            break;
        }
    }
    spare.push(rest);
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::dvec3;

    /// A rectangle at height `z`.
    fn level([x0, x1]: [f64; 2], [y0, y1]: [f64; 2], z: f64) -> Vec<DVec3> {
        vec![dvec3(x0, y0, z), dvec3(x1, y0, z), dvec3(x1, y1, z), dvec3(x0, y1, z)]
    }

    fn fraction(polygons: &[Vec<DVec3>]) -> f64 {
        let target = [dvec3(-9.0, -9.0, 2.0), dvec3(9.0, -9.0, 2.0), dvec3(0.0, 19.0, 2.0)];
        let polygons = polygons.iter().map(Vec::as_slice);
        hidden((DVec3::ZERO, DVec3::Z), target, polygons, &mut Parts::default()).unwrap()
    }

    #[test]
    fn what_overlaps_counts_once() {
        let a = level([-0.5, 0.2], [-0.3, 0.4], 1.0);
        let b = level([-0.1, 0.6], [-0.2, 0.7], 1.0);
        let both = level([-0.1, 0.2], [-0.2, 0.4], 1.0);
        let expected = fraction(std::slice::from_ref(&a)) + fraction(std::slice::from_ref(&b))
            - fraction(&[both]);
        let found = fraction(&[a.clone(), b.clone()]);
        assert!((found - expected).abs() < 1e-12, "{found} {expected}");
        // In another order, at another distance, and the same again.
        let far = b.iter().map(|p| p * 1.5).collect();
        let again = fraction(&[far, a.clone(), b, a]);
        assert!((again - expected).abs() < 1e-12, "{again} {expected}");
    }

    #[test]
    fn neighbours_add_up() {
        let halves = [level([-0.5, 0.1], [-0.3, 0.4], 1.0), level([0.1, 0.2], [-0.3, 0.4], 1.0)];
        let whole = fraction(&[level([-0.5, 0.2], [-0.3, 0.4], 1.0)]);
        assert!((fraction(&halves) - whole).abs() < 1e-12);
        assert!(whole > 0.05);
    }
}
