//! Light of a scene: measured at points, looked at, baked and stored.

use std::path::PathBuf;
use std::sync::Arc;

use glam::DVec3;
use hemicube::View;
use hemicube::bake::{Bake, BakeOptions};
use hemicube::direct::DirectOptions;
use hemicube::engines::{EngineOptions, RaysOptions};
use hemicube::export::{BakeMode, write_exr, write_glb, write_hemi, write_whole};
use hemicube::gather::{GatherOptions, Gatherer, Place, Probe};
use hemicube::progress::Progress;
use hemicube::render::{PictureOptions, Renderer, Sight};
use hemicube::scene::{self, Camera, luminance};
use hemicube::solution::{LightOptions, Solution, light};
use hemicube::store::{Store, sources};
use hemicube::tone::{KEY, Tone};
use hemicube::uncertainty::light_within;
use hemicube::visibility::Bvh;
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray2};
use pyo3::prelude::*;

use crate::arrays::triples;
use crate::failure::Failure;
use crate::remedy;
use crate::scene::{Scene, rows};
use crate::work::run;

/// A scene's light, solved.
#[pyclass(module = "hemicube._hemicube", frozen)]
pub struct Light {
    scene: Arc<scene::Scene>,
    solution: Solution,
    /// Those that it was lit by.
    options: LightOptions,
    /// What was asked for.
    error: Option<f64>,
    seed: u32,
}

/// What is asked of light; as of `Scene.light`.
#[derive(FromPyObject)]
pub struct Asked {
    error: Option<f64>,
    samples: Option<usize>,
    patch_size: Option<f64>,
    seed: u32,
    memory: u64,
}

impl Asked {
    /// The same for the library.
    pub fn options(&self) -> LightOptions {
        let samples = self.samples.unwrap_or(RaysOptions::default().samples);
        LightOptions {
            patch_size: self.patch_size,
            engine: EngineOptions::Rays(RaysOptions { samples, seed: self.seed }),
            direct: DirectOptions { seed: self.seed, ..DirectOptions::default() },
            error: self.error,
            memory: self.memory,
            ..LightOptions::default()
        }
    }
}

/// Lights a scene.
#[pyfunction]
#[pyo3(name = "light", signature = (scene, asked, progress=None))]
pub fn lit(
    py: Python<'_>,
    scene: &Scene,
    asked: Asked,
    progress: Option<Py<PyAny>>,
) -> PyResult<Light> {
    let scene = Arc::clone(&scene.0);
    let Asked { error, seed, .. } = asked;
    let options = asked.options();
    let (solution, options) = run(py, progress, |progress| {
        if !scene.optics.emits() && scene.lamps.is_empty() && scene.sky == DVec3::ZERO {
            return Err(remedy::of_darkness(&scene));
        }
        let found = match error {
            Some(error) => light_within(&scene, &options, error, progress),
            None => light(&scene, &options, progress).map(|solution| (solution, options)),
        };
        found.map_err(remedy::of_light)
    })?;
    Ok(Light { scene, solution, options, error, seed })
}

/// A point of view; as of `Light.render`.
#[derive(FromPyObject)]
pub struct Looked {
    /// Where, and at what; without, the scene's own camera.
    eye: Option<[f64; 3]>,
    target: Option<[f64; 3]>,
    up: Option<[f64; 3]>,
    /// Radians.
    vfov: Option<f64>,
    size: Option<[usize; 2]>,
    samples: usize,
}

impl Looked {
    fn view(&self, scene: &scene::Scene) -> Result<View, Failure> {
        let mut view = match (self.eye, self.target) {
            (Some(eye), Some(target)) => {
                let camera = Camera::at(eye.into(), target.into());
                View::through(Camera { up: scene.up, ..camera })
            }
            _ => View::of(scene).map_err(remedy::of_picture)?,
        };
        if let Some(up) = self.up {
            view.camera.up = up.into();
        }
        if let Some(vfov) = self.vfov {
            view.camera.vfov = vfov;
        }
        let [width, height] = self.size.unwrap_or([view.picture.width, view.picture.height]);
        view.picture = PictureOptions { width, height, samples: self.samples };
        Ok(view)
    }
}

#[pymethods]
impl Light {
    /// Irradiance (n, 3) at points, half-widths of its 95 % intervals, and what places they are:
    /// 0 free, 1 inside a solid, 2 on an emitter, 3 outside.
    #[allow(clippy::type_complexity, reason = "three arrays")]
    #[pyo3(signature = (points, normals, samples, progress=None))]
    fn probe<'py>(
        &self,
        py: Python<'py>,
        points: PyReadonlyArray2<'py, f64>,
        normals: PyReadonlyArray2<'py, f64>,
        samples: Option<usize>,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<(Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<f64>>, Bound<'py, PyArray1<u8>>)>
    {
        let places = rows(&points)?.iter().zip(rows(&normals)?);
        let probe = |(point, normal): (&[f64; 3], &[f64; 3])| Probe {
            point: DVec3::from(*point),
            normal: DVec3::from(*normal),
        };
        let probes: Vec<Probe> = places.map(probe).collect();
        let usual = GatherOptions::default();
        let samples = samples.unwrap_or(usual.samples);
        let options = GatherOptions { samples, seed: self.seed, error: self.error, ..usual };
        let found = run(py, progress, |progress| {
            let field = self.solution.field_heard(&self.scene, progress)?;
            let bvh = Bvh::new(&self.scene.geometry);
            progress.stage("points", probes.len() as u64);
            let gatherer =
                Gatherer::new_heard(&self.scene, &self.solution, &field, &bvh, options, progress)?;
            let mut found = gatherer.all(&probes, progress)?;
            // A field lets a little light out under walls.
            const DARK: f64 = 1e-4;
            let brightest = found.iter().map(|e| luminance(e.irradiance)).fold(0.0, f64::max);
            for (e, probe) in found.iter_mut().zip(&probes) {
                *e = e.or_outside(probe, &self.scene.geometry, &bvh, DARK * brightest);
            }
            Ok(found)
        })?;
        let place = |place| match place {
            Place::Free => 0,
            Place::Covered => 1,
            Place::OnEmitter => 2,
            Place::Outside => 3,
        };
        Ok((
            triples(py, found.iter().map(|e| e.irradiance.to_array()))?,
            triples(py, found.iter().map(|e| e.error.to_array()))?,
            PyArray1::from_iter(py, found.iter().map(|e| place(e.place))),
        ))
    }

    /// Radiance (height, width, 3) that a camera sees.
    #[pyo3(signature = (looked, progress=None))]
    fn render<'py>(
        &self,
        py: Python<'py>,
        looked: Looked,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Bound<'py, PyArray3<f32>>> {
        let picture = run(py, progress, |progress| {
            let view = looked.view(&self.scene)?;
            self.looking(progress, |renderer| {
                let radiance = |sight: &Sight| sight.radiance.to_array().map(|l| l as f32);
                Ok(view.mapped_by(renderer, radiance, progress).map_err(remedy::of_picture)?.0)
            })
        })?;
        let (width, height) = (picture.width, picture.height);
        picture.pixels.into_flattened().into_pyarray(py).reshape([height, width, 3])
    }

    /// Writes the model with its light as .glb, a lightmap's floats beside it as .exr; yields what
    /// was written.
    #[pyo3(signature = (path, mode, texel, exposure, progress=None))]
    fn bake(
        &self,
        py: Python<'_>,
        path: PathBuf,
        mode: &str,
        texel: Option<f64>,
        exposure: Option<f64>,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Vec<PathBuf>> {
        let mode = match mode {
            "vertex" => BakeMode::Vertex,
            "lightmap" => BakeMode::Lightmap { keeps_lamps: true },
            _ => BakeMode::Unlit,
        };
        run(py, progress, |progress| {
            let scene = &*self.scene;
            self.looking(progress, |renderer| {
                let view = View::of(scene).map_err(remedy::of_picture)?;
                let aspect = view.picture.width as f64 / view.picture.height as f64;
                let factor = match exposure {
                    Some(stops) => stops.exp2(),
                    None => renderer
                        .auto_exposure(&view.camera, aspect, KEY)
                        .map_err(remedy::of_picture)?,
                };
                let unlit = mode == BakeMode::Unlit;
                let shown = |s: &Sight| match unlit {
                    true => Tone::Agx.map(s.radiance * factor),
                    false => [0.0; 3],
                };
                let options = BakeOptions { texel, memory: self.options.memory };
                let bake = Bake::new(scene, &self.solution, renderer, &options, shown, progress);
                let bake = bake.map_err(remedy::of_bake)?;
                let mut written = vec![path.clone()];
                write_glb(&path, scene, &bake, mode).map_err(remedy::of_export)?;
                if let BakeMode::Lightmap { .. } = mode {
                    let floats = path.with_extension("exr");
                    write_exr(&floats, bake.size(), &bake.lambertian())
                        .map_err(remedy::of_export)?;
                    let layout = path.with_extension("json");
                    let text = serde_json::to_string_pretty(&bake.layout());
                    let text = text.map_err(|e| Failure::Failed(e.to_string()))?;
                    write_whole(&layout, text.as_bytes()).map_err(remedy::of_export)?;
                    written.extend([floats, layout]);
                }
                Ok(written)
            })
        })
    }

    /// Solves for each source of light by itself, and writes that as .hemi.
    #[pyo3(signature = (path, progress=None))]
    fn save(&self, py: Python<'_>, path: PathBuf, progress: Option<Py<PyAny>>) -> PyResult<()> {
        run(py, progress, |progress| {
            let sources = sources(&self.scene, &[]).map_err(|e| Failure::Input(e.to_string()))?;
            let (store, factors) = Store::solve(&self.scene, sources, &self.options, progress)
                .map_err(remedy::of_light)?;
            write_hemi(&path, &self.scene, &store, &factors, progress).map_err(remedy::of_export)
        })
    }

    /// What happened, as JSON.
    #[getter]
    fn report(&self, py: Python<'_>) -> PyResult<String> {
        let json = serde_json::to_string(&self.solution.report);
        json.map_err(|e| Failure::Failed(e.to_string()).raise(py))
    }
}

impl Light {
    /// What `look` yields with a renderer of this light.
    fn looking<T>(
        &self,
        progress: &dyn Progress,
        look: impl FnOnce(&Renderer<'_>) -> Result<T, Failure>,
    ) -> Result<T, Failure> {
        let field = self.solution.field_heard(&self.scene, progress)?;
        let bvh = Bvh::new(&self.scene.geometry);
        let options = GatherOptions { error: self.error, ..GatherOptions::of_pictures(self.seed) };
        let gatherer =
            Gatherer::new_heard(&self.scene, &self.solution, &field, &bvh, options, progress)?;
        look(&Renderer::gathering(&self.scene, &field, &gatherer))
    }
}
