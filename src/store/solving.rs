//! A solution per source of a scene.

use super::mixing::Store;
use super::source::{Source, shine};
use crate::direct;
use crate::form_factors::FormFactors;
use crate::progress::Progress;
use crate::report::Clock;
use crate::scene::{Rgb, Scene};
use crate::solution::{Balance, LightError, LightOptions, Transport, Work, lamps};

impl Store {
    /// Solves a scene for each of its sources; also yields the form factors. Options are as for
    /// [`Scene::light`](crate::Scene::light), without an error to reach.
    ///
    /// # Errors
    /// If the options do not suit the scene or each other, or the work does not fit in memory.
    pub fn solve(
        scene: &Scene,
        sources: Vec<Source>,
        options: &LightOptions,
        progress: &dyn Progress,
    ) -> Result<(Self, FormFactors), LightError> {
        Self::solve_shared(scene, sources, options, &Work::default(), progress)
    }

    /// The same where several ranks share the work, or rows are kept for another run: each rank has
    /// all solutions, and the entries of its own rows.
    ///
    /// # Errors
    /// As [`solve`](Self::solve); if ranks are asked for what one process does alone, or cannot
    /// reach each other.
    pub fn solve_shared(
        scene: &Scene,
        sources: Vec<Source>,
        options: &LightOptions,
        work: &Work<'_>,
        progress: &dyn Progress,
    ) -> Result<(Self, FormFactors), LightError> {
        let mut clock = Clock::start();
        // Rows are made for all that any of the sources lights.
        let mut alone = scene.clone();
        shine(scene, &sources.iter().collect::<Vec<_>>(), &mut alone);
        let transport = Transport::of(&alone, options, work, &mut clock, progress)?;
        let Transport { patches, factors, .. } = &transport;
        let emission = direct::emission(&alone.optics, patches);
        let to_emitters = factors.thinned(|j| emission[j.index()] != Rgb::ZERO);
        let mut balances = Vec::new();
        for source in &sources {
            shine(scene, &[source], &mut alone);
            let lamps = lamps(&alone, patches, &transport.bvh, &work.ranks)?;
            let (of, by) = (&alone, &transport);
            balances.push(Balance::of(of, by, &lamps, options, &mut clock, progress)?);
        }
        let store = Self {
            patches: patches.clone(),
            usable: transport.usable(),
            sources,
            balances,
            to_emitters,
            mesh: transport.mesh,
            engine: transport.engine,
            reflectance: scene.optics.reflectance.clone(),
            stages: clock.stages,
        };
        Ok((store, transport.factors))
    }

    /// Solves the same for other reflectances, by the same form factors.
    ///
    /// # Errors
    /// If the system cannot be solved, or the caller cancelled.
    pub fn solve_again(
        mut self,
        scene: &Scene,
        factors: &FormFactors,
        options: &LightOptions,
        progress: &dyn Progress,
    ) -> Result<Self, LightError> {
        let mut alone = scene.clone();
        let mut clock = Clock::start();
        for (source, balance) in self.sources.iter().zip(&mut self.balances) {
            shine(scene, &[source], &mut alone);
            let direct = balance.straight();
            let received = balance.energy.received;
            let by = (&*self.patches, factors);
            *balance = Balance::by_direct(&alone, by, &direct, &[], options, progress)?;
            balance.energy.receive(received);
        }
        clock.lap("solve");
        self.stages = clock.stages;
        self.reflectance.clone_from(&scene.optics.reflectance);
        Ok(self)
    }
}
