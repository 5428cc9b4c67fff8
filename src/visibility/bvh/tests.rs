use glam::{DVec2, DVec3, dvec3};

use super::node::{DEEPEST, INNER};
use super::*;
use crate::scene::builtin::{self, Mesh};
use crate::scene::{Sides, TriangleState};
use crate::simd::{LANES, Version, WIDEST};

/// Numbers that look random.
struct Noise(u64);

impl Noise {
    /// In 0..1.
    fn next(&mut self) -> f64 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn point(&mut self) -> DVec3 {
        dvec3(self.next(), self.next(), self.next())
    }

    fn direction(&mut self) -> DVec3 {
        loop {
            let d = 2.0 * self.point() - 1.0;
            if d.length_squared() <= 1.0 && d.length_squared() > 1e-4 {
                return d.normalize();
            }
        }
    }
}

fn geometry(vertices: Vec<DVec3>, triangles: Vec<[u32; 3]>) -> Geometry {
    let n = triangles.len();
    let mut g = Geometry {
        vertices,
        triangles,
        sides: vec![Sides::One; n],
        state: vec![TriangleState::Solid; n],
        surface_of: vec![0; n],
        surfaces: Vec::new(),
        face_of: vec![],
        cut_faces: std::collections::BTreeMap::new(),
        whole_from: None,
    };
    g.flag_flaws();
    g
}

fn of_mesh(mesh: Mesh) -> Geometry {
    geometry(mesh.vertices, mesh.triangles)
}

/// Triangles anywhere in the unit cube, of sizes up to `size`.
fn soup(n: usize, size: f64, noise: &mut Noise) -> Geometry {
    let vertices = (0..n).flat_map(|_| {
        let p = noise.point();
        [p, p + size * noise.point(), p + size * noise.point()]
    });
    let vertices: Vec<DVec3> = vertices.collect();
    let triangles = (0..n as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    geometry(vertices, triangles)
}

/// A closed room with closed bodies that float in it.
fn furnished() -> Mesh {
    Mesh::joined([
        Mesh::cuboid(dvec3(4.0, 2.5, 3.0), [3, 2, 2]).inverted(),
        Mesh::geodesic(0.5, 5).at(0.8, 1.1, 0.3),
        Mesh::cuboid(dvec3(0.6, 0.4, 0.5), [2, 1, 3]).turned(33.0).at(-0.9, 0.5, 0.4),
        Mesh::torus(0.4, 0.1, 40, 20).tipped().turned(17.0).at(-0.5, 1.5, -0.7),
        Mesh::cone(0.3, 0.7, 24, 3).at(1.2, 0.3, -0.8),
    ])
}

/// A ray of a test: origin (m), direction, own triangle.
type Ray = (DVec3, DVec3, Option<TriangleId>);

fn packets(bvh: &Bvh, rays: &[Ray]) -> Vec<Packet> {
    let mut packets = vec![Packet::EMPTY; rays.len().div_ceil(LANES)];
    for (i, &(origin, direction, own)) in rays.iter().enumerate() {
        let own = own.and_then(|t| bvh.solid(t));
        let (origin, direction) = (bvh.local(origin), direction.as_vec3());
        packets[i / LANES].set(i % LANES, origin, direction, f32::INFINITY, own);
    }
    packets
}

fn closest(bvh: &Bvh, packets: &[Packet]) -> Vec<Hits> {
    let mut hits = vec![Hits::NONE; packets.len()];
    bvh.closest(packets, &mut hits);
    hits
}

/// Rays from points all over the fronts of a scene, cosine-distributed.
fn from_fronts(g: &Geometry, n: usize, noise: &mut Noise) -> Vec<Ray> {
    let ids: Vec<TriangleId> = g.ids().filter(|&t| g.is_solid(t)).collect();
    (0..n)
        .map(|i| {
            let id = ids[i % ids.len()];
            let [a, b, c] = g.corners(id);
            let (s, t) = (noise.next().sqrt(), noise.next());
            let origin = a * (1.0 - s) + b * (s * (1.0 - t)) + c * (s * t);
            let up = g.normal(id, Side::Front);
            (origin, (up + noise.direction()).normalize(), Some(id))
        })
        .collect()
}

/// How far along a ray a triangle is met, how far inside its edges (as a barycentric coordinate),
/// and the cosine of the angle of incidence, negative on the front; in double precision (Möller &
/// Trumbore 1997).
fn meet([a, b, c]: [DVec3; 3], origin: DVec3, direction: DVec3) -> (f64, f64, f64) {
    let (e1, e2) = (b - a, c - a);
    let h = direction.cross(e2);
    let det = e1.dot(h);
    let s = origin - a;
    let (u, v) = (s.dot(h) / det, direction.dot(s.cross(e1)) / det);
    let cosine = e1.cross(e2).normalize().dot(direction.normalize());
    (e2.dot(s.cross(e1)) / det, u.min(v).min(1.0 - u - v), cosine)
}

/// Compares hits with those found by asking each triangle in double precision; rays that pass too
/// near an edge to tell are left out. Returns the share of those.
fn compare(g: &Geometry, bvh: &Bvh, rays: &[Ray]) -> f64 {
    let hits = closest(bvh, &packets(bvh, rays));
    let mut unsure = 0;
    for (i, &(origin, along, own)) in rays.iter().enumerate() {
        let direction = along.normalize();
        let (mut best, mut clear) = (None, true);
        let mut nearest = f64::INFINITY;
        for &id in bvh.ids().iter().filter(|&&t| Some(t) != own) {
            let (distance, inside, cosine) = meet(g.corners(id), origin, direction);
            let noise = 1e-5 * bvh.scale() / cosine.abs();
            let size = g.area(id).sqrt();
            if inside.is_nan() || distance < -noise {
                continue;
            }
            if inside.abs() < noise / size
                || (inside > 0.0 && (distance - nearest).abs() < 3.0 * noise)
                || (inside > 0.0 && distance.abs() < noise)
            {
                clear = false;
            }
            if inside > 0.0 && distance < nearest {
                nearest = distance;
                best = Some((id, cosine > 0.0));
            }
        }
        if !clear {
            unsure += 1;
            continue;
        }
        let (hits, l) = (&hits[i / LANES], i % LANES);
        let met = (hits.item[l] != NOTHING)
            .then(|| (bvh.ids()[hits.item[l] as usize / 2], hits.item[l] & 1 == 1));
        assert_eq!(met, best, "ray {i}: {origin} {direction}");
        if let Some((id, _)) = met {
            let along = origin + along * f64::from(hits.distance[l]) * bvh.scale();
            let [a, b, c] = g.corners(id);
            let (u, v) = (f64::from(hits.u[l]), f64::from(hits.v[l]));
            let point = a + (b - a) * u + (c - a) * v;
            let cosine = meet([a, b, c], origin, direction).2.abs();
            let error = (along - point).length() / bvh.scale();
            assert!(error < 2e-6 / cosine, "ray {i}: {error:e}, cosine {cosine:e}");
        }
    }
    unsure as f64 / rays.len() as f64
}

#[test]
fn agrees_with_double_precision_on_triangles_anywhere() {
    let noise = &mut Noise(1);
    for (n, size) in [(1, 1.0), (5, 1.0), (60, 0.5), (2_000, 0.1)] {
        let g = soup(n, size, noise);
        let bvh = Bvh::new(&g);
        let rays: Vec<Ray> =
            (0..2_000).map(|_| (2.0 * noise.point() - 0.5, noise.direction(), None)).collect();
        assert!(compare(&g, &bvh, &rays) < 0.05);
    }
}

#[test]
fn agrees_with_double_precision_on_built_in_scenes() {
    for builtin in builtin::list() {
        let g = builtin::build(builtin.name).expect("a listed scene").geometry;
        let bvh = Bvh::new(&g);
        let rays = from_fronts(&g, 1_000, &mut Noise(2));
        assert!(compare(&g, &bvh, &rays) < 0.05, "{}", builtin.name);
    }
}

#[test]
fn agrees_at_any_scale_and_place() {
    let mesh = furnished();
    for (scale, offset) in [(1e-3, DVec3::ZERO), (1e4, DVec3::ZERO), (1.0, dvec3(1e5, -2e5, 3e4))] {
        let mut g = of_mesh(mesh.clone());
        g.vertices.iter_mut().for_each(|v| *v = *v * scale + offset);
        let bvh = Bvh::new(&g);
        let mut rays = from_fronts(&g, 1_000, &mut Noise(3));
        // Directions may have any length.
        rays.iter_mut().for_each(|r| r.1 *= 7.0 * scale);
        assert!(compare(&g, &bvh, &rays) < 0.05);
        let hits = closest(&bvh, &packets(&bvh, &rays));
        assert!(hits.iter().flat_map(|h| h.item).filter(|i| i & 1 == 1).count() <= 16 + 1000 % 16);
    }
}

/// Numbers of rays that meet nothing, and that meet backs.
fn leaks(bvh: &Bvh, rays: &[Ray]) -> (usize, usize) {
    let hits = closest(bvh, &packets(bvh, rays));
    let items = || hits.iter().flat_map(|h| h.item).take(rays.len());
    let escaped = items().filter(|&i| i == NOTHING).count();
    (escaped, items().filter(|i| i & 1 == 1).count() - escaped)
}

#[test]
fn no_ray_leaves_a_closed_room_or_sees_the_inside_of_a_body() {
    let g = of_mesh(furnished());
    let bvh = Bvh::new(&g);
    let noise = &mut Noise(4);
    assert_eq!(leaks(&bvh, &from_fronts(&g, 1_000_000, noise)), (0, 0));
    // From the middle of the room at all vertices, at all edges, and anywhere.
    let mut aimed = Vec::new();
    for _ in 0..40 {
        let eye = dvec3(0.1, 1.25, 0.2) + 0.05 * noise.point();
        for id in g.ids() {
            let [a, b, c] = g.corners(id);
            for target in [a, b, c, 0.5 * (a + b), a.lerp(c, noise.next()), b.lerp(c, noise.next())]
            {
                aimed.push((eye, target - eye, None));
            }
        }
    }
    assert_eq!(leaks(&bvh, &aimed), (0, 0), "of {}", aimed.len());
}

#[test]
fn no_ray_leaves_a_sphere() {
    for frequency in [1, 4, 24] {
        let g = of_mesh(Mesh::geodesic(3.0, frequency).inverted());
        let bvh = Bvh::new(&g);
        let noise = &mut Noise(5);
        let mut rays = from_fronts(&g, 300_000, noise);
        for &v in &g.vertices {
            for eye in [DVec3::ZERO, noise.point(), noise.point()] {
                rays.push((eye, v - eye, None));
            }
        }
        assert_eq!(leaks(&bvh, &rays), (0, 0), "frequency {frequency}");
    }
}

#[test]
fn all_versions_agree_to_the_bit() {
    let g = of_mesh(furnished());
    let bvh = Bvh::new(&g);
    let noise = &mut Noise(6);
    let mut rays = from_fronts(&g, 20_000, noise);
    rays.extend((0..1_000).map(|_| (noise.point(), DVec3::X, None)));
    let packets = packets(&bvh, &rays);
    let run = |version| {
        WIDEST.set(version);
        let mut blocked = vec![0; packets.len()];
        bvh.blocked(&packets, &mut blocked);
        let hits = closest(&bvh, &packets);
        WIDEST.set(Version::Avx512);
        (hits, blocked)
    };
    let widest = run(Version::Avx512);
    assert!(widest == run(Version::Avx2));
    assert!(widest == run(Version::Portable));
}

#[test]
fn what_is_met_blocks() {
    let noise = &mut Noise(7);
    let g = soup(500, 0.2, noise);
    let bvh = Bvh::new(&g);
    let rays: Vec<Ray> = (0..20_000).map(|_| (noise.point(), noise.direction(), None)).collect();
    let mut packets = packets(&bvh, &rays);
    let hits = closest(&bvh, &packets);
    let blocked = |packets: &[Packet]| {
        let mut blocked = vec![0; packets.len()];
        bvh.blocked(packets, &mut blocked);
        blocked
    };
    let met = |h: &Hits| (0..LANES).map(|l| u16::from(h.item[l] != NOTHING) << l).sum::<u16>();
    assert!(blocked(&packets) == hits.iter().map(met).collect::<Vec<_>>());
    // What a segment's end touches does not block it, nor what is beyond; what is before it does.
    for (factor, expected) in [(1.0, 0), (0.99, 0), (1.01, 1)] {
        for (packet, hits) in packets.iter_mut().zip(&hits) {
            packet.far = hits.distance.map(|d| d * factor);
        }
        let found = blocked(&packets).iter().map(|b| b.count_ones()).sum::<u32>();
        let any = hits.iter().flat_map(|h| h.item).filter(|&i| i != NOTHING).count();
        let most = any as f64 * f64::from(expected);
        assert!((f64::from(found) - most).abs() <= 2e-3 * any as f64, "{factor}: {found} of {any}");
    }
}

/// A square at z = 0 of n × n cells, two triangles each, that faces up.
fn square(n: u32) -> Geometry {
    let at = |i: u32, j: u32| i * (n + 1) + j;
    let vertices = (0..(n + 1) * (n + 1))
        .map(|k| dvec3(f64::from(k / (n + 1)), f64::from(k % (n + 1)), 0.0) / f64::from(n))
        .collect();
    let triangles = (0..n * n)
        .flat_map(|k| {
            let (i, j) = (k / n, k % n);
            [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]]
        })
        .collect();
    geometry(vertices, triangles)
}

#[test]
fn rays_that_leave_a_plane_meet_nothing_of_it() {
    let noise = &mut Noise(8);
    for turn in [glam::DQuat::IDENTITY, glam::DQuat::from_axis_angle(dvec3(0.6, 0.0, 0.8), 1.1)] {
        let mut g = square(20);
        g.vertices.iter_mut().for_each(|v| *v = turn * *v);
        let bvh = Bvh::new(&g);
        let up = turn * DVec3::Z;
        let mut rays = Vec::new();
        for (origin, direction, own) in from_fronts(&g, 200_000, noise) {
            let along = direction - up * direction.dot(up);
            let grazing = along.normalize() + up * 1e-4 * noise.next();
            rays.push((origin, direction, own));
            rays.push((origin, grazing, own));
            // Seen from its back, too, and from the corners of neighbours.
            rays.push((origin, -direction, own));
            let [a, b, _] = own.map_or([DVec3::ZERO; 3], |t| g.corners(t));
            rays.push((a, direction, own));
            rays.push((a.lerp(b, 0.3), grazing, own));
            rays.push((a.lerp(b, 0.3), -direction, own));
        }
        assert_eq!(leaks(&bvh, &rays), (rays.len(), 0));
    }
}

#[test]
fn a_ray_that_starts_in_a_corner_meets_the_other_wall() {
    let g = of_mesh(Mesh::cuboid(DVec3::ONE, [4; 3]).turned(25.0).inverted());
    let bvh = Bvh::new(&g);
    let noise = &mut Noise(9);
    let mut rays = Vec::new();
    for id in g.ids() {
        let [a, b, c] = g.corners(id);
        let up = g.normal(id, Side::Front);
        for _ in 0..200 {
            let (p, q, r) = if noise.next() < 0.5 { (a, b, c) } else { (b, c, a) };
            let inside = p.lerp(q, noise.next()).lerp(r, 2e-6);
            rays.push((inside, up + noise.direction(), Some(id)));
        }
    }
    assert_eq!(leaks(&bvh, &rays), (0, 0), "of {}", rays.len());
}

#[test]
fn single_rays_speak_of_metres_and_triangles() {
    let mut g = square(1);
    g.vertices.iter_mut().for_each(|v| *v *= 10.0);
    let bvh = Bvh::new(&g);
    let down = dvec3(0.0, 0.0, -2.0);
    let met = bvh.see(dvec3(6.0, 3.0, 4.0), down, None).expect("it looks at the square");
    assert_eq!((met.triangle, met.side), (TriangleId(0), Side::Front));
    assert!((met.distance - 4.0).abs() < 1e-5);
    assert!((DVec2::from(met.uv) - DVec2::new(0.3, 0.3)).length() < 1e-6, "{met:?}");
    assert_eq!(bvh.see(dvec3(6.0, 3.0, 4.0), down, Some(TriangleId(0))), None);
    assert_eq!(bvh.see(dvec3(6.0, 3.0, 4.0), DVec3::ZERO, None), None);
    let from_far = bvh.see(dvec3(6.0, 3.0, -4e6), -down, None).expect("it looks at the square");
    assert_eq!((from_far.triangle, from_far.side), (TriangleId(0), Side::Back));
    assert!((from_far.distance - 4e6).abs() < 1e-4);
    assert!(bvh.blocks(dvec3(6.0, 3.0, -4e6), dvec3(6.0, 3.0, 5e6)));
    assert!(bvh.blocks(dvec3(6.0, 3.0, 1.0), dvec3(6.0, 3.0, -1.0)));
    assert!(!bvh.blocks(dvec3(6.0, 3.0, 1.0), dvec3(6.0, 3.0, 0.0)));
    assert!(!bvh.blocks(dvec3(6.0, 3.0, 1.0), dvec3(5.0, 3.0, 0.5)));
}

#[test]
fn nothing_is_met_where_nothing_is() {
    let flat = geometry(vec![DVec3::ZERO, DVec3::X, 2.0 * DVec3::X], vec![[0, 1, 2]]);
    let mut wild = geometry(vec![DVec3::ZERO, DVec3::X, DVec3::NAN], vec![[0, 1, 2]]);
    wild.state = vec![TriangleState::Solid];
    let mut point = geometry(vec![DVec3::ONE], vec![[0; 3]]);
    point.state = vec![TriangleState::Solid];
    for g in [Geometry::default(), flat, wild, point] {
        let bvh = Bvh::new(&g);
        assert_eq!(bvh.see(DVec3::ZERO, DVec3::ONE, None), None);
        assert!(!bvh.blocks(-DVec3::ONE, 2.0 * DVec3::ONE));
    }
    let bvh = Bvh::new(&square(1));
    let mut odd = Packet::EMPTY;
    for (l, d) in [f32::NAN, f32::INFINITY, 0.0, -0.0].into_iter().enumerate() {
        odd.set(l, Vec3::Z, Vec3::splat(d), f32::INFINITY, None);
    }
    odd.set(4, Vec3::splat(f32::NAN), -Vec3::Z, 1.0, None);
    odd.set(5, Vec3::Z, -Vec3::Z, f32::NAN, Some(7));
    assert_eq!(closest(&bvh, &[odd])[0].item, [NOTHING; LANES]);
}

#[test]
fn thousands_of_equal_and_nested_triangles_end() {
    let mut g = soup(1, 1.0, &mut Noise(10));
    g.triangles = vec![[0, 1, 2]; 50_000];
    g.state = vec![TriangleState::Solid; 50_000];
    let bvh = Bvh::new(&g);
    let [a, b, c] = g.corners(TriangleId(0));
    let n = g.normal(TriangleId(0), Side::Front);
    assert!(bvh.see((a + b + c) / 3.0 + n, -n, None).is_some());
    // Each a little smaller than the one before, which no plane parts evenly.
    let vertices = (0..3_000)
        .flat_map(|i| [DVec3::X, DVec3::Y, DVec3::Z].map(|v| v * 0.99_f64.powi(i)))
        .collect();
    let nested = geometry(vertices, (0..3_000).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect());
    let met = Bvh::new(&nested).see(DVec3::splat(2.0), -DVec3::ONE, None).expect("it meets one");
    assert_eq!(met.triangle, TriangleId(0));
}

#[test]
fn every_triangle_is_in_one_leaf_within_its_boxes() {
    let g = soup(3_000, 0.05, &mut Noise(11));
    let bvh = Bvh::new(&g);
    let mut found = vec![0; bvh.boxes.triangles.len()];
    let mut open = vec![(0, 0)];
    while let Some((at, depth)) = open.pop() {
        assert!(depth <= DEEPEST);
        let node = &bvh.boxes.nodes[at];
        if node.kind() >= INNER {
            for child in [node.first() as usize, node.first() as usize + 1] {
                let inner = &bvh.boxes.nodes[child];
                assert!((0..3).all(|a| node.0[a] <= inner.0[a] && inner.0[3 + a] <= node.0[3 + a]));
                open.push((child, depth + 1));
            }
            continue;
        }
        let leaf = node.first() as usize..(node.first() + node.kind()) as usize;
        found[leaf.clone()].iter_mut().for_each(|n| *n += 1);
        for triangle in &bvh.boxes.triangles[leaf] {
            for corner in triangle.numbers[..9].chunks(3) {
                assert!((0..3).all(|a| node.0[a] < corner[a] && corner[a] < node.0[3 + a]));
            }
        }
    }
    assert!(found.iter().all(|&n| n == 1));
    assert!(bvh.bytes() < 110 * 3_000, "{}", bvh.bytes());
}

#[test]
fn the_hierarchy_does_not_depend_on_the_number_of_threads() {
    let g = soup(20_000, 0.02, &mut Noise(12));
    let built = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        pool.install(|| Bvh::new(&g))
    };
    let (one, two) = (built(1), built(2));
    assert!(one.boxes.nodes == two.boxes.nodes && one.boxes.triangles == two.boxes.triangles);
}
