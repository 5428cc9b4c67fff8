//! The exchange of two polygons by Stokes' theorem on both (Sparrow 1963, "A new and simpler
//! formulation for radiative angle factors"), which holds for polygons that touch, share an edge or
//! nearly so:
//!
//! ```text
//! S = 1/2π Σ_e Σ_f ê·f̂ ∫_e ∫_f ln r ds dt
//! ```
//!
//! The inner integral has a closed form; the outer one is summed by Gauss' rule with points drawn
//! towards the ends, where it may have a singular derivative, and halved until two rules agree.

use std::f64::consts::TAU;

use glam::DVec3;

use super::polygon::Polygon;

/// How often an edge is halved at most.
const DEEPEST: u32 = 16;

/// A directed edge: where it begins, its unit direction, its length.
struct Edge {
    from: DVec3,
    along: DVec3,
    length: f64,
}

fn edges(p: &Polygon) -> impl Iterator<Item = Edge> + '_ {
    let corners = p.corners();
    (0..corners.len()).filter_map(|k| {
        let (from, to) = (corners[k], corners[(k + 1) % corners.len()]);
        let length = from.distance(to);
        (length > 0.0).then(|| Edge { from, along: (to - from) / length, length })
    })
}

/// S in m² of two polygons that lie in front of each other; each pair of edges may err by
/// `tolerance`.
pub(super) fn by_contours(a: &Polygon, b: &Polygon, tolerance: f64) -> f64 {
    let mut sum = 0.0;
    for e in edges(a) {
        for f in edges(b) {
            let cosine = e.along.dot(f.along);
            if cosine.abs() > 1e-14 {
                let (outer, inner) = if e.length <= f.length { (&e, &f) } else { (&f, &e) };
                sum += cosine * between(outer, inner, tolerance);
            }
        }
    }
    sum / TAU
}

/// `∫_e ∫_f ln r dt ds`, less the length of f times that of e: around closed contours that adds up
/// to nothing.
fn between(e: &Edge, f: &Edge, tolerance: f64) -> f64 {
    // The integrand may bend where e passes by an end of f.
    let mut cuts = [0.0, 0.0, 0.0, e.length];
    let mut count = 1;
    for end in [f.from, f.from + f.along * f.length] {
        let s = e.along.dot(end - e.from);
        if s > 1e-9 * e.length && s < e.length * (1.0 - 1e-9) {
            cuts[count] = s;
            count += 1;
        }
    }
    if count == 3 && cuts[1] > cuts[2] {
        cuts.swap(1, 2);
    }
    cuts[count] = e.length;
    (0..count).map(|k| piece(e, f, cuts[k], cuts[k + 1], tolerance, DEEPEST)).sum()
}

fn piece(e: &Edge, f: &Edge, from: f64, to: f64, tolerance: f64, depth: u32) -> f64 {
    let coarse = graded(e, f, from, to, &GAUSS_8);
    let fine = graded(e, f, from, to, &GAUSS_12);
    if (fine - coarse).abs() <= tolerance || depth == 0 {
        return fine;
    }
    let middle = 0.5 * (from + to);
    piece(e, f, from, middle, 0.5 * tolerance, depth - 1)
        + piece(e, f, middle, to, 0.5 * tolerance, depth - 1)
}

/// Positive points and weights of Gauss' rule on -1..1.
const GAUSS_8: [(f64, f64); 4] = [
    (0.183_434_642_495_649_8, 0.362_683_783_378_361_9),
    (0.525_532_409_916_329, 0.313_706_645_877_887_3),
    (0.796_666_477_413_626_7, 0.222_381_034_453_374_5),
    (0.960_289_856_497_536_3, 0.101_228_536_290_376_3),
];

const GAUSS_12: [(f64, f64); 6] = [
    (0.125_233_408_511_468_9, 0.249_147_045_813_402_8),
    (0.367_831_498_998_180_2, 0.233_492_536_538_354_8),
    (0.587_317_954_286_617_4, 0.203_167_426_723_065_9),
    (0.769_902_674_194_304_7, 0.160_078_328_543_346_2),
    (0.904_117_256_370_474_9, 0.106_939_325_995_318_4),
    (0.981_560_634_246_719_2, 0.047_175_336_386_511_8),
];

/// Gauss' rule in t with s = from + (to - from) t³ (10 - 15 t + 6 t²), which is flat at both ends.
fn graded(e: &Edge, f: &Edge, from: f64, to: f64, rule: &[(f64, f64)]) -> f64 {
    let mut sum = 0.0;
    for &(x, w) in rule {
        for t in [0.5 - 0.5 * x, 0.5 + 0.5 * x] {
            let s = from + (to - from) * t * t * t * (10.0 - 15.0 * t + 6.0 * t * t);
            let slope = 30.0 * t * t * (1.0 - t) * (1.0 - t);
            sum += w * slope * logarithm(e.from + e.along * s, f);
        }
    }
    0.5 * (to - from) * sum
}

/// `∫_f ln r dt` from a point, plus the length of f.
fn logarithm(x: DVec3, f: &Edge) -> f64 {
    let to = f.from - x;
    let u0 = f.along.dot(to);
    let u1 = u0 + f.length;
    let h2 = (to - f.along * u0).length_squared();
    let part = |u: f64| {
        let r2 = u * u + h2;
        if r2 > 0.0 { 0.5 * u * r2.ln() } else { 0.0 }
    };
    let h = h2.sqrt();
    let angle = if h > 0.0 { (h * f.length).atan2(h2 + u0 * u1) } else { 0.0 };
    part(u1) - part(u0) + h * angle
}
