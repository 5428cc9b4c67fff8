//! A hierarchy over emitting sides, and cuts through it: for receivers that lie together, the few
//! nodes that stand for all emitters (Walter et al. 2005, "Lightcuts", where cuts are chosen by a
//! bound of their error too).

use std::f32::consts::{FRAC_PI_2, PI};
use std::ops::Range;

use glam::{DVec3, Vec3};

use super::cut::Cut;
use super::lanes::{Entry, NEAR, NEAREST, brightness, suitable};
use super::receiver::Receiver;
use super::sources::{Source, Unit, halve};
use crate::scene::Rgb;
use crate::visibility::Bvh;

/// A node stands for its sources where it is farther than this many times the root of its area, and
/// than this many times its radius: its centre then errs by less than a thousandth.
const FAR: f32 = 20.0;

/// Largest ratio of radiances that a mean stands for.
const ALIKE: f64 = 2.0;

/// What rounding may add to a distance or an angle.
const MARGIN: f32 = 1e-3;

/// Emitting sides that lie together, in coordinates of the hierarchy of boxes.
#[derive(Debug, Clone)]
struct Node {
    sources: Range<u32>,
    /// Where the nodes after its subtree begin; its first child is the next node.
    end: u32,
    /// As a whole: its normal is the mean by area, so shorter than 1.
    whole: Entry,
    /// Largest angle between the direction of the mean normal and any.
    bend: f32,
    /// Radius of a ball about the centre that holds all units that sources belong to.
    reach: f32,
    /// Largest radius and area of these units.
    largest: (f32, f32),
    /// Whether all send nearly the same radiance.
    alike: bool,
}

/// The hierarchy of one scene's emitting sides.
#[derive(Debug, Default)]
pub(super) struct Tree {
    nodes: Vec<Node>,
    /// First node of each group.
    roots: Vec<u32>,
    /// Areas of all sources before each, and of all.
    areas: Vec<f64>,
    /// Each source as an entry.
    leaves: Vec<Entry>,
}

/// Where receivers of a cut lie, and how they are turned.
#[derive(Debug, Clone, Copy)]
struct Receivers {
    centre: Vec3,
    radius: f32,
    normal: Vec3,
    /// Largest angle of a normal from the mean.
    bend: f32,
    /// What [`suitable`] asks for at most.
    clear: f32,
    largest: f32,
}

impl Receivers {
    fn of(all: &[Receiver]) -> Self {
        let count = all.len().max(1) as f32;
        let centre = all.iter().map(|r| r.centre).sum::<Vec3>() / count;
        let normal = all.iter().map(|r| r.normal).sum::<Vec3>().normalize_or_zero();
        let most = |of: &dyn Fn(&Receiver) -> f32| all.iter().map(of).fold(0.0, f32::max);
        Self {
            centre,
            radius: most(&|r| (r.centre - centre).length() + r.radius),
            normal,
            bend: most(&|r| r.normal.dot(normal).clamp(-1.0, 1.0).acos() + r.bend.asin()),
            clear: most(&|r| r.radius + NEAREST * r.size),
            largest: all.iter().map(|r| r.largest).fold(f32::INFINITY, f32::min),
        }
    }
}

/// What is known of a node and receivers.
#[derive(PartialEq)]
enum Sight {
    /// All points of one face all points of the other.
    Whole,
    /// None do.
    None,
    /// Nothing is.
    Unknown,
}

impl Tree {
    /// Over groups of sources, which it sorts so that each node's are neighbours; `unit` is what
    /// each belongs to.
    pub fn new(
        bvh: &Bvh,
        sources: &mut [Source],
        groups: &[Range<usize>],
        unit: impl Fn(&Source) -> Unit,
    ) -> Self {
        let mut ranges = Vec::new();
        let roots = groups
            .iter()
            .map(|group| {
                let root = ranges.len() as u32;
                divide(sources, group.clone(), &mut ranges);
                root
            })
            .collect();
        let units: Vec<Unit> = sources.iter().map(unit).collect();
        let leaves: Vec<Entry> =
            sources.iter().zip(&units).map(|(s, unit)| Entry::of(bvh, s, unit)).collect();
        let nodes = ranges
            .into_iter()
            .map(|(range, end)| {
                let (own, units) = (&sources[range.clone()], &units[range.clone()]);
                node(bvh, own, units, &leaves[range.clone()], (range, end))
            })
            .collect();
        let mut areas = vec![0.0];
        for s in sources.iter() {
            areas.push(areas[areas.len() - 1] + s.area);
        }
        Self { nodes, roots, areas, leaves }
    }

    /// Whether source `k` is analytic for a receiver.
    pub fn is_suitable(&self, receiver: &Receiver, k: usize) -> bool {
        let Entry { unit: (centre, normal, radius, area), .. } = self.leaves[k];
        suitable(receiver, centre.to_array(), normal.to_array(), radius, area)
    }

    /// The source of a range below which a fraction (0..1) of its area lies.
    pub fn at_fraction(&self, (start, end): (u32, u32), fraction: f64) -> usize {
        let areas = &self.areas[start as usize..=end as usize];
        let target = areas[0] + fraction * (areas[areas.len() - 1] - areas[0]);
        let at = areas.partition_point(|a| *a <= target).clamp(1, areas.len() - 1);
        start as usize + at - 1
    }

    /// A source drawn for a point, about in proportion to what may arrive from it, by a number of
    /// 0..1, and the chance that it had (Conty Estevez & Kulla 2018, "Importance sampling of many
    /// lights with adaptive tree splitting"); `None` if all lie below the point's horizon.
    pub fn choose(&self, point: Vec3, normal: Vec3, x: f32) -> Option<(usize, f32)> {
        let may = |node: u32| self.nodes[node as usize].may_send(point, normal);
        let sum: f32 = self.roots.iter().map(|&r| may(r)).sum();
        let mut rest = x * sum;
        let (mut at, mut chance) = (None, 0.0);
        for &root in &self.roots {
            let weight = may(root);
            if weight > 0.0 {
                (at, chance) = (Some(root), weight / sum);
                if rest < weight {
                    rest /= weight;
                    break;
                }
                rest -= weight;
            }
        }
        let mut at = at?;
        let mut x = rest.clamp(0.0, 1.0);
        while self.nodes[at as usize].sources.len() > 1 {
            let halves = [at + 1, self.nodes[at as usize + 1].end];
            let [a, b] = halves.map(may);
            let first = a / (a + b);
            if first.is_nan() {
                return None;
            }
            let second = x >= first;
            let share = if second { 1.0 - first } else { first };
            x = (if second { x - first } else { x }) / share;
            chance *= share;
            at = halves[usize::from(second)];
        }
        Some((self.nodes[at as usize].sources.start as usize, chance))
    }

    /// Where a source is near a point, its centre cannot stand for it.
    pub fn is_near(&self, k: usize, point: Vec3) -> bool {
        let Entry { centre, area, .. } = self.leaves[k];
        (centre - point).length_squared() < NEAR * NEAR * area
    }

    /// The nodes that stand for all emitters; `all`: each emitter is analytic for each receiver.
    pub fn cut(&self, receivers: &[Receiver], all: bool, cut: &mut Cut) {
        cut.clear();
        let here = Receivers::of(receivers);
        for (number, &root) in self.roots.iter().enumerate() {
            let first = cut.begin();
            let (mut at, end) = (root as usize, self.nodes[root as usize].end as usize);
            while at < end {
                let node = &self.nodes[at];
                let (d, distance) = node.way(&here);
                let sight = node.sight(&here, d, distance);
                let leaf = node.sources.len() == 1;
                if sight == Sight::None {
                    at = node.end as usize;
                } else if leaf {
                    cut.push(&self.leaves[node.sources.start as usize], &node.sources, all);
                    at += 1;
                } else if sight == Sight::Whole
                    && node.alike
                    && node.is_far(&here, distance)
                    && (all || node.is_analytic(&here, distance))
                {
                    cut.push(&node.whole, &node.sources, true);
                    at = node.end as usize;
                } else {
                    at += 1;
                }
            }
            cut.end(number, first);
        }
    }
}

impl Node {
    /// From the middle of the receivers to its own, and how long that is.
    fn way(&self, here: &Receivers) -> (Vec3, f32) {
        let d = self.whole.centre - here.centre;
        (d, d.length())
    }

    /// About what may arrive at a point; nothing if it lies below the point's horizon as a whole.
    fn may_send(&self, point: Vec3, normal: Vec3) -> f32 {
        /// Of a node that hardly faces the point.
        const LEAST: f32 = 0.05;
        let Entry { centre, radius, area, luminance, .. } = self.whole;
        let way = centre - point;
        let above = normal.dot(way) + radius * (1.0 + MARGIN);
        if above <= 0.0 {
            return 0.0;
        }
        let squared = way.length_squared().max(0.25 * radius * radius).max(f32::MIN_POSITIVE);
        let distance = squared.sqrt();
        let here = (above / distance).clamp(LEAST, 1.0);
        let turned = 1.0 - self.whole.normal.length();
        let there = turned + (radius - self.whole.normal.dot(way)) / distance;
        luminance * area * here * there.clamp(LEAST, 1.0) / squared
    }

    fn sight(&self, here: &Receivers, d: Vec3, distance: f32) -> Sight {
        let blur = (self.whole.radius + here.radius) / distance;
        if blur >= 1.0 || blur.is_nan() {
            return Sight::Unknown;
        }
        let blur = blur.asin() + MARGIN;
        let angle = |normal: Vec3, way: Vec3| {
            let length = normal.length() * distance;
            if length > 0.0 { (normal.dot(way) / length).clamp(-1.0, 1.0).acos() } else { 0.0 }
        };
        let (there, here) = (
            (angle(self.whole.normal, -d), self.bend + blur),
            (angle(here.normal, d), here.bend + blur),
        );
        if there.0 - there.1 > FRAC_PI_2 || here.0 - here.1 > FRAC_PI_2 {
            Sight::None
        } else if there.0 + there.1 < FRAC_PI_2 && here.0 + here.1 < FRAC_PI_2 {
            Sight::Whole
        } else {
            Sight::Unknown
        }
    }

    fn is_far(&self, here: &Receivers, distance: f32) -> bool {
        let nearest = distance - here.radius;
        nearest > FAR * self.whole.radius && nearest > FAR * self.whole.area.sqrt()
    }

    /// Whether all units are analytic for all receivers, as [`suitable`] would say of each.
    fn is_analytic(&self, here: &Receivers, distance: f32) -> bool {
        let nearest = (distance - self.reach - here.radius) * (1.0 - MARGIN);
        nearest > self.largest.0 + here.clear
            && self.largest.1 < here.largest * PI * nearest * nearest
    }
}

/// Ranges of sources, each halved until one is left, and where the ranges after its halves begin.
fn divide(sources: &mut [Source], range: Range<usize>, found: &mut Vec<(Range<usize>, usize)>) {
    let own = found.len();
    found.push((range.clone(), 0));
    if range.len() > 1 {
        let middle = halve(sources, range.clone());
        divide(sources, range.start..middle, found);
        divide(sources, middle..range.end, found);
    }
    found[own].1 = found.len();
}

fn node(
    bvh: &Bvh,
    sources: &[Source],
    units: &[Unit],
    leaves: &[Entry],
    (range, end): (Range<usize>, usize),
) -> Node {
    let area: f64 = sources.iter().map(|s| s.area).sum();
    let mean = |of: &dyn Fn(&Source) -> DVec3| {
        sources.iter().map(|s| of(s) * s.area).sum::<DVec3>() / area.max(f64::MIN_POSITIVE)
    };
    let bright = |s: &Source| f64::from(brightness(s.radiance)) * s.area;
    // Where its light comes from.
    let middle = |s: &Source| s.corners.iter().sum::<DVec3>() / 3.0;
    let centre = sources.iter().map(|s| middle(s) * bright(s)).sum::<DVec3>()
        / sources.iter().map(bright).sum::<f64>().max(f64::MIN_POSITIVE);
    let normal = mean(&|s| s.normal);
    let axis = normal.normalize_or_zero();
    let farthest = |from: DVec3, corners: &mut dyn Iterator<Item = DVec3>| {
        corners.map(|c| (c - from).length()).fold(0.0, f64::max)
    };
    let radius = farthest(centre, &mut sources.iter().flat_map(|s| s.corners));
    let scale = bvh.scale();
    let reach =
        units.iter().map(|u| (u.centre - centre).length() + u.radius).fold(0.0, f64::max) / scale;
    let bend = sources.iter().map(|s| s.normal.dot(axis).clamp(-1.0, 1.0).acos());
    let radiance: Rgb = mean(&|s| s.radiance);
    let whole = Entry {
        centre: bvh.local(centre),
        normal: normal.as_vec3(),
        radius: (radius / scale) as f32,
        area: (area / (scale * scale)) as f32,
        radiance: radiance.as_vec3(),
        luminance: brightness(radiance),
        unit: leaves[0].unit,
    };
    let most = |of: &dyn Fn(&Entry) -> f32| leaves.iter().map(of).fold(0.0, f32::max);
    Node {
        sources: range.start as u32..range.end as u32,
        end: end as u32,
        whole,
        bend: bend.fold(0.0, f64::max) as f32,
        reach: reach as f32,
        largest: (most(&|e| e.unit.2), most(&|e| e.unit.3)),
        alike: (0..3).all(|c| {
            let all = || sources.iter().map(|s| s.radiance[c]);
            all().fold(0.0, f64::max) <= ALIKE * all().fold(f64::INFINITY, f64::min)
        }),
    }
}
