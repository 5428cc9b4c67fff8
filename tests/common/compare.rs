//! The matrix of a mesh by the exact engine, against brute force.
//!
//! The statistics account for the noise of the rays: with d what a factor is off by and s the
//! standard error of the reference, Σ (d² - s²) is what the engine itself errs by.

#![allow(clippy::print_stdout, reason = "figures for people, shown with --nocapture")]

use std::collections::BTreeSet;
use std::time::Instant;

use hemicube::matrix::Rows;
use hemicube::scene::builtin::Mesh;
use hemicube::{MatrixOptions, Silent};

use super::contour::exchange;
use super::meshes::scene_of;
use super::random::Random;
use super::reference::{Pair, Tracer, pair, row};

/// Independent turns of each pair: a standard error from fewer has no normal distribution.
const TURNS: u32 = 32;

/// Rays of all rows together for each of the points of a pair.
const ROW_RAYS: u32 = 1 << 11;

/// At most so many rows: a mesh of few large faces has all of its rows checked.
const MOST_ROWS: usize = 160;

/// An engine that states less than a tenth of the error asked for is held to that.
const LEAST_STATED: f64 = 1e-4;

/// The fraction of pairs that must lie within twice both errors.
const WITHIN: f64 = 0.93;

/// No factor is off by more than so many times both errors, that of the engine as a fraction of the
/// factor if this is more than the root mean square of all.
const GROSS: f64 = 6.0;

/// What may be measured as a multiple of what is stated: a root mean square over some hundred
/// pairs, most of it from few of them, is itself not known better.
const MOST_OF_STATED: f64 = 1.5;

/// What is asked of each mesh: pairs, and pairs of points in each of the turns.
struct Effort {
    pairs: usize,
    points: u32,
}

fn effort() -> Effort {
    let Ok(asked) = std::env::var("HEMICUBE_BRUTE_FORCE") else {
        return Effort { pairs: 90, points: 256 };
    };
    let (pairs, points) = asked.split_once(',').unwrap();
    Effort { pairs: pairs.parse().unwrap(), points: points.parse().unwrap() }
}

/// The matrix of a mesh, every entry.
pub struct Made {
    pub factors: Vec<Vec<f64>>,
    /// What the engine says it errs by, as a fraction of the root mean square.
    pub stated: f64,
    /// Root mean square of all factors that are not zero.
    pub rms: f64,
    seconds: f64,
}

/// Has the exact engine make the matrix of a mesh.
pub fn make(mesh: &Mesh) -> Made {
    let start = Instant::now();
    let scene = scene_of(mesh);
    let matrix = scene.form_factors(&MatrixOptions::default(), &Silent).unwrap();
    let seconds = start.elapsed().as_secs_f64();
    let n = mesh.triangles.len();
    assert_eq!(matrix.len(), n);
    let (mut columns, mut values) = (Vec::new(), Vec::new());
    let factors: Vec<Vec<f64>> = (0..n)
        .map(|i| {
            let mut dense = vec![0.0; n];
            matrix.row(i, &mut columns, &mut values).unwrap();
            columns.iter().zip(&values).for_each(|(&j, &f)| dense[j as usize] = f);
            dense
        })
        .collect();
    let entries = factors.iter().flatten().filter(|f| **f > 0.0).count();
    let squares: f64 = factors.iter().flatten().map(|f| f * f).sum();
    let stated = matrix.report.pairs.unwrap().error.max(LEAST_STATED);
    Made { factors, stated, rms: (squares / entries.max(1) as f64).sqrt(), seconds }
}

/// Pairs of triangles to look at, in turn drawn in proportion to what they exchange, to what they
/// would exchange if nothing were in between, and uniformly among those that face each other.
fn draw(tracer: &Tracer, count: usize, random: &mut Random) -> BTreeSet<[usize; 2]> {
    let mut all = 0.0;
    let cumulative: Vec<f64> = (0..tracer.len())
        .map(|i| {
            all += tracer.area(i);
            all
        })
        .collect();
    let mut pairs = BTreeSet::new();
    // Where few triangles see each other, there are fewer pairs than asked for.
    for turn in 0..200 * count {
        if pairs.len() == count {
            break;
        }
        let at = random.number() * all;
        let i = cumulative.partition_point(|&sum| sum <= at).min(tracer.len() - 1);
        let from = tracer.point(i, random.number(), random.number());
        let direction = random.diffuse(tracer.normal(i));
        let j = match turn % 3 {
            0 => tracer.first(from, direction, i).filter(|h| h.front).map(|h| h.triangle),
            1 => {
                let fronts = tracer.fronts(from, direction, i);
                (!fronts.is_empty()).then(|| fronts[random.below(fronts.len())])
            }
            _ => {
                let j = random.below(tracer.len());
                let faces = exchange(&tracer.corners(i), &tracer.corners(j)) > 0.0;
                (i != j && faces).then_some(j)
            }
        };
        pairs.extend(j.filter(|&j| !tracer.touch(i, j)).map(|j| [i, j]));
    }
    pairs
}

/// Sums over all that is compared.
#[derive(Default)]
struct Sums {
    count: usize,
    within: usize,
    gross: usize,
    off: f64,
    noise: f64,
    noise_squares: f64,
    squares: f64,
    /// By how much most more than the noise, and which.
    worst: (f64, String),
}

impl Sums {
    /// Counts in a factor that is `known` by the reference with a standard error of at most `s`;
    /// `variance` is the expectation of what the noise adds to the square of the deviation.
    fn add(&mut self, made: &Made, [i, j]: [usize; 2], [known, s, variance]: [f64; 3]) {
        let found = made.factors[i][j];
        let d = found - known;
        self.count += 1;
        self.within += usize::from(d.abs() <= 2.0 * (s + made.stated * made.rms));
        let size = made.rms.max(found).max(known);
        self.gross += usize::from(d.abs() > GROSS * (s + made.stated * size));
        self.off += d * d;
        self.noise += variance;
        self.noise_squares += s.powi(4);
        self.squares += known * known;
        if d.abs() - 2.0 * s > self.worst.0 {
            let what = format!("{i}, {j}: {found:.3e}, by rays {known:.3e} ± {s:.0e}");
            self.worst = (d.abs() - 2.0 * s, what);
        }
    }

    /// RMS of what factors are off by over RMS of factors, without the noise of the reference; and
    /// what of it the reference leaves open, twice its standard error.
    fn deviation(&self) -> [f64; 2] {
        let open = 2.0 * (2.0 * self.noise_squares).sqrt();
        let squares = self.squares.max(f64::MIN_POSITIVE);
        [(self.off - self.noise).max(0.0), open].map(|x| (x / squares).sqrt())
    }

    fn share(&self) -> f64 {
        self.within as f64 / self.count.max(1) as f64
    }
}

/// Whether a pair exchanges more than the engine may err by although no ray arrives.
fn shines(p: &Pair, made: &Made, found: f64, area: f64) -> bool {
    /// So few rays that one may have been missed say nothing.
    const CERTAIN: u64 = 4000;
    /// Of N rays that all fail, the true fraction is below 3 / N with 95 % certainty.
    const UNSEEN: f64 = 3.0;
    let [rays, arrived] = p.rays;
    let unseen = UNSEEN / rays.max(1) as f64 * p.open / area;
    rays >= CERTAIN && arrived == 0 && found > 2.0 * made.stated * made.rms + unseen
}

/// Whole rows by diffuse rays; of how many rows the sum is as it should be, and how many there are.
fn compare_rows(
    tracer: &Tracer,
    made: &Made,
    effort: &Effort,
    random: &mut Random,
) -> (Sums, [usize; 2]) {
    let mut sums = Sums::default();
    let rows: Vec<usize> = match tracer.len() {
        n if n <= MOST_ROWS => (0..n).collect(),
        n => (0..MOST_ROWS).map(|_| random.below(n)).collect(),
    };
    let mut fine = 0;
    let rays = ROW_RAYS * effort.points / rows.len() as u32;
    let fraction = |count: u32| f64::from(count) / f64::from(rays);
    let error = |f: f64| (f * (1.0 - f).max(0.0) / f64::from(rays)).sqrt();
    for &i in &rows {
        let seen = row(tracer, i, rays, random);
        // Rounding decides which side of what covers a triangle is seen.
        let others = (0..tracer.len()).filter(|&j| !tracer.touch(i, j));
        let (mut arrive, mut sum) = (0.0, 0.0);
        for j in others {
            let (f, found) = (fraction(seen.fronts[j]), made.factors[i][j]);
            // Where few rays arrive they know little of their own noise.
            let s = error(found.max(f).min(1.0));
            sums.add(made, [i, j], [f, s, error(f).powi(2)]);
            (arrive, sum) = (arrive + f, sum + found);
        }
        fine += usize::from((sum - arrive).abs() <= 3.0 * error(arrive) + 2.0 * made.stated);
    }
    (sums, [fine, rows.len()])
}

/// Compares the matrix of a mesh with brute force, prints a line, and fails with all that is wrong.
pub fn check(name: &str, mesh: &Mesh) {
    let effort = effort();
    let corners = |t: &[u32; 3]| t.map(|v| mesh.vertices[v as usize]);
    let tracer = Tracer::new(mesh.triangles.iter().map(corners).collect());
    let made = make(mesh);
    let mut random = Random::new(7);
    let start = Instant::now();
    let (mut pairs, mut dark) = (Sums::default(), 0);
    for [i, j] in draw(&tracer, effort.pairs, &mut random) {
        let p = pair(&tracer, [i, j], [TURNS, effort.points], &mut random);
        let (area, found) = (tracer.area(i), made.factors[i][j]);
        let [known, s] = [p.exchange, p.error].map(|x| x / area);
        pairs.add(&made, [i, j], [known, s, s * s]);
        dark += usize::from(shines(&p, &made, found, area));
    }
    let (rows, [fine, of]) = compare_rows(&tracer, &made, &effort, &mut random);
    let largest = made.factors.iter().map(|r| r.iter().sum::<f64>()).fold(0.0, f64::max);
    let ([rms, open], [rms_rows, open_rows]) = (pairs.deviation(), rows.deviation());
    let gross = pairs.gross + rows.gross;
    let percent = |x: f64| format!("{:.3}", 100.0 * x);
    println!(
        "| {name} | {} | {:.1} + {:.1} | {} of {} | {} ± {} | {} | {} ± {} | {fine} of {of} | \
         {gross} | {largest:.5} | {dark} | {} | {} |",
        mesh.triangles.len(),
        made.seconds,
        start.elapsed().as_secs_f64(),
        pairs.within,
        pairs.count,
        percent(rms),
        percent(open),
        percent(made.stated),
        percent(rms_rows),
        percent(open_rows),
        pairs.worst.1,
        rows.worst.1,
    );
    let most = (MOST_OF_STATED * made.stated).powi(2);
    let rows_within = fine as f64 / of.max(1) as f64;
    let mut wrong = Vec::new();
    let mut must = |fine: bool, what: String| wrong.extend((!fine).then_some(what));
    must(pairs.share() >= WITHIN, format!("{:.3} of pairs within both errors", pairs.share()));
    must(rms * rms <= most + open * open, format!("RMS of pairs {rms:.1e} ± {open:.0e}"));
    must(
        rms_rows.powi(2) <= most + open_rows.powi(2),
        format!("RMS of rows {rms_rows:.1e} ± {open_rows:.0e}"),
    );
    must(rows_within >= WITHIN, format!("{fine} of {of} sums of rows"));
    must(largest <= 1.0 + made.stated, format!("a row sums to {largest:.5}"));
    must(gross == 0, format!("{gross} factors are grossly wrong"));
    must(dark == 0, format!("{dark} pairs exchange what no ray does"));
    let worst = [&pairs.worst.1, &rows.worst.1];
    assert!(wrong.is_empty(), "{name}, stated {:.1e}: {wrong:#?}, worst {worst:#?}", made.stated);
}
