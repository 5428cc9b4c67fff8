//! Light of a scene from what its sources bring about alone.

use std::sync::Arc;

use rayon::prelude::*;

use super::error::MixError;
use super::source::{Source, shine, unsolved};
use crate::engines::EngineReport;
use crate::form_factors::FormFactors;
use crate::patches::Patches;
use crate::progress::Progress;
use crate::report::{Clock, Report, Stage};
use crate::scene::{Rgb, Scene};
use crate::solution::{Balance, LightError, LightOptions, MeshOptions, Solution};
use crate::solve::EnergyBalance;

/// Solutions of a scene, one per source.
#[derive(Debug, Clone)]
pub struct Store {
    /// The patches.
    pub patches: Arc<Patches>,
    /// The sources.
    pub sources: Vec<Source>,
    /// Light of each source.
    pub(crate) balances: Vec<Balance>,
    /// Whether each patch's value stands for what is seen of it.
    pub(crate) usable: Vec<bool>,
    /// What each patch sees of what may emit.
    pub(crate) to_emitters: FormFactors,
    pub(crate) mesh: MeshOptions,
    pub(crate) engine: EngineReport,
    /// Of each triangle of the scene that was solved.
    pub(crate) reflectance: Vec<Rgb>,
    /// How long it took.
    pub(crate) stages: Vec<Stage>,
}

impl Store {
    /// Whether the surfaces of a scene reflect as those of the solution.
    #[must_use]
    pub fn reflects_as(&self, scene: &Scene) -> bool {
        self.reflectance == scene.optics.reflectance
    }

    /// The scene with some of the sources alone, as they were solved.
    #[must_use]
    pub fn shining(&self, scene: &Scene, sources: &[usize]) -> Scene {
        let mut into = scene.clone();
        let sources: Vec<&Source> = sources.iter().map(|&k| &self.sources[k]).collect();
        shine(scene, &sources, &mut into);
        into
    }

    /// The light of the scene that was solved, its sources emitting what they now do.
    ///
    /// # Errors
    /// If it is another scene, or something emits that was not solved for.
    pub fn mix(&self, scene: &Scene) -> Result<Solution, MixError> {
        if self.reflectance.len() != scene.geometry.len() {
            return Err(MixError::Foreign);
        }
        if !self.reflects_as(scene) {
            return Err(MixError::Reflectance);
        }
        let mut clock = Clock::start();
        let balance = self.mixed(scene)?;
        let (patches, usable) = (Arc::clone(&self.patches), self.usable.clone());
        let mut solution = Solution::new(scene, patches, &self.to_emitters, usable, balance)?;
        clock.lap("mix");
        self.sign(&mut solution, clock);
        Ok(solution)
    }

    /// The same for other reflectances: solved again, by the same form factors.
    ///
    /// # Errors
    /// As [`mix`](Self::mix), within the first result; if the system cannot be solved, or the
    /// caller cancelled.
    pub fn solve_mixed(
        &self,
        scene: &Scene,
        factors: &FormFactors,
        options: &LightOptions,
        progress: &dyn Progress,
    ) -> Result<Result<Solution, MixError>, LightError> {
        if self.reflectance.len() != scene.geometry.len() {
            return Ok(Err(MixError::Foreign));
        }
        let mut clock = Clock::start();
        let mixed = match self.mixed(scene) {
            Ok(mixed) => mixed,
            Err(error) => return Ok(Err(error)),
        };
        clock.lap("mix");
        let by = (&*self.patches, factors);
        let direct = mixed.straight();
        let mut balance = Balance::by_direct(scene, by, &direct, &[], options, progress)?;
        balance.energy.receive(mixed.energy.received);
        let (patches, usable) = (Arc::clone(&self.patches), self.usable.clone());
        let mut solution = Solution::new(scene, patches, factors, usable, balance)?;
        clock.lap("solve");
        self.sign(&mut solution, clock);
        Ok(Ok(solution))
    }

    /// How the solutions came about: all sources as strong as they were solved.
    #[must_use]
    pub fn report(&self, scene: &Scene) -> Report {
        let patches = &self.patches;
        let worst = self.balances.iter().filter_map(|b| b.solved);
        let all = self.balances.iter().map(|b| (Rgb::ONE, &b.energy));
        Report {
            scene: scene.name.clone(),
            source_triangles: scene.geometry.len(),
            patches: patches.len(),
            clusters: patches.ids().filter(|&i| patches.is_cluster(i)).count(),
            patch_size: self.mesh.patch_size,
            contacts_left_out: patches.contacts_left_out(),
            engine: Some(self.engine.clone()),
            solve: worst.max_by(|a, b| a.residual.total_cmp(&b.residual)),
            energy: Some(EnergyBalance::sum(all)),
            stages: self.stages.clone(),
            ..Report::default()
        }
    }

    /// Says how a solution came about.
    fn sign(&self, solution: &mut Solution, clock: Clock) {
        solution.report.patch_size = self.mesh.patch_size;
        solution.report.engine = Some(self.engine.clone());
        solution.report.stages = clock.stages;
    }

    /// The sum of what sources bring about, as strong as they are in `scene`.
    fn mixed(&self, scene: &Scene) -> Result<Balance, MixError> {
        if let Some(name) = unsolved(scene, &self.sources) {
            return Err(MixError::Unsolved(name));
        }
        let weights: Result<Vec<Rgb>, MixError> =
            self.sources.iter().map(|s| s.weight(scene)).collect();
        let parts: Vec<(Rgb, &Balance)> = weights?.into_iter().zip(&self.balances).collect();
        let lit: Vec<(Rgb, &Balance)> =
            parts.iter().copied().filter(|(w, _)| *w != Rgb::ZERO).collect();
        let n = self.patches.len();
        let sum = |of: &(dyn Fn(&Balance) -> &[Rgb] + Sync)| -> Vec<Rgb> {
            /// Patches that are summed at a time.
            const CHUNK: usize = 4096;
            let mut all = vec![Rgb::ZERO; n];
            all.par_chunks_mut(CHUNK).enumerate().for_each(|(chunk, all)| {
                for (weight, balance) in &lit {
                    let part = &of(balance)[chunk * CHUNK..][..all.len()];
                    all.iter_mut().zip(part).for_each(|(all, part)| *all += *weight * *part);
                }
            });
            all
        };
        let sampled = self.balances.iter().all(|b| b.spread.is_some());
        let spread = |k: usize| sum(&|b| b.spread.as_ref().map_or(&[][..], |s| &s[k]));
        Ok(Balance {
            direct: sum(&|b| &b.direct),
            irradiance: sum(&|b| &b.irradiance),
            arrived: sum(&|b| &b.arrived),
            spread: sampled.then(|| [spread(0), spread(1)]),
            energy: EnergyBalance::sum(parts.iter().map(|(w, b)| (*w, &b.energy))),
            solved: None,
        })
    }
}
