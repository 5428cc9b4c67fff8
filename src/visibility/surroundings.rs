//! What is seen all around a point: a first look at a scene of which nothing else is known.

use glam::{DVec2, DVec3};

use super::hemisphere::{DIRECTIONS, seen_from};
use super::item_buffer::{Edges, Face, ItemBuffer};
use super::occluders::{Frame, Occluders, View};
use super::{Bvh, NOTHING, each_face};
use crate::patches::SurfacePoint;
use crate::scene::{Geometry, Side, TriangleId};

/// One direction of sight.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Glimpse {
    /// Unit direction.
    pub direction: DVec3,
    /// Solid angle it stands for, in steradians.
    pub solid_angle: f64,
    /// The side seen, and its distance in metres; `None` for emptiness.
    pub hit: Option<(TriangleId, Side, f64)>,
}

/// The glimpses all around a point.
#[derive(Debug, Clone)]
pub struct Surroundings {
    glimpses: Vec<Glimpse>,
}

/// Pixels along the top of each of the two hemicubes: directions lie about 4 degrees apart.
const RESOLUTION: usize = 24;

impl Surroundings {
    /// Looks around from `point`; half of the glimpses look into the hemisphere about `up` (unit),
    /// and come first. The triangle `except` is not seen.
    #[must_use]
    pub fn of(occluders: &Occluders, point: DVec3, up: DVec3, except: Option<TriangleId>) -> Self {
        let mut glimpses = Vec::with_capacity(6 * RESOLUTION * RESOLUTION);
        let faces = Face::hemicube(RESOLUTION);
        let mut buffers: [ItemBuffer; 5] = Default::default();
        let mut view = View::default();
        for normal in [up, -up] {
            let frame = Frame::on_surface(point, normal);
            occluders.look(&frame, &mut view);
            for (buffer, face) in buffers.iter_mut().zip(&faces) {
                buffer.clear(face);
            }
            for (i, &id) in occluders.ids().iter().enumerate() {
                let seen_by = occluders.faces_in(&view, i);
                if seen_by == 0 || except == Some(id) {
                    continue;
                }
                let corners = occluders.corners_in(&view, i);
                let Some(edges) = Edges::new(corners) else { continue };
                let item = 2 * i as u32 + u32::from(edges.back);
                each_face!(F => if seen_by >> F & 1 == 1
                    && let Some(bounds) = faces[F].bounds::<F>(&corners)
                {
                    buffers[F].draw::<F>(&faces[F], bounds, &edges, item);
                });
            }
            each_face!(F => buffers[F].glimpses::<F>(&faces[F], &frame, |direction, item, far| {
                let length2 = direction.length_squared();
                let pixel = 4.0 / (RESOLUTION * RESOLUTION) as f64;
                let hit = (item != NOTHING).then(|| {
                    let side = if item & 1 == 1 { Side::Back } else { Side::Front };
                    (occluders.ids()[item as usize / 2], side, far)
                });
                glimpses.push(Glimpse {
                    direction: direction / length2.sqrt(),
                    solid_angle: pixel / (length2 * length2.sqrt()),
                    hit,
                });
            }));
        }
        Self { glimpses }
    }

    /// All glimpses.
    #[must_use]
    pub fn glimpses(&self) -> &[Glimpse] {
        &self.glimpses
    }

    /// Those in the hemisphere about `up`.
    #[must_use]
    pub fn above(&self) -> &[Glimpse] {
        &self.glimpses[..self.glimpses.len() / 2]
    }
}

/// Fraction of the solid angle of `glimpses` for which `what` holds, 0..1.
pub fn solid_angle_fraction(glimpses: &[Glimpse], what: impl Fn(&Glimpse) -> bool) -> f64 {
    let total: f64 = glimpses.iter().map(|g| g.solid_angle).sum();
    glimpses.iter().filter(|g| what(g)).map(|g| g.solid_angle).sum::<f64>() / total
}

/// Whether most fronts of a model see nothing while most backs see something, by area: a room
/// exported inside out. Looks from at most some hundred triangles.
#[must_use]
pub fn looks_inside_out(geometry: &Geometry) -> bool {
    let bvh = Bvh::new(geometry);
    let mut solid: Vec<TriangleId> = bvh.ids().to_vec();
    solid.retain(|&t| geometry.exchanges(t, Side::Front));
    solid.sort_by(|a, b| geometry.area(*b).total_cmp(&geometry.area(*a)));
    // The largest triangles carry most of the area, and a few of the rest stand for all small ones.
    let large = solid.len().min(64);
    let step = ((solid.len() - large) / 64).max(1);
    let chosen = solid[..large].iter().chain(solid[large..].iter().step_by(step));
    let (mut area, mut flipped) = (0.0, 0.0);
    for &triangle in chosen {
        let centre = |side| SurfacePoint { triangle, side, uv: DVec2::splat(1.0 / 3.0) };
        let hits = |side| {
            let seen = seen_from(geometry, &bvh, centre(side));
            seen.filter(|&item| item != NOTHING).count()
        };
        let weight = geometry.area(triangle);
        area += weight;
        if hits(Side::Front) == 0 && 2 * hits(Side::Back) > DIRECTIONS {
            flipped += weight;
        }
    }
    flipped > 0.5 * area
}
