//! What the page may ask of work that is under way, and of its result.

use std::collections::BTreeMap;
use std::sync::{Arc, Condvar, Mutex, PoisonError};

use glam::DVec3;
use hemicube::bake::Facet;
use hemicube::engines::{Draw, Hemicube, HemicubeOptions, Item};
use hemicube::export::encode_picture;
use hemicube::form_factors::Row;
use hemicube::patches::PatchId;
use hemicube::progress::{Cancelled, Progress};
use hemicube::render::Picture;
use hemicube::scene::{Rgb, Scene, luminance};
use hemicube::solution::Solution;
use hemicube::uncertainty::Uncertainty;
use serde_json::{Value, json};

use crate::terminal::Bar;

/// The hemicubes that are shown: the paper's way of drawing them.
const HEMICUBE: HemicubeOptions = HemicubeOptions { resolution: 256, draw: Draw::Patches };

/// A scene that is lit, and all that is told of its patches.
pub struct Lit {
    pub scene: Scene,
    pub solution: Solution,
    pub uncertainty: Uncertainty,
    /// The triangles of the page, by number.
    pub facets: Vec<Facet>,
}

/// How work stands, and what there is to show of it.
#[derive(Default)]
pub struct Live {
    state: Mutex<State>,
    /// Told when something is wished for.
    wished: Condvar,
}

#[derive(Default)]
struct State {
    stage: String,
    total: u64,
    advanced: u64,
    version: u64,
    data: Arc<Vec<u8>>,
    lit: Option<Arc<Lit>>,
    done: bool,
    failure: Option<String>,
    /// Whether work stops for wishes: there is a solution to begin with again.
    heeds: bool,
    wishes: Wishes,
    /// The tolerance of the adaptive subdivision that is shown or in the making.
    tolerance: Option<f64>,
    /// Whether another subdivision may be wished for.
    splits: bool,
    /// Why the last wish was not fulfilled.
    refusal: Option<String>,
}

/// What the page wishes for.
#[derive(Debug, Default, PartialEq)]
pub struct Wishes {
    /// Materials that are to reflect otherwise.
    pub reflectances: BTreeMap<String, Rgb>,
    /// Another subdivision: adaptive with that tolerance, or, without one, uniform.
    pub subdivision: Option<Option<f64>>,
}

impl Wishes {
    fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}

impl Live {
    fn with<T>(&self, change: impl FnOnce(&mut State) -> T) -> T {
        change(&mut self.state.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// Shows something new.
    pub fn show(&self, data: Vec<u8>, lit: Lit) {
        self.with(|s| {
            s.version += 1;
            s.data = Arc::new(data);
            s.lit = Some(Arc::new(lit));
        });
    }

    /// Whether anything is shown yet.
    pub fn is_shown(&self) -> bool {
        self.with(|s| s.version > 0)
    }

    /// Says that nothing new will come unless it is wished for.
    pub fn rest(&self) {
        self.with(|s| s.done = s.wishes.is_empty());
    }

    /// Says why nothing will come any more.
    pub fn fail(&self, failure: String) {
        self.with(|s| (s.done, s.failure) = (true, Some(failure)));
    }

    /// From now on work stops where something is wished for.
    pub fn heed(&self) {
        self.with(|s| s.heeds = true);
    }

    /// Asks for a material that reflects otherwise.
    pub fn wish_reflectance(&self, material: String, reflectance: Rgb) {
        self.wish(|s| {
            s.wishes.reflectances.insert(material, reflectance);
        });
    }

    /// Asks for adaptive subdivision with that tolerance, or for none. False where patches cannot
    /// be made anew.
    pub fn wish_subdivision(&self, tolerance: Option<f64>) -> bool {
        let may = self.with(|s| s.splits);
        if may {
            self.wish(|s| {
                s.wishes.subdivision = Some(tolerance);
                s.tolerance = tolerance;
            });
        }
        may
    }

    /// Asks for something; work that heeds wishes stops.
    fn wish(&self, ask: impl FnOnce(&mut State)) {
        self.with(|s| {
            ask(s);
            (s.done, s.stage, s.total, s.refusal) = (false, "wait".into(), 0, None);
        });
        self.wished.notify_all();
    }

    /// Says what subdivision there is, and whether others may be wished for.
    pub fn subdivided(&self, tolerance: Option<f64>, splits: bool) {
        self.with(|s| (s.tolerance, s.splits) = (tolerance, splits));
    }

    /// Says why a subdivision was not made, and what there is instead, unless another one is wished
    /// for.
    pub fn refuse(&self, why: String, tolerance: Option<f64>) {
        self.with(|s| {
            if s.wishes.subdivision.is_none() {
                (s.refusal, s.tolerance) = (Some(why), tolerance);
            }
        });
    }

    /// Whether something is wished for.
    pub fn is_wished(&self) -> bool {
        self.with(|s| !s.wishes.is_empty())
    }

    /// Waits for wishes, and takes them.
    pub fn wishes(&self) -> Wishes {
        let state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        let waited = self.wished.wait_while(state, |s| s.wishes.is_empty());
        std::mem::take(&mut waited.unwrap_or_else(PoisonError::into_inner).wishes)
    }

    /// How work stands.
    pub fn state(&self) -> Value {
        self.with(|s| {
            let share = (s.total > 0).then(|| s.advanced as f64 / s.total as f64);
            json!({
                "stage": s.stage, "share": share.map(|s| s.min(1.0)), "version": s.version,
                "done": s.done, "failure": s.failure,
                "splits": s.splits, "tolerance": s.tolerance, "refusal": s.refusal,
            })
        })
    }

    /// The archive that is shown.
    pub fn data(&self) -> Arc<Vec<u8>> {
        self.with(|s| Arc::clone(&s.data))
    }

    /// What is known of the light that is shown, if it is of that version: facets and patches have
    /// other numbers in another.
    pub fn lit_of(&self, version: u64) -> Option<Arc<Lit>> {
        self.with(|s| s.lit.clone().filter(|_| s.version == version))
    }
}

/// Tells a terminal and a page how far work is.
pub struct Told<'a> {
    pub bar: &'a Bar,
    pub live: &'a Live,
}

impl Progress for Told<'_> {
    fn stage(&self, name: &str, total: u64) {
        self.live.with(|s| (s.stage, s.total, s.advanced) = (name.to_owned(), total, 0));
        self.bar.stage(name, total);
    }

    fn advance(&self, n: u64) -> Result<(), Cancelled> {
        let stop = self.live.with(|s| {
            s.advanced += n;
            s.heeds && !s.wishes.is_empty()
        });
        self.bar.advance(n)?;
        if stop { Err(Cancelled) } else { Ok(()) }
    }

    fn warn(&self, message: &str) {
        self.bar.warn(message);
    }
}

impl Lit {
    /// The row of form factors of the patch at a place of a facet: barycentric coordinates, corners
    /// as the page has them.
    pub fn row(&self, facet: usize, at: DVec3) -> Option<Value> {
        let facet = self.facets.get(facet)?;
        let g = &self.scene.geometry;
        let mut l = DVec3::ZERO;
        // Rounding may have led beyond an edge.
        let at = at.max(DVec3::ZERO);
        facet.around().into_iter().zip(at.to_array()).for_each(|(k, share)| l[k] = share);
        let point = facet.point(l / l.element_sum().max(f64::MIN_POSITIVE));
        let patches = &self.solution.patches;
        let id = patches.at(point)?;
        // By a hemicube, which sees all; rows of sampled rays have holes.
        let mut row = Row::default();
        Hemicube::new(g, patches, HEMICUBE).ok()?.row(id, &mut row);
        let (columns, factors): (Vec<u32>, Vec<f64>) = row.entries().map(|(j, f)| (j.0, f)).unzip();
        let surface = &g.surfaces[g.surface_of[facet.triangle.index()] as usize];
        Some(json!({
            "patch": id.0,
            "patches": patches.len(),
            "surface": surface.name,
            "area": patches.area(id),
            "illuminance": luminance(self.solution.irradiance[id.index()]),
            "sum": factors.iter().sum::<f64>(),
            "error": luminance(self.uncertainty.error(id)),
            "environment": row.environment,
            "columns": columns,
            "factors": factors,
        }))
    }

    /// The hemicube of a patch as a PNG, each pixel in the colour of the patch that is seen there.
    pub fn hemicube(&self, patch: u32) -> Option<Vec<u8>> {
        let patches = &self.solution.patches;
        if patch as usize >= patches.len() {
            return None;
        }
        let engine = Hemicube::new(&self.scene.geometry, patches, HEMICUBE).ok()?;
        let net = engine.net(PatchId(patch))?;
        let colour = |pixel: &Option<Item>| match pixel {
            None => [0.01; 3],
            Some(Item::Environment) => [0.0; 3],
            Some(Item::Back) => [0.05; 3],
            Some(Item::Patch(id)) => {
                // Neighbours get colours far apart.
                let hash = id.0.wrapping_mul(0x9e37_79b9).rotate_left(15).wrapping_mul(0x85eb_ca6b);
                [0, 8, 16].map(|k| 0.08 + 0.8 * ((hash >> k & 255) as f32 / 255.0).powi(2))
            }
        };
        let pixels = net.pixels.iter().map(colour).collect();
        encode_picture(&Picture { width: net.size, height: net.size, pixels }).ok()
    }
}
