//! Generators of the simple solids.
//!
//! Every one yields a watertight mesh: triangles counter-clockwise seen from outside, neighbours
//! share vertices by index, and poles are single vertices. Lengths are in metres. Solids of
//! revolution and boxes stand on the plane `y = 0` with `y` as their axis; spheres, tori and knots
//! are centred on the origin. [`Mesh::placed`] moves them into the scene.

use std::collections::HashMap;
use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3, dvec2, dvec3};

use super::mesh::Mesh;

impl Mesh {
    /// A box of the given edge lengths, standing on `y = 0` with the `y` axis through its middle.
    ///
    /// Each face is a grid: `cells[k]` cells along axis `k`, two triangles a cell, so there are
    /// `4 (cells.x cells.y + cells.y cells.z + cells.z cells.x)` triangles, face by face in the
    /// order -x, +x, -y, +y, -z, +z.
    #[must_use]
    pub fn cuboid(size: DVec3, cells: [u32; 3]) -> Self {
        let mut mesh = Self::default();
        let mut known = HashMap::new();
        let low = dvec3(-0.5 * size.x, 0.0, -0.5 * size.z);
        let mut vertex = |mesh: &mut Self, lattice: [u32; 3]| {
            *known.entry(lattice).or_insert_with(|| {
                let at = |k: usize| f64::from(lattice[k]) / f64::from(cells[k]);
                mesh.vertex(low + size * dvec3(at(0), at(1), at(2)))
            })
        };
        for axis in 0..3 {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            for side in [0, cells[axis]] {
                for (i, j) in (0..cells[u]).flat_map(|i| (0..cells[v]).map(move |j| (i, j))) {
                    let quad = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)].map(|(i, j)| {
                        let mut lattice = [0; 3];
                        (lattice[axis], lattice[u], lattice[v]) = (side, i, j);
                        vertex(&mut mesh, lattice)
                    });
                    let [a, b, c, d] = quad;
                    mesh.quad(if side == 0 { [a, d, c, b] } else { quad });
                }
            }
        }
        mesh
    }

    /// The solid that a profile sweeps about the `y` axis.
    ///
    /// `profile` holds (radius, height) from bottom to top, the solid on its left as it goes up; it
    /// starts and ends on the axis (radius 0), which makes one vertex each: a pole. `segments` is
    /// the number of vertices round the axis, at least 3.
    #[must_use]
    pub fn lathe(profile: &[DVec2], segments: u32) -> Self {
        let mut mesh = Self::default();
        let rings: Vec<Vec<u32>> = profile
            .iter()
            .map(|p| {
                let round = if p.x == 0.0 { 1 } else { segments };
                (0..round)
                    .map(|i| {
                        let (sin, cos) = turn(i, segments).sin_cos();
                        mesh.vertex(dvec3(p.x * cos, p.y, -p.x * sin))
                    })
                    .collect()
            })
            .collect();
        for (low, high) in rings.iter().zip(rings.iter().skip(1)) {
            for i in 0..segments as usize {
                let at = |ring: &[u32], i: usize| ring[i % ring.len()];
                let quad = [at(low, i), at(low, i + 1), at(high, i + 1), at(high, i)];
                match (low.len(), high.len()) {
                    (1, 1) => {}
                    (1, _) => mesh.triangles.push([quad[0], quad[2], quad[3]]),
                    (_, 1) => mesh.triangles.push([quad[0], quad[1], quad[2]]),
                    _ => mesh.quad(quad),
                }
            }
        }
        mesh
    }

    /// A cylinder on `y = 0`, its mantle in `stacks` rings: `2 segments (stacks + 1)` triangles.
    /// With few segments it is a regular prism.
    #[must_use]
    pub fn cylinder(radius: f64, height: f64, segments: u32, stacks: u32) -> Self {
        let mantle = (0..=stacks).map(|i| dvec2(radius, height * fraction(i, stacks)));
        let profile: Vec<_> = std::iter::once(DVec2::ZERO)
            .chain(mantle)
            .chain(std::iter::once(dvec2(0.0, height)))
            .collect();
        Self::lathe(&profile, segments)
    }

    /// A cone on `y = 0` with its apex above, its mantle in `stacks` rings: `2 segments stacks`
    /// triangles. With few segments it is a pyramid.
    #[must_use]
    pub fn cone(radius: f64, height: f64, segments: u32, stacks: u32) -> Self {
        let mantle = (0..=stacks).map(|i| {
            let up = fraction(i, stacks);
            dvec2(radius * (1.0 - up), height * up)
        });
        let profile: Vec<_> = std::iter::once(DVec2::ZERO).chain(mantle).collect();
        Self::lathe(&profile, segments)
    }

    /// A sphere of parallels and meridians about the origin: `2 segments (stacks - 1)` triangles.
    #[must_use]
    pub fn sphere(radius: f64, segments: u32, stacks: u32) -> Self {
        let profile: Vec<_> = (0..=stacks)
            .map(|i| {
                let (sin, cos) = (PI * fraction(i, stacks)).sin_cos();
                let ring = if i == 0 || i == stacks { 0.0 } else { radius * sin };
                dvec2(ring, -radius * cos)
            })
            .collect();
        Self::lathe(&profile, segments)
    }

    /// A sphere about the origin made from an icosahedron whose edges are cut into `frequency`
    /// parts: `20 frequency²` triangles of nearly equal size.
    #[must_use]
    pub fn geodesic(radius: f64, frequency: u32) -> Self {
        let mut mesh = Self::default();
        let mut known = HashMap::new();
        let corners = icosahedron_vertices();
        for face in ICOSAHEDRON {
            // A grid point is a sum of corners with whole weights; sorted by corner, the sum is the
            // same to the bit from every face that shares the point.
            let mut point = |mesh: &mut Self, i: u32, j: u32| {
                let mut key = [(face[0], frequency - i - j), (face[1], i), (face[2], j)];
                key.iter_mut().filter(|(_, weight)| *weight == 0).for_each(|k| *k = (0, 0));
                key.sort_unstable();
                *known.entry(key).or_insert_with(|| {
                    let sum: DVec3 = key.iter().map(|&(c, w)| corners[c] * f64::from(w)).sum();
                    mesh.vertex(radius * sum.normalize())
                })
            };
            for i in 0..frequency {
                for j in 0..frequency - i {
                    let (a, b, c) = (
                        point(&mut mesh, i, j),
                        point(&mut mesh, i + 1, j),
                        point(&mut mesh, i, j + 1),
                    );
                    mesh.triangles.push([a, b, c]);
                    if i + j + 1 < frequency {
                        let d = point(&mut mesh, i + 1, j + 1);
                        mesh.triangles.push([b, d, c]);
                    }
                }
            }
        }
        mesh
    }

    /// A torus about the `y` axis: `2 segments sides` triangles, `segments` round the axis and
    /// `sides` round the tube.
    #[must_use]
    pub fn torus(major: f64, minor: f64, segments: u32, sides: u32) -> Self {
        Self::tube(segments, sides, |along| {
            let (sin, cos) = along.sin_cos();
            let out = dvec3(cos, 0.0, -sin);
            Ring { centre: out * major, first: out * minor, second: DVec3::Y * minor }
        })
    }

    /// A tube along the (p, q) torus knot that winds `p` times about the `y` axis and `q` times
    /// about the core of a torus of the given radii: `2 segments sides` triangles.
    #[must_use]
    pub fn torus_knot(
        (p, q): (u32, u32),
        major: f64,
        minor: f64,
        tube: f64,
        segments: u32,
        sides: u32,
    ) -> Self {
        let (p, q) = (f64::from(p), f64::from(q));
        Self::tube(segments, sides, |along| {
            let (sin_p, cos_p) = (p * along).sin_cos();
            let (sin_q, cos_q) = (q * along).sin_cos();
            let out = dvec3(cos_p, 0.0, -sin_p);
            let round = dvec3(-sin_p, 0.0, -cos_p);
            let radius = major + minor * cos_q;
            // The torus' own normal: perpendicular to the curve, and periodic, so the tube closes.
            let normal = out * cos_q + DVec3::Y * sin_q;
            let tangent = round * (p * radius) + (DVec3::Y * cos_q - out * sin_q) * (q * minor);
            Ring {
                centre: out * radius + DVec3::Y * (minor * sin_q),
                first: normal * tube,
                second: normal.cross(tangent).normalize() * tube,
            }
        })
    }

    /// A closed tube through rings; `ring` is asked at angles 0..2π along it. Seen in the direction
    /// of growing angle, `first` turns to `second` counter-clockwise.
    fn tube(segments: u32, sides: u32, ring: impl Fn(f64) -> Ring) -> Self {
        let mut mesh = Self::default();
        for i in 0..segments {
            let Ring { centre, first, second } = ring(turn(i, segments));
            for j in 0..sides {
                let (sin, cos) = turn(j, sides).sin_cos();
                mesh.vertex(centre + first * cos + second * sin);
            }
        }
        for (i, j) in (0..segments).flat_map(|i| (0..sides).map(move |j| (i, j))) {
            let at = |i: u32, j: u32| (i % segments) * sides + j % sides;
            mesh.quad([at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
        }
        mesh
    }
}

/// One cross-section of a tube: an ellipse with the given half axes.
struct Ring {
    centre: DVec3,
    first: DVec3,
    second: DVec3,
}

/// The `i`-th of `n` equal angles round the circle.
fn turn(i: u32, n: u32) -> f64 {
    TAU * fraction(i, n)
}

fn fraction(i: u32, n: u32) -> f64 {
    f64::from(i) / f64::from(n)
}

/// The twelve cyclic permutations of (0, ±1, ±φ), not normalised.
fn icosahedron_vertices() -> [DVec3; 12] {
    let phi = 0.5 * (1.0 + 5.0_f64.sqrt());
    std::array::from_fn(|i| {
        let (one, golden) = ([-1.0, 1.0][i & 1], [-phi, phi][i >> 1 & 1]);
        [dvec3(0.0, one, golden), dvec3(golden, 0.0, one), dvec3(one, golden, 0.0)][i >> 2]
    })
}

/// Faces of the icosahedron, counter-clockwise from outside; the vertex order is that of
/// [`icosahedron_vertices`].
const ICOSAHEDRON: [[usize; 3]; 20] = [
    [0, 4, 1],
    [0, 1, 6],
    [0, 8, 4],
    [0, 6, 9],
    [0, 9, 8],
    [1, 4, 10],
    [1, 11, 6],
    [1, 10, 11],
    [2, 3, 5],
    [2, 7, 3],
    [2, 5, 8],
    [2, 9, 7],
    [2, 8, 9],
    [3, 10, 5],
    [3, 7, 11],
    [3, 11, 10],
    [4, 8, 5],
    [4, 5, 10],
    [6, 7, 9],
    [6, 11, 7],
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::builtin::mesh::tests::{area, open_edges, signed_volume};

    /// Name, mesh, triangles, area of the smooth solid.
    fn solids() -> Vec<(&'static str, Mesh, usize, f64)> {
        let knot = Mesh::torus_knot((2, 3), 1.0, 0.4, 0.15, 200, 12);
        vec![
            ("box", Mesh::cuboid(dvec3(1.0, 2.0, 3.0), [1, 1, 1]), 12, 22.0),
            ("grid box", Mesh::cuboid(dvec3(1.0, 2.0, 3.0), [2, 3, 5]), 124, 22.0),
            ("cylinder", Mesh::cylinder(0.5, 2.0, 48, 3), 384, PI * (2.0 + 0.5)),
            ("prism", Mesh::cylinder(1.0, 2.0, 6, 1), 24, 12.0 + 3.0 * 3.0_f64.sqrt()),
            ("cone", Mesh::cone(3.0, 4.0, 48, 4), 384, PI * (9.0 + 15.0)),
            ("sphere", Mesh::sphere(2.0, 40, 20), 1520, 16.0 * PI),
            ("geodesic", Mesh::geodesic(2.0, 7), 980, 16.0 * PI),
            ("torus", Mesh::torus(1.0, 0.3, 48, 24), 2304, TAU * TAU * 0.3),
            ("knot", knot.clone(), 4800, f64::NAN),
            ("turned", knot.turned(30.0).at(1.0, 2.0, 3.0), 4800, f64::NAN),
        ]
    }

    #[test]
    fn solids_are_closed_and_face_outwards() {
        for (name, mesh, triangles, _) in solids() {
            assert_eq!(mesh.triangles.len(), triangles, "{name}");
            assert_eq!(open_edges(&mesh), 0, "{name}");
            assert!(signed_volume(&mesh) > 0.0, "{name}");
            // Euler: no vertex is unused or doubled.
            let genus_term = mesh.vertices.len() as i64 - triangles as i64 / 2;
            assert!(genus_term == 2 || genus_term == 0, "{name}: {genus_term}");
        }
    }

    #[test]
    fn areas_come_near_the_smooth_solids() {
        for (name, mesh, _, smooth) in solids() {
            if smooth.is_finite() {
                let ratio = area(&mesh) / smooth;
                assert!(ratio > 0.98 && ratio < 1.0 + 1e-12, "{name}: {ratio}");
            }
        }
    }

    #[test]
    fn tube_of_a_knot_has_its_radius_everywhere() {
        // Pappus holds for tubes along any curve: volume = area of the section x length.
        let (fine, tube) = (Mesh::torus_knot((2, 3), 1.0, 0.4, 0.15, 2000, 48), 0.15);
        assert!((signed_volume(&fine) / area(&fine) / (0.5 * tube) - 1.0).abs() < 1e-2);
    }
}
