//! Light of a scene on its patches. All of it is linear in what emits: light of several sources
//! together is the sum of the light of each.

use std::f64::consts::PI;

use super::error::LightError;
use super::halves::solve_halves;
use super::options::LightOptions;
use super::transport::Transport;
use crate::direct::{self, DirectLight};
use crate::form_factors::FormFactors;
use crate::patches::Patches;
use crate::progress::Progress;
use crate::report::Clock;
use crate::scene::{Rgb, Scene};
use crate::solve::{EnergyBalance, SolveReport, System, solve};

/// Irradiance of each patch, W/m² or lx, and where it comes from.
#[derive(Debug, Clone, Default)]
pub(crate) struct Balance {
    /// D: what arrives straight from emitters, lamps and the sky.
    pub direct: Vec<Rgb>,
    /// H: all that arrives.
    pub irradiance: Vec<Rgb>,
    /// What other surfaces reflect, and what comes from the sky.
    pub arrived: Vec<Rgb>,
    /// Half of what two independent halves of the rays differ in, where rows are sampled: of H, and
    /// of D.
    pub spread: Option<[Vec<Rgb>; 2]>,
    pub energy: EnergyBalance,
    /// How it was solved.
    pub solved: Option<SolveReport>,
}

impl Balance {
    /// That of a scene, whose lamps shine on patches as `lamps` says.
    pub fn of(
        scene: &Scene,
        transport: &Transport,
        lamps: &[Rgb],
        options: &LightOptions,
        clock: &mut Clock,
        progress: &dyn Progress,
    ) -> Result<Self, LightError> {
        let Transport { patches, factors, bvh, .. } = transport;
        let mut direct = match transport.analytic {
            Some(options) => {
                progress.stage("direct light", 0);
                let found = direct::analytic(scene, patches, factors, bvh, options)?;
                clock.lap("direct light");
                found
            }
            None => {
                let emission = direct::emission(&scene.optics, patches);
                let found = direct::through_rows(factors, &emission, scene.sky);
                found.into_iter().map(DirectLight::from).collect()
            }
        };
        for (direct, lamps) in direct.iter_mut().zip(lamps) {
            *direct += *lamps;
        }
        let by = (&**patches, factors);
        let found = Self::by_direct(scene, by, &direct, lamps, options, progress)?;
        clock.lap("solve");
        Ok(found)
    }

    /// That of a scene whose direct light is known; `lamps` is the part of it that is of lamps.
    pub fn by_direct(
        scene: &Scene,
        (patches, factors): (&Patches, &FormFactors),
        direct: &[DirectLight],
        lamps: &[Rgb],
        options: &LightOptions,
        progress: &dyn Progress,
    ) -> Result<Self, LightError> {
        let rho = direct::reflectance(&scene.optics, patches);
        let emission = direct::emission(&scene.optics, patches);
        let areas: Vec<f64> = patches.ids().map(|i| patches.own_area(i)).collect();
        let all: Vec<Rgb> = direct.iter().map(|d| d.irradiance).collect();
        let system = System { factors, rho: &rho, direct: &all, areas: &areas };
        progress.stage("solve", 0);
        let halves = factors.halves();
        let solving = options.solve(halves.is_some());
        let (irradiance, solved) = solve(&system, &solving, progress)?;
        let spread = match halves {
            Some(halves) => {
                let all = solve_halves(&system, &halves, direct, &irradiance, options, progress)?;
                let straight = direct.iter().map(|d| (d.halves[0] - d.halves[1]) * 0.5).collect();
                Some([all, straight])
            }
            None => None,
        };
        let sent: Vec<Rgb> = rho.iter().zip(&irradiance).map(|(rho, h)| *rho * *h).collect();
        let arrived = factors.of_own(|i| {
            let sky = scene.sky * (PI * factors.account(i).environment);
            factors.gather(i, &sent) + sky
        });
        let arrived = factors.share_exactly(arrived)?;
        let energy = EnergyBalance::of(&system, &emission, scene.sky, lamps, &irradiance);
        Ok(Self { direct: all, irradiance, arrived, spread, energy, solved: Some(solved) })
    }

    /// What arrives straight, with what two halves of the shadow rays make of it.
    pub fn straight(&self) -> Vec<DirectLight> {
        let off = self.spread.as_ref().map(|[_, direct]| direct);
        let light = |(i, d): (usize, &Rgb)| {
            let off = off.map_or(Rgb::ZERO, |off| off[i]);
            DirectLight { irradiance: *d, halves: [*d + off, *d - off] }
        };
        self.direct.iter().enumerate().map(light).collect()
    }
}
