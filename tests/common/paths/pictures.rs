//! Pictures by led paths: what a camera sees, block by block.

use std::f64::consts::PI;

use glam::DVec3;
use hemicube::scene::{Camera, Rgb};
use rayon::prelude::*;

use super::noise::Noise;
use super::{Emission, End, Paths, STRATA};

/// What is seen in a block of pixels.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Block {
    /// Mean radiance that is reflected, and that of the sky, W/(m² sr) or cd/m².
    pub reflected: Rgb,
    /// Standard error of it.
    pub error: Rgb,
    /// Mean radiance of what is seen and emits.
    pub emitted: Rgb,
}

/// What is seen in a pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Face {
    /// Index of the surface.
    pub surface: u32,
    pub normal: DVec3,
}

impl Paths<'_> {
    /// What a camera sees in blocks of `size` x `size` pixels, row by row from the top, of a
    /// picture of `width` x `height` pixels; those at the right and at the bottom may be smaller.
    /// Reflectances are means over triangles, without textures. Standard errors of luminance are at
    /// most `error` (W/(m² sr) or cd/m²), unless that takes more than `most` paths. The same for
    /// any number of threads.
    pub fn picture(
        &self,
        camera: &Camera,
        (width, height): (usize, usize),
        size: usize,
        error: f64,
        most: u32,
    ) -> Vec<Block> {
        let columns = width.div_ceil(size);
        (0..columns * height.div_ceil(size))
            .into_par_iter()
            .map(|k| {
                let corner = [k % columns * size, k / columns * size];
                let far = [(corner[0] + size).min(width), (corner[1] + size).min(height)];
                let rays = Rays::new(camera, (width, height), corner, far);
                self.seen(&rays, k, error, most)
            })
            .collect()
    }

    /// What a camera sees in one pixel of such a picture.
    pub fn pixel(
        &self,
        camera: &Camera,
        size: (usize, usize),
        [x, y]: [usize; 2],
        error: f64,
        most: u32,
    ) -> Block {
        let rays = Rays::new(camera, size, [x, y], [x + 1, y + 1]);
        self.seen(&rays, y * size.0 + x, error, most)
    }

    /// The side that fills each pixel of such a picture as far as its corners and its middle tell;
    /// `None` where they see different surfaces, or such as face elsewhere.
    pub fn faces(&self, camera: &Camera, size: (usize, usize)) -> Vec<Option<Face>> {
        (0..size.0 * size.1)
            .into_par_iter()
            .map(|i| {
                let corner = [i % size.0, i / size.0];
                let rays = Rays::new(camera, size, corner, corner.map(|k| k + 1));
                let at = |[x, y]: [f64; 2]| self.face(rays.eye, rays.direction(x, y));
                let middle = at([0.5; 2])?;
                let alike = |[x, y]: [f64; 2]| {
                    at([x, y]).is_some_and(|f| {
                        f.surface == middle.surface && f.normal.dot(middle.normal) > 0.9999
                    })
                };
                [[0.0, 0.0], [0.0, 1.0], [1.0, 0.0], [1.0, 1.0]]
                    .into_iter()
                    .all(alike)
                    .then_some(middle)
            })
            .collect()
    }

    fn face(&self, eye: DVec3, direction: DVec3) -> Option<Face> {
        let met = self.0.bvh.see(eye, direction, None)?;
        let g = &self.0.scene.geometry;
        let surface = g.surface_of[met.triangle.index()];
        Some(Face { surface, normal: g.normal(met.triangle, met.side) })
    }

    fn seen(&self, rays: &Rays, block: usize, error: f64, most: u32) -> Block {
        let seed = rays.eye + DVec3::splat(block as f64);
        let count = STRATA * STRATA;
        let one = |n: u32| {
            let mut noise = Noise::new(seed, n);
            let ends = (0..count).map(|path| {
                let u = noise.stratum(path, STRATA);
                let direction = rays.direction(u.x, u.y);
                let origin = self.0.bvh.approach(rays.eye, direction);
                let emission = Emission::Apart;
                End { path, origin, direction, own: None, weight: Rgb::ONE, emission }
            });
            let ends = ends.collect();
            let (found, apart) = self.0.follow(ends, Vec::new(), noise);
            let mean = |of: &[Rgb]| of.iter().sum::<Rgb>() / (PI * count as f64);
            (mean(&found), mean(&apart))
        };
        let (reflected, error) = self.until((error, 0.0), most, |n| one(n).0);
        let emitted = (0..4).map(|n| one(n).1 / 4.0).sum();
        Block { reflected, error, emitted }
    }
}

/// The rays of a camera to a rectangle of pixels.
struct Rays {
    eye: DVec3,
    /// To the upper left corner of the rectangle, across it and down.
    axes: [DVec3; 3],
}

impl Rays {
    fn new(
        camera: &Camera,
        (width, height): (usize, usize),
        corner: [usize; 2],
        far: [usize; 2],
    ) -> Self {
        let forward = camera.forward.normalize();
        let right = forward.cross(camera.up).try_normalize();
        let right = right.unwrap_or_else(|| forward.any_orthonormal_vector());
        let down = forward.cross(right);
        let half = (0.5 * camera.vfov).tan();
        let pixel = 2.0 * half / height as f64;
        let at = |k: usize, all: usize| (k as f64 - 0.5 * all as f64) * pixel;
        let (left, top) = (at(corner[0], width), at(corner[1], height));
        let (end, bottom) = (at(far[0], width), at(far[1], height));
        let axes =
            [forward + right * left + down * top, right * (end - left), down * (bottom - top)];
        Self { eye: camera.eye, axes }
    }

    fn direction(&self, x: f64, y: f64) -> DVec3 {
        (self.axes[0] + self.axes[1] * x + self.axes[2] * y).normalize()
    }
}
