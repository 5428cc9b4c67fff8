//! Scenes: from arrays, from files, and built in.

use std::f64::consts::PI;
use std::path::PathBuf;
use std::sync::Arc;

use glam::DVec3;
use hemicube::scene::builtin::UnknownBuiltin;
use hemicube::scene::geometry::MAX_COORDINATE;
use hemicube::scene::inspect::doubtful_unit;
use hemicube::scene::optics::MOST_RADIANCE;
use hemicube::scene::{
    self, GroupBy, ImportOptions, Lamp, Material, Optics, Severity, SidesChoice,
};
use numpy::{PyArray1, PyArray2, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;

use crate::arrays::triples;
use crate::failure::Failure;
use crate::remedy;
use crate::work::{run, run_unheard, warn};

/// A model: its surfaces, their materials, and its lamps.
#[pyclass(module = "hemicube._hemicube", frozen)]
pub struct Scene(pub Arc<scene::Scene>);

/// Positions and corners of triangles.
type Mesh<'py> = (PyReadonlyArray2<'py, f64>, PyReadonlyArray2<'py, u32>);

/// The same, borrowed.
type Borrowed<'a> = (&'a [[f64; 3]], &'a [[u32; 3]]);

#[pymethods]
impl Scene {
    /// A scene of arrays (n, 3) and (m, 3) that were checked.
    #[staticmethod]
    #[pyo3(signature = (vertices, faces, obstacles=None))]
    fn from_arrays(
        py: Python<'_>,
        vertices: PyReadonlyArray2<'_, f64>,
        faces: PyReadonlyArray2<'_, u32>,
        obstacles: Option<Mesh<'_>>,
    ) -> PyResult<Self> {
        let (vertices, faces) = (rows(&vertices)?, rows(&faces)?);
        let obstacles = obstacles.as_ref().map(borrowed).transpose()?;
        let scene = run(py, None, |_| {
            let made = scene::Scene::from_arrays(vertices, faces, &[Material::default()], &[]);
            let mut scene = made.map_err(|e| Failure::Input(e.to_string()))?;
            obstruct(&mut scene, obstacles)?;
            Ok(scene)
        })?;
        Ok(Self(Arc::new(scene)))
    }

    /// Reads a file; `unit` is in metres. What is doubtful about materials is said if it is to be
    /// `lit`.
    #[staticmethod]
    #[pyo3(signature = (path, unit, up, sides, max_reflectance, lit))]
    fn load(
        py: Python<'_>,
        path: PathBuf,
        unit: f64,
        up: Option<[f64; 3]>,
        sides: &str,
        max_reflectance: f64,
        lit: bool,
    ) -> PyResult<Self> {
        let (up, sides) = (up.map(DVec3::from), choice(py, sides)?);
        let options = ImportOptions { unit, up, max_reflectance, sides };
        let load = move || scene::load(&path, &options).map_err(|e| remedy::of_import(&e));
        let scene = run_unheard(py, load)?;
        let unit = doubtful_unit(&scene.geometry);
        for finding in scene.findings.iter().chain(&unit) {
            let counts = lit || !finding.message.contains("reflectance");
            if counts && finding.severity == Severity::Warning {
                warn(py, &remedy::of_finding(finding))?;
            }
        }
        Ok(Self(Arc::new(scene)))
    }

    /// A built-in scene.
    #[staticmethod]
    fn builtin(py: Python<'_>, name: &str) -> PyResult<Self> {
        let unknown = |UnknownBuiltin { name, known }| {
            let text = format!("{name}: no such file, nor a built-in scene; these are {known}");
            Failure::Input(text).raise(py)
        };
        Ok(Self(Arc::new(scene::Scene::builtin(name).map_err(unknown)?)))
    }

    /// The same with other sides, turned round, or with obstacles.
    #[pyo3(signature = (sides, flip, obstacles=None))]
    fn changed(
        &self,
        py: Python<'_>,
        sides: &str,
        flip: bool,
        obstacles: Option<Mesh<'_>>,
    ) -> PyResult<Self> {
        let sides = choice(py, sides)?;
        let obstacles = obstacles.as_ref().map(borrowed).transpose()?;
        let scene = run(py, None, |_| {
            let mut scene = scene::Scene::clone(&self.0);
            scene.choose_sides(sides);
            if flip {
                scene.flip();
            }
            obstruct(&mut scene, obstacles)?;
            Ok(scene)
        })?;
        Ok(Self(Arc::new(scene)))
    }

    /// The same with a sky of this uniform radiance.
    fn with_sky(&self, py: Python<'_>, radiance: [f64; 3]) -> PyResult<Self> {
        bounded(py, "sky: its radiance", radiance.into())?;
        Ok(self.edited(|scene| scene.sky = radiance.into()))
    }

    /// Radiance of the sky.
    #[getter]
    fn sky(&self) -> [f64; 3] {
        self.0.sky.to_array()
    }

    /// The same with a lamp that sends out this flux alike in all directions.
    fn with_lamp(
        &self,
        py: Python<'_>,
        name: String,
        position: [f64; 3],
        flux: [f64; 3],
    ) -> PyResult<Self> {
        let (position, intensity) = (DVec3::from(position), DVec3::from(flux) / (4.0 * PI));
        if position.abs().max_element() > MAX_COORDINATE {
            let text = format!("position: {position} exceeds {MAX_COORDINATE:e} metres");
            return Err(Failure::Input(text).raise(py));
        }
        bounded(py, "flux: the intensity of the lamp", intensity)?;
        let (x_axis, photometry) = (DVec3::X, None);
        let lamp = Lamp::Point { name, position, intensity, x_axis, photometry };
        Ok(self.edited(|scene| scene.lamps.push(lamp)))
    }

    /// The same with parallel light from where `toward`, of length 1, points.
    fn with_sun(&self, py: Python<'_>, toward: [f64; 3], irradiance: [f64; 3]) -> PyResult<Self> {
        let (name, direction) = ("sun".to_owned(), -DVec3::from(toward));
        let irradiance = irradiance.into();
        bounded(py, "irradiance: that of the sun", irradiance)?;
        let sun = Lamp::Directional { name, direction, irradiance };
        Ok(self.edited(|scene| scene.lamps.push(sun)))
    }

    /// The same where materials of that name have this radiance; None without any.
    fn with_emission(
        &self,
        py: Python<'_>,
        name: &str,
        radiance: [f64; 3],
    ) -> PyResult<Option<Self>> {
        let radiance = radiance.into();
        bounded(py, "radiance: that of the material", radiance)?;
        Ok(self.with_material(name, |optics, m| optics.set_radiance(m, radiance)))
    }

    /// The same where materials of that name have this reflectance; None without any.
    fn with_reflectance(&self, name: &str, reflectance: [f64; 3]) -> Option<Self> {
        self.with_material(name, |optics, m| optics.set_reflectance(m, reflectance.into()))
    }

    #[getter]
    fn name(&self) -> &str {
        &self.0.name
    }

    /// Positions (n, 3), m.
    fn vertices<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        triples(py, self.0.geometry.vertices.iter().map(|v| v.to_array()))
    }

    /// Corners of the file's faces (m, 3).
    fn faces<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<u32>>> {
        let geometry = &self.0.geometry;
        let corners = |(face, t): (u32, Option<usize>)| {
            let whole = geometry.cut_faces.get(&face).copied();
            whole.or(t.map(|t| geometry.triangles[t])).unwrap_or_default()
        };
        triples(py, self.first_of_face().into_iter().map(corners))
    }

    /// Names by surface, material or object, and of each face the index of its own.
    fn grouping<'py>(&self, py: Python<'py>, by: &str) -> (Vec<String>, Bound<'py, PyArray1<u32>>) {
        let grouping = self.0.grouping(match by {
            "material" => GroupBy::Material,
            "object" => GroupBy::Object,
            _ => GroupBy::Surface,
        });
        let own = |(_, t): (u32, Option<usize>)| t.map_or(0, |t| grouping.of[t]);
        let of: Vec<u32> = self.first_of_face().into_iter().map(own).collect();
        (grouping.names, PyArray1::from_vec(py, of))
    }
}

impl Scene {
    fn edited(&self, edit: impl FnOnce(&mut scene::Scene)) -> Self {
        let mut scene = scene::Scene::clone(&self.0);
        edit(&mut scene);
        Self(Arc::new(scene))
    }

    fn with_material(&self, name: &str, edit: impl Fn(&mut Optics, usize)) -> Option<Self> {
        let named = |m: &usize| self.0.optics.materials[*m].name == name;
        let found: Vec<usize> = (0..self.0.optics.materials.len()).filter(named).collect();
        let all = |scene: &mut scene::Scene| found.iter().for_each(|&m| edit(&mut scene.optics, m));
        (!found.is_empty()).then(|| self.edited(all))
    }

    /// The faces of the file, each with its first triangle.
    fn first_of_face(&self) -> Vec<(u32, Option<usize>)> {
        let geometry = &self.0.geometry;
        let mut first: Vec<(u32, Option<usize>)> =
            (0..geometry.faces() as u32).map(|face| (face, None)).collect();
        for t in geometry.ids() {
            first[geometry.face(t) as usize].1.get_or_insert(t.index());
        }
        first
    }
}

/// Rows of three, without a copy.
pub fn rows<'a, T: numpy::Element>(array: &'a PyReadonlyArray2<'_, T>) -> PyResult<&'a [[T; 3]]> {
    debug_assert_eq!(array.shape()[1], 3);
    Ok(array.as_slice()?.as_chunks().0)
}

fn borrowed<'a>((vertices, faces): &'a Mesh<'_>) -> PyResult<Borrowed<'a>> {
    Ok((rows(vertices)?, rows(faces)?))
}

/// Adds what only blocks, if there is any.
fn obstruct(scene: &mut scene::Scene, obstacles: Option<Borrowed<'_>>) -> Result<(), Failure> {
    let Some((vertices, faces)) = obstacles else { return Ok(()) };
    let added = scene.add_obstacles(vertices, faces);
    added.map_err(|e| Failure::Input(format!("obstacles: {e}")))
}

/// Refuses light that no file of a scene may have; `what` says whose.
fn bounded(py: Python<'_>, what: &str, light: DVec3) -> PyResult<()> {
    if light.max_element() <= MOST_RADIANCE {
        return Ok(());
    }
    let text = format!("{what} exceeds {MOST_RADIANCE:e}; is it in the right unit?");
    Err(Failure::Input(text).raise(py))
}

/// What `sides=` says.
fn choice(py: Python<'_>, sides: &str) -> PyResult<SidesChoice> {
    match sides {
        "file" => Ok(SidesChoice::File),
        "one" => Ok(SidesChoice::One),
        "two" => Ok(SidesChoice::Two),
        _ => {
            let text = format!("sides={sides:?}: give 'one', 'two' or 'file'");
            Err(Failure::Input(text).raise(py))
        }
    }
}
