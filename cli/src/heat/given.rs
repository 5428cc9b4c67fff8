//! What the command line says of surfaces, and what that means for rows.

use std::collections::{BTreeSet, HashMap};

use hemicube::heat::{Condition, HeatError};
use hemicube::matrix::BACK;
use hemicube::scene::{GroupBy, Grouping, Scene, Side, TriangleId};

use super::Model;
use crate::args::{Heat, Named};
use crate::failure::Failure;

/// What is known of the sides of each triangle, front and back, that exchange heat.
pub struct Given(Vec<[Option<Known>; 2]>);

/// A number for each side of each triangle, where there is one.
type OfSides = Vec<[Option<f64>; 2]>;

/// What is known of each row.
pub struct OfRows {
    pub emissivity: Vec<f64>,
    pub absorptance: Vec<f64>,
    /// The node of each row.
    pub node_of: Vec<u32>,
    /// What is known of each node.
    pub conditions: Vec<Condition>,
    /// The surface of each row.
    pub surface_of: Vec<u32>,
    /// Their names.
    pub surfaces: Vec<String>,
    /// Whether each of them, or a part of it, is adiabatic.
    pub adiabatic: Vec<bool>,
}

/// Most names that a message tells.
const NAMED: usize = 8;

impl Given {
    /// Reads what is given; refuses names that the model does not have, and what is contradictory.
    pub fn new(args: &Heat, scene: &Scene, grouping: Option<&Grouping>) -> Result<Self, Failure> {
        let names = Names::of(scene);
        check_ranges(args)?;
        refuse_mirrors(args, scene, &names)?;
        let mut emissivity = names.read("--emissivity", &args.emissivity, true)?;
        for (triangle, own) in emissivity.iter_mut().enumerate() {
            *own = own.map(|e| e.or_else(|| of_file(args, scene, triangle)));
        }
        let given = Flags {
            temperature: names.read("--temperature", &args.temperature, false)?,
            flux: names.read("--flux", &args.flux, false)?,
            emissivity,
            absorptance: names.read("--absorptance", &args.absorptance, true)?,
        };
        let both = given.temperature.iter().zip(&given.flux);
        let twice = |(t, q): (&[Option<f64>; 2], &[Option<f64>; 2])| {
            t.iter().any(Option::is_some) && q.iter().any(Option::is_some)
        };
        if let Some(triangle) = both.map(twice).position(|twice| twice) {
            return Err(Failure::Input(format!(
                "{} has a --temperature and a --flux; give one of them",
                names.surface(triangle)
            )));
        }
        given.known(scene, grouping, &names).map(Self)
    }

    /// What it means for the rows of a model.
    pub fn of_rows(&self, model: &Model<'_>) -> OfRows {
        let mut known = vec![None; model.rows.len()];
        for (i, face) in model.matrix.layout.faces.iter().enumerate() {
            if face.patch.is_some() {
                let side = usize::from(face.side == Side::Back);
                known[model.row_of(i)] = self.0[face.triangle.index()][side];
            }
        }
        OfRows::new(model, &known)
    }
}

/// What the flags say of sides.
struct Flags {
    temperature: OfSides,
    flux: OfSides,
    emissivity: OfSides,
    absorptance: OfSides,
}

impl Flags {
    /// What is known of all sides that take part; refuses what is missing, and what is different
    /// within a group.
    fn known(
        &self,
        scene: &Scene,
        grouping: Option<&Grouping>,
        names: &Names<'_>,
    ) -> Result<Vec<[Option<Known>; 2]>, Failure> {
        let geometry = &scene.geometry;
        let mut known = vec![[None; 2]; geometry.len()];
        let mut absent = BTreeSet::new();
        let mut of_group: HashMap<(u32, Side), Known> = HashMap::new();
        for id in geometry.ids() {
            let triangle = id.index();
            for side in Side::BOTH.into_iter().filter(|side| geometry.exchanges(id, *side)) {
                let Some(own) = self.of_side(triangle, side, names)? else {
                    absent.insert(names.surface(triangle));
                    continue;
                };
                known[triangle][usize::from(side == Side::Back)] = Some(own);
                let Some(grouping) = grouping else { continue };
                let group = grouping.of[triangle];
                if *of_group.entry((group, side)).or_insert(own) != own {
                    return Err(Failure::Input(format!(
                        "--group: {} holds faces of which different things are given; group by \
                         what they have in common, or leave --group out",
                        grouping.names[group as usize]
                    )));
                }
            }
        }
        if absent.is_empty() {
            return Ok(known);
        }
        Err(Failure::Input(format!(
            "{}: no emissivity is given for {}; give --emissivity NAME=E, or one number for all \
             others",
            scene.name,
            listed(absent.into_iter())
        )))
    }

    /// What is known of a side of a triangle; nothing without an emissivity.
    fn of_side(
        &self,
        triangle: usize,
        side: Side,
        names: &Names<'_>,
    ) -> Result<Option<Known>, Failure> {
        let own = usize::from(side == Side::Back);
        let either = |values: &[[Option<f64>; 2]]| match values[triangle] {
            [Some(a), Some(b)] if a != b => Err(Failure::Input(format!(
                "{}: both sides of a face have one temperature and one supply of heat; give one",
                names.surface(triangle)
            ))),
            [front, back] => Ok(front.or(back)),
        };
        let Some(emissivity) = self.emissivity[triangle][own] else { return Ok(None) };
        Ok(Some(Known {
            emissivity,
            absorptance: self.absorptance[triangle][own].unwrap_or(emissivity),
            temperature: either(&self.temperature)?,
            flux: either(&self.flux)?,
        }))
    }
}

/// What is known of a row.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Known {
    emissivity: f64,
    absorptance: f64,
    temperature: Option<f64>,
    flux: Option<f64>,
}

impl OfRows {
    fn new(model: &Model<'_>, known: &[Option<Known>]) -> Self {
        let n = model.rows.len();
        // Both sides of a patch are one node: that of its front.
        let fronts = model.matrix.layout.fronts();
        let mut node_of = vec![0; n];
        let mut number = HashMap::new();
        for (i, front) in fronts.into_iter().enumerate() {
            let next = number.len() as u32;
            let node = *number.entry(model.row_of(front as usize)).or_insert(next);
            node_of[model.row_of(i)] = node;
        }
        let mut conditions = vec![Condition::Heat(0.0); number.len()];
        for (row, known) in known.iter().enumerate() {
            let condition = &mut conditions[node_of[row] as usize];
            match known {
                Some(Known { temperature: Some(t), .. }) => *condition = Condition::Temperature(*t),
                // W of one side's area.
                Some(Known { flux: Some(q), .. }) => {
                    *condition = Condition::Heat(q * model.rows[row].area);
                }
                _ => {}
            }
        }
        let (mut surfaces, mut number) = (Vec::new(), HashMap::new());
        let surface_of: Vec<u32> = model
            .rows
            .iter()
            .map(|row| {
                let name = if row.name.is_empty() { "default" } else { &row.name };
                let name = match row.side {
                    // Names of groups say it already.
                    Some(Side::Back) if row.triangle.is_some() => format!("{name}{BACK}"),
                    _ => name.to_owned(),
                };
                *number.entry(name.clone()).or_insert_with(|| {
                    surfaces.push(name);
                    surfaces.len() as u32 - 1
                })
            })
            .collect();
        let mut adiabatic = vec![false; surfaces.len()];
        for (known, surface) in known.iter().zip(&surface_of) {
            let is = known.is_some_and(|k| k.temperature.is_none() && k.flux.is_none());
            adiabatic[*surface as usize] |= is;
        }
        Self {
            // What takes no part exchanges with itself alone.
            emissivity: known.iter().map(|k| k.map_or(0.0, |k| k.emissivity)).collect(),
            absorptance: known.iter().map(|k| k.map_or(0.0, |k| k.absorptance)).collect(),
            node_of,
            conditions,
            surface_of,
            surfaces,
            adiabatic,
        }
    }
}

/// The emissivity that a View3D file gives a surface.
fn of_file(args: &Heat, scene: &Scene, triangle: usize) -> Option<f64> {
    let extension = args.model.scene.extension()?;
    let material = scene.optics.material_of[triangle] as usize;
    let known = extension.eq_ignore_ascii_case("vs3");
    known.then(|| 1.0 - scene.optics.materials[material].reflectance.x)
}

/// Where in the model an error is.
pub fn place(error: &HeatError, model: &Model<'_>, rows: &OfRows) -> String {
    let row = match error {
        HeatError::Share { row, .. }
        | HeatError::Unbounded { row, .. }
        | HeatError::BelowZero { row, .. } => Some(*row),
        HeatError::White { node } => rows.node_of.iter().position(|k| *k as usize == *node),
        _ => None,
    };
    row.map_or(String::new(), |row| format!("{} (row {row}): ", model.rows[row].name))
}

/// Refuses numbers that are out of range.
fn check_ranges(args: &Heat) -> Result<(), Failure> {
    const SHARE: &str = "is not between 0 and 1";
    const KELVIN: &str = "is no temperature in K; 20 °C are 293.15";
    let environment = args.environment.map(|value| Named { name: None, value });
    let environment: Vec<Named> = environment.into_iter().collect();
    let sun = args.diffuse_sun.map(|value| Named { name: None, value });
    let sun: Vec<Named> = sun.into_iter().collect();
    for (flag, values, [low, high], what) in [
        ("--emissivity", &args.emissivity, [0.0, 1.0], SHARE),
        ("--absorptance", &args.absorptance, [0.0, 1.0], SHARE),
        ("--flux", &args.flux, [-1e12, 1e12], "is no flux in W/m2 from -1e12 to 1e12"),
        ("--temperature", &args.temperature, [0.0, 1e6], KELVIN),
        ("--environment", &environment, [0.0, 1e6], KELVIN),
        ("--diffuse-sun", &sun, [0.0, 1e12], "is no irradiance in W/m2 from 0 to 1e12"),
    ] {
        if let Some(value) = values.iter().find(|v| !(low..=high).contains(&v.value)) {
            let name = value.name.as_ref().map_or(String::new(), |n| format!("{n}="));
            // In this form large numbers have an exponent.
            return Err(Failure::Input(format!("{flag} {name}{:?}: {what}", value.value)));
        }
    }
    Ok(())
}

/// Refuses what the file says is a mirror, unless it is to be taken for a diffuse reflector.
fn refuse_mirrors(args: &Heat, scene: &Scene, names: &Names<'_>) -> Result<(), Failure> {
    let mut excused = vec![false; scene.geometry.len()];
    for name in &args.diffuse {
        match names.find("--diffuse", name) {
            Err(_) if name == "all" => excused.fill(true),
            found => found?.iter().for_each(|(t, _)| excused[*t] = true),
        }
    }
    let optics = &scene.optics;
    let material = |t: usize| &optics.materials[optics.material_of[t] as usize];
    let mirrors: BTreeSet<&str> = (0..excused.len())
        .filter(|&t| !excused[t] && material(t).specular)
        .map(|t| material(t).name.as_str())
        .collect();
    if mirrors.is_empty() {
        return Ok(());
    }
    Err(Failure::Input(format!(
        "{}: reflects like a mirror or metal in the file: {}; heat is exchanged diffusely here, so \
         name with --diffuse what may be taken so, or all",
        scene.name,
        listed(mirrors.into_iter())
    )))
}

/// Names with commas between; many are counted.
pub fn listed<'a>(names: impl ExactSizeIterator<Item = &'a str>) -> String {
    let more = names.len().saturating_sub(NAMED);
    let shown: Vec<&str> = names.take(NAMED).collect();
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    format!("{}{more}", shown.join(", "))
}

/// What a front that is named alone has after its name.
const FRONT: &str = " (front)";

/// The names of a model.
struct Names<'a> {
    scene: &'a Scene,
    /// By surface, material and object.
    groupings: [Grouping; 3],
}

impl<'a> Names<'a> {
    fn of(scene: &'a Scene) -> Self {
        let by = [GroupBy::Surface, GroupBy::Material, GroupBy::Object];
        Self { scene, groupings: by.map(|by| scene.grouping(by)) }
    }

    /// The numbers of all sides that a flag says, those of names before those of all; unless
    /// `for_all`, each needs a name.
    fn read(&self, flag: &str, values: &[Named], for_all: bool) -> Result<OfSides, Failure> {
        let mut all = vec![[None; 2]; self.scene.geometry.len()];
        for value in values.iter().filter(|v| v.name.is_none()) {
            if !for_all {
                return Err(Failure::Input(format!(
                    "{flag} {0}: says not what; write it like {flag} wall={0}",
                    value.value
                )));
            }
            all.fill([Some(value.value); 2]);
        }
        for value in values {
            let Some(name) = &value.name else { continue };
            if values.iter().any(|v| v.name == value.name && v.value != value.value) {
                return Err(Failure::Input(format!("{flag} {name}: is given twice")));
            }
            for (triangle, side) in self.find_taking_part(flag, name)? {
                let [front, back] = &mut all[triangle];
                if side != Some(Side::Back) {
                    *front = Some(value.value);
                }
                if side != Some(Side::Front) {
                    *back = Some(value.value);
                }
            }
        }
        Ok(all)
    }

    /// The surface of a triangle.
    fn surface(&self, triangle: usize) -> &str {
        let surfaces = &self.groupings[0];
        &surfaces.names[surfaces.of[triangle] as usize]
    }

    /// The same; refuses a name none of whose sides exchanges heat.
    fn find_taking_part(
        &self,
        flag: &str,
        name: &str,
    ) -> Result<Vec<(usize, Option<Side>)>, Failure> {
        let found = self.find(flag, name)?;
        let geometry = &self.scene.geometry;
        let takes_part = |&(t, side): &(usize, Option<Side>)| {
            let id = TriangleId(t as u32);
            let asked = |s: &&Side| side.is_none_or(|side| side == **s);
            Side::BOTH.iter().filter(asked).any(|side| geometry.exchanges(id, *side))
        };
        if found.iter().any(takes_part) {
            return Ok(found);
        }
        let why = match found.first() {
            Some((_, Some(Side::Back))) => "its back exchanges no heat; use --sides two",
            _ => "exchanges no heat: it only blocks, has no area, or is there twice",
        };
        Err(Failure::Input(format!("{flag} {name}: {why}")))
    }

    /// The triangles of that name, and which side of them; both without one.
    fn find(&self, flag: &str, name: &str) -> Result<Vec<(usize, Option<Side>)>, Failure> {
        let sided = [(name, None)].into_iter().chain(
            [(BACK, Side::Back), (FRONT, Side::Front)]
                .into_iter()
                .filter_map(|(suffix, side)| Some((name.strip_suffix(suffix)?, Some(side)))),
        );
        for (name, side) in sided {
            for grouping in &self.groupings {
                if let Some(group) = grouping.names.iter().position(|n| n == name) {
                    let own = |t: &usize| grouping.of[*t] as usize == group;
                    let all = (0..grouping.of.len()).filter(own);
                    return Ok(all.map(|t| (t, side)).collect());
                }
            }
        }
        let [surfaces, materials, _] = &self.groupings;
        let of = |grouping: &Grouping| listed(grouping.names.iter().map(String::as_str));
        Err(Failure::Input(format!(
            "{flag} {name}: {} has no surface, material or object of that name; it has the \
             surfaces {} and the materials {}",
            self.scene.name,
            of(surfaces),
            of(materials)
        )))
    }
}
