//! How much work a pair deserves: more if its factor is large, and if the error asked for is small.
//!
//! Here, factors are in units of the root-mean-square factor of the scene.

use super::samples::MOST_RAYS;

/// More blockers than this are a crowd.
pub(super) const CROWD: usize = 64;

/// A crowd between no more pairs of patches than this is left to rays.
const FEW_PAIRS: usize = 64;

/// Sorting out one blocker takes as long as this many shadow rays.
const SORTING: f64 = 256.0;

/// So few blockers are sorted out in any case.
const SOON: usize = 6;

/// Sorting out is worth at most the rays that pairs of this factor get.
const WORTH_SORTING: f64 = 0.1;

/// Clipping a pair takes as long as this many rays more than it has blockers. If it deserves no
/// more rays than that, it gets rays.
const CLIPPING: u32 = 4;

/// Shadow rays of a pair of the root-mean-square factor at the error 1e-3. Rays are stratified:
/// their error falls faster than the root of their number.
const RAYS: f64 = 640.0;
const RAYS_BY_ERROR: f64 = 1.5;

/// Patches that straddle each other's plane are clipped if their factor is larger than this times
/// the error asked for: the far rule errs by some percent of it.
const STRADDLING: f64 = 100.0;

/// The error that the visible fraction of a pair of the root-mean-square factor may have, over the
/// error asked for.
const TOLERANCE: f64 = 2.0;

/// Finding out which blockers lie between one pair takes as long as this many rays.
const FINDING: u32 = 24;

/// Blockers projected or subtracted for a pair of the root-mean-square factor at the error 1e-3, at
/// the least and at the most.
const WORK: usize = 1 << 13;
const MOST_WORK: usize = 1 << 18;

/// Clipping the parts of a pair one by one takes as long as this many rays for each.
pub(super) const EACH_PART: u32 = 200;

/// A pair on its own gets this many times the rays that it gets among neighbours.
const ALONE: u32 = 4;

/// What work depends on.
#[derive(Debug, Clone, Copy)]
pub(super) struct Effort {
    /// Root-mean-square error that is worked towards, over the root-mean-square factor.
    pub error: f64,
    /// The number of rays over the usual one.
    pub scale: f64,
}

impl Effort {
    /// Shadow rays that a pair usually deserves, at least one.
    pub fn usual_rays(self, factor: f64) -> u32 {
        let rays = RAYS * factor * (1e-3 / self.error).powf(RAYS_BY_ERROR);
        rays.clamp(1.0, MOST_RAYS as f64) as u32
    }

    /// Shadow rays of a pair that deserves `usual` ones, to reach the error.
    pub fn rays(self, usual: u32) -> u32 {
        (self.scale * f64::from(usual)).clamp(1.0, MOST_RAYS as f64) as u32
    }

    /// Shadow rays of a pair that deserves `usual` ones and consists of so many parts; `None` if
    /// clipping takes less time.
    pub fn rays_of_parts(self, usual: u32, parts: usize) -> Option<u32> {
        let rays = ALONE * usual;
        (rays as usize <= EACH_PART as usize * parts).then(|| self.rays(rays).max(rays))
    }

    /// The error that the visible fraction of a pair evaluated on its own may have. Work is least
    /// for the error of all if large factors err by more, but by less of themselves.
    pub fn tolerance(self, factor: f64) -> f64 {
        (TOLERANCE * self.error / factor.max(1e-9).sqrt()).min(0.25)
    }

    /// How many times blockers may be projected or subtracted for a pair.
    pub fn work(self, factor: f64) -> usize {
        let work = WORK as f64 * factor * (1e-3 / self.error);
        (work as usize).clamp(WORK, MOST_WORK)
    }

    /// Whether the far rule is good enough for patches that straddle each other's plane.
    pub fn may_straddle(self, factor: f64) -> bool {
        factor <= STRADDLING * self.error
    }

    /// Whether rays take less time than sorting out this many blockers between some pairs whose
    /// factor is about `factor`.
    pub fn is_crowd(self, blockers: usize, pairs: usize, factor: f64) -> bool {
        let rays = self.usual_rays(factor.min(WORTH_SORTING));
        let never_clipped = blockers > CROWD && pairs <= FEW_PAIRS;
        let long = blockers as f64 * SORTING > f64::from(rays) * pairs as f64;
        never_clipped || long && blockers > SOON
    }
}

/// Whether this many rays take less time than clipping this many blockers; `None` for a crowd, of
/// which those between the pair are to be found first.
pub(super) fn left_to_rays(blockers: Option<usize>, rays: u32) -> bool {
    match blockers {
        Some(count) => count > 0 && rays <= CLIPPING + count as u32,
        None => rays <= FINDING,
    }
}
