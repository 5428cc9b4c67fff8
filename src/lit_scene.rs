//! The front door: a scene is lit once, then looked at and measured as often as one likes.
//!
//! [`Scene::light`] yields a [`LitScene`]; a [`View`] of it is a picture, a [`Probe`] a
//! measurement. [`Scene::form_factors`] yields the matrix. All of it stands on the modules above,
//! which say more and ask for more.

use crate::form_factors::FormFactors;
use crate::gather::{Estimate, GatherOptions, Gatherer, Probe};
use crate::matrix::{self, Matrix, MatrixError, MatrixOptions};
use crate::progress::{Cancelled, Progress};
use crate::reconstruct::Field;
use crate::render::{Picture, PictureOptions, PixelErrors, RenderError, Renderer, Sight};
use crate::scene::{Camera, Scene};
use crate::solution::{LightError, LightOptions, Solution, Work, light};
use crate::staging::{Lens, Model, viewpoint};
use crate::store::{Source, Store};
use crate::tone::{KEY, Tone};
use crate::uncertainty::{light_within, light_within_shared};
use crate::visibility::Bvh;

/// A scene and its light.
#[derive(Debug, Clone)]
pub struct LitScene<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// Irradiance of its patches, and how it came about.
    pub solution: Solution,
}

/// A picture to be taken.
#[derive(Debug, Clone, PartialEq)]
pub struct View {
    /// From where, and in which direction.
    pub camera: Camera,
    /// Size and quality. Default: 720 pixels high, as wide as the camera wants.
    pub picture: PictureOptions,
    /// Exposure in stops: each doubles what radiance becomes. `None`, the default, brings the mean
    /// of what is lit to middle grey.
    pub exposure: Option<f64>,
    /// The tone curve. Default AgX.
    pub tone: Tone,
}

/// A picture that was taken.
#[derive(Debug, Clone, PartialEq)]
pub struct Shot {
    /// Linear display light.
    pub picture: Picture,
    /// Its exposure, in stops.
    pub exposure: f64,
    /// How well each pixel is known, unless it is a draft.
    pub errors: Option<PixelErrors>,
}

impl Scene {
    /// Lights the scene: subdivides it, makes form factors and solves the balance. With
    /// [`LightOptions::error`] rays and patches are chosen for the error asked for.
    ///
    /// # Errors
    /// If the options do not suit the scene or each other, or the work does not fit in memory.
    pub fn light(
        &self,
        options: &LightOptions,
        progress: &dyn Progress,
    ) -> Result<LitScene<'_>, LightError> {
        let solution = match options.error {
            Some(error) => light_within(self, options, error, progress)?.0,
            None => light(self, options, progress)?,
        };
        Ok(LitScene { scene: self, solution })
    }

    /// Solves the scene for each of its `sources` ([`sources`](crate::store::sources)); also yields
    /// the form factors. [`Store::mix`] is then the light of any lamps. With
    /// [`LightOptions::error`] rays and patches are those that all light together asks for.
    ///
    /// # Errors
    /// As [`light`](Self::light).
    pub fn solve(
        &self,
        sources: Vec<Source>,
        options: &LightOptions,
        progress: &dyn Progress,
    ) -> Result<(Store, FormFactors), LightError> {
        self.solve_shared(sources, options, &Work::default(), progress)
    }

    /// The same where several ranks share the work, or rows are kept for another run: each rank has
    /// all solutions, and the entries of its own rows.
    ///
    /// # Errors
    /// As [`light`](Self::light); if ranks are asked for what one process does alone, or cannot
    /// reach each other.
    pub fn solve_shared(
        &self,
        sources: Vec<Source>,
        options: &LightOptions,
        work: &Work<'_>,
        progress: &dyn Progress,
    ) -> Result<(Store, FormFactors), LightError> {
        let options = match options.error {
            Some(error) => light_within_shared(self, options, error, work, progress)?.1,
            None => *options,
        };
        Store::solve_shared(self, sources, &options, work, progress)
    }

    /// The matrix of form factors (view factors) of the scene: row i is face i.
    ///
    /// # Errors
    /// As [`matrix::make`].
    pub fn form_factors(
        &self,
        options: &MatrixOptions,
        progress: &dyn Progress,
    ) -> Result<Matrix, MatrixError> {
        let mut matrix = matrix::make(&self.geometry, options, progress)?;
        matrix.report.scene.clone_from(&self.name);
        Ok(matrix)
    }
}

impl View {
    /// What the scene's first camera sees; a scene without cameras is seen from a point that is
    /// chosen.
    ///
    /// # Errors
    /// If there is nothing to see.
    pub fn of(scene: &Scene) -> Result<Self, RenderError> {
        let camera = match scene.cameras.first() {
            Some(camera) => camera.clone(),
            None => {
                let model = Model::of(scene).ok_or(RenderError::Nothing)?;
                viewpoint(&model, model.kind(), &Lens::default()).camera
            }
        };
        Ok(Self::through(camera))
    }

    /// What a camera sees.
    #[must_use]
    pub fn through(camera: Camera) -> Self {
        /// Pixels down, and width over height of cameras without an opinion.
        const HEIGHT: usize = 720;
        const ASPECT: f64 = 4.0 / 3.0;
        let width = (HEIGHT as f64 * camera.aspect.unwrap_or(ASPECT)).round() as usize;
        let picture = PictureOptions { width, height: HEIGHT, ..PictureOptions::default() };
        Self { camera, picture, exposure: None, tone: Tone::Agx }
    }

    /// What a renderer sees.
    ///
    /// # Errors
    /// As [`Renderer::render`].
    pub fn taken_by(
        &self,
        renderer: &Renderer<'_>,
        progress: &dyn Progress,
    ) -> Result<Shot, RenderError> {
        let aspect = self.picture.width as f64 / self.picture.height as f64;
        let factor = match self.exposure {
            Some(stops) => stops.exp2(),
            None => renderer.auto_exposure(&self.camera, aspect, KEY)?,
        };
        let shown = |radiance| self.tone.map(radiance * factor);
        let (picture, errors) = self.mapped_by(renderer, |s| shown(s.radiance), progress)?;
        Ok(Shot { picture, exposure: factor.log2(), errors })
    }

    /// What a renderer sees, each sample mapped by `map`, and how well pixels are known.
    ///
    /// # Errors
    /// As [`Renderer::render`].
    pub fn mapped_by(
        &self,
        renderer: &Renderer<'_>,
        map: impl Fn(&Sight) -> [f32; 3] + Sync,
        progress: &dyn Progress,
    ) -> Result<(Picture, Option<PixelErrors>), RenderError> {
        progress.stage("picture", self.picture.height as u64);
        renderer.render_known(&self.camera, &self.picture, map, progress)
    }
}

impl LitScene<'_> {
    /// Irradiance as a smooth field over the surfaces.
    #[must_use]
    pub fn field(&self) -> Field<'_> {
        self.solution.field(self.scene)
    }

    /// The picture of a view, as linear display light. For many views make one [`Renderer`] of the
    /// [`field`](Self::field), and a [`Gatherer`].
    ///
    /// # Errors
    /// If the camera looks nowhere, the size is out of range, or the caller cancelled.
    pub fn look(&self, view: &View, progress: &dyn Progress) -> Result<Picture, RenderError> {
        let field = self.solution.field_heard(self.scene, progress)?;
        let bvh = Bvh::new(&self.scene.geometry);
        let options = GatherOptions::of_pictures(0);
        let gatherer =
            Gatherer::new_heard(self.scene, &self.solution, &field, &bvh, options, progress)?;
        let renderer = Renderer::gathering(self.scene, &field, &gatherer);
        Ok(view.taken_by(&renderer, progress)?.picture)
    }

    /// Irradiance at points, with its error.
    ///
    /// # Errors
    /// If the caller cancelled.
    pub fn probe(
        &self,
        probes: &[Probe],
        options: GatherOptions,
        progress: &dyn Progress,
    ) -> Result<Vec<Estimate>, Cancelled> {
        let field = self.solution.field_heard(self.scene, progress)?;
        let bvh = Bvh::new(&self.scene.geometry);
        progress.stage("points", probes.len() as u64);
        let gatherer =
            Gatherer::new_heard(self.scene, &self.solution, &field, &bvh, options, progress)?;
        gatherer.all(probes, progress)
    }
}
