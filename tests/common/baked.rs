//! Scenes whose light is baked, and where points lie on their atlas.

use std::error::Error;

use glam::{DVec2, DVec3};
use hemicube::bake::{Bake, BakeOptions, Facet};
use hemicube::gather::{GatherOptions, Gatherer};
use hemicube::patches::SurfacePoint;
use hemicube::render::{Renderer, Sight};
use hemicube::scene::{Rgb, Scene};
use hemicube::visibility::Bvh;
use hemicube::{LightOptions, Silent};

/// What radiance is multiplied by where it is shown.
pub const EXPOSURE: f64 = 0.5;

/// Does something with the bake of a scene: with texels of that width (m) or the usual ones, and
/// with or without what lamps send straight.
pub fn baked<T>(
    scene: &Scene,
    texel: Option<f64>,
    lamps: bool,
    with: impl FnOnce(&Bake<'_>) -> Result<T, Box<dyn Error>>,
) -> Result<T, Box<dyn Error>> {
    let solution = scene.light(&LightOptions::default(), &Silent)?.solution;
    let field = solution.field(scene);
    let bvh = Bvh::new(&scene.geometry);
    let gatherer = Gatherer::new(scene, &solution, &field, &bvh, GatherOptions::of_pictures(0));
    let renderer = Renderer::gathering(scene, &field, &gatherer);
    let renderer = if lamps { renderer } else { renderer.without_lamps() };
    let shown = |s: &Sight| (s.radiance * EXPOSURE).clamp(Rgb::ZERO, Rgb::ONE).as_vec3().to_array();
    let options = BakeOptions { texel, ..BakeOptions::default() };
    with(&Bake::new(scene, &solution, &renderer, &options, shown, &Silent)?)
}

/// The mean of three coordinates by barycentric weights.
pub fn weighted(corners: [DVec2; 3], l: DVec3) -> DVec2 {
    corners[0] * l.x + corners[1] * l.y + corners[2] * l.z
}

/// A point of a facet, by barycentric weights.
pub fn point(facet: &Facet, l: DVec3) -> SurfacePoint {
    facet.point(l)
}

/// Corner positions of a facet, m.
pub fn positions(scene: &Scene, facet: &Facet) -> [DVec3; 3] {
    let [a, b, c] = scene.geometry.corners(facet.triangle);
    facet.corners.map(|uv| a + (b - a) * uv.x + (c - a) * uv.y)
}

/// The place in the atlas of the surface at a point with a normal, if one is within a millimetre.
pub fn place(scene: &Scene, facets: &[Facet], p: DVec3, n: DVec3) -> Option<DVec2> {
    let g = &scene.geometry;
    let distance = |f: &Facet| {
        let [a, b, c] = positions(scene, f);
        let (e, f, d) = (b - a, c - a, p - a);
        let (ee, ef, ff) = (e.dot(e), e.dot(f), f.dot(f));
        let determinant = ee * ff - ef * ef;
        let u = (d.dot(e) * ff - d.dot(f) * ef) / determinant;
        let v = (d.dot(f) * ee - d.dot(e) * ef) / determinant;
        let l = DVec3::new(1.0 - u - v, u, v).max(DVec3::ZERO);
        let l = l / l.element_sum();
        ((a * l.x + b * l.y + c * l.z).distance(p), l)
    };
    let facing = facets.iter().filter(|f| g.normal(f.triangle, f.side).dot(n) > 0.99);
    let near = facing.map(|f| (distance(f), f));
    let ((d, l), facet) = near.min_by(|a, b| a.0.0.total_cmp(&b.0.0))?;
    (d < 1e-3).then(|| weighted(facet.atlas, l))
}
