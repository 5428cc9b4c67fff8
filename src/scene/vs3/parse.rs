//! The statements of a View3D file, checked but for where surfaces lie.

use glam::DVec3;

use super::control::Control;
use super::words::{Words, lines};
use crate::scene::lines::utf8;
use crate::scene::shortened::shortened;
use crate::scene::source::{ImportError, Place, Source};
use crate::scene::{SceneBuilder, Severity};

/// A View3D file as it stands. Numbers of surfaces are indices of [`surfaces`](Self::surfaces).
#[derive(Debug, Default)]
pub struct File {
    pub title: String,
    pub control: Control,
    /// Those that exchange radiation, then those that only block.
    pub surfaces: Vec<Polygon>,
    /// Number of those that exchange radiation.
    pub radiating: usize,
}

/// A triangle or quadrilateral.
#[derive(Debug)]
pub struct Polygon {
    /// Line of the file, from 1.
    pub line: usize,
    /// Counter-clockwise seen from the front.
    pub corners: Vec<DVec3>,
    /// What it is for radiation; `None` if it only blocks.
    pub face: Option<Face>,
}

/// What View3D knows of a surface beside where it is.
#[derive(Debug)]
pub struct Face {
    /// The surface that it is a part of.
    pub base: Option<usize>,
    /// The surface whose row and column its own are added to.
    pub combined: Option<usize>,
    /// From [`LEAST`] to [`MOST`].
    pub emittance: f64,
    pub name: String,
}

/// View3D has no emittances below this, nor above [`MOST`].
const LEAST: f64 = 0.001;
const MOST: f64 = 0.999;

/// The statement of a surface in either format.
const WITH_VERTICES: &str =
    "write `S number v1 v2 v3 v4 base cmb emit name`, where v4 of a triangle is 0";
const PLACED: &str = "write `S number shape base cmb emit name`, where the shape is R, T or Q";
const OBSTRUCTION: &str = "write `O number v1 v2 v3 v4`, where v4 of a triangle is 0";
const VERTEX: &str = "write `V number x y z`";

/// Reads all statements up to the end of data.
pub fn parse(source: &Source<'_>, builder: &mut SceneBuilder) -> Result<File, ImportError> {
    let bytes = utf8(source.bytes);
    let text = String::from_utf8_lossy(&bytes);
    let mut parser = Parser {
        source,
        builder,
        file: File::default(),
        placed: false,
        control_line: 0,
        vertices: Vec::new(),
        named: Vec::new(),
        unknown: None,
    };
    let mut lines = lines(&text);
    while let Some(line) = lines.next() {
        if !parser.take(line, &mut lines)? {
            break;
        }
    }
    parser.finish()
}

struct Parser<'a> {
    source: &'a Source<'a>,
    builder: &'a mut SceneBuilder,
    file: File,
    /// Whether surfaces say where they are themselves (`F 3a`).
    placed: bool,
    /// The last line of control values.
    control_line: usize,
    vertices: Vec<DVec3>,
    /// Numbers of each surface's vertices, from 1; the last of a triangle is 0.
    named: Vec<[usize; 4]>,
    /// The first line that begins with no letter of the format, its word, and how many there are.
    unknown: Option<(usize, String, usize)>,
}

impl Parser<'_> {
    /// Takes a statement in; returns whether more may follow.
    fn take<'t>(
        &mut self,
        mut line: Words<'t>,
        more: &mut impl Iterator<Item = Words<'t>>,
    ) -> Result<bool, ImportError> {
        let Some(word) = line.next() else { return Ok(true) };
        let letter = word.chars().next().map_or(' ', |c| c.to_ascii_uppercase());
        match letter {
            'T' => self.file.title = line.rest().to_owned(),
            'C' => {
                self.control_line = line.line;
                self.file.control.take(self.source, line.line, line.rest(), self.builder)?;
            }
            'F' => self.format(line)?,
            'V' if !self.placed => self.vertex(line)?,
            'S' | 'O' => self.surface(line, letter == 'S', more)?,
            'M' | 'N' => {
                let kind = if letter == 'M' { "mask" } else { "null" };
                return Err(line.wrong(
                    self.source,
                    format!("{kind} surfaces (`{letter}`) are not read"),
                    "leave it out, and divide the surface that it lies in into parts around it",
                ));
            }
            'X' | '/' => {}
            'E' | '*' => return Ok(false),
            _ => match &mut self.unknown {
                Some((_, _, count)) => *count += 1,
                None => self.unknown = Some((line.line, shortened(word), 1)),
            },
        }
        Ok(true)
    }

    fn format(&mut self, mut line: Words<'_>) -> Result<(), ImportError> {
        let format = line.next().unwrap_or_default();
        self.placed = match format.to_ascii_lowercase().as_str() {
            "3" => false,
            "3a" => true,
            _ => {
                let problem = format!("`{}` is no format that is read", shortened(format));
                return Err(line.wrong(self.source, problem, "write `F 3` or `F 3a`"));
            }
        };
        if !self.vertices.is_empty() || !self.file.surfaces.is_empty() {
            let problem = "the format stands after vertices or surfaces".to_owned();
            return Err(line.wrong(self.source, problem, "put the `F` line before them"));
        }
        Ok(())
    }

    fn vertex(&mut self, mut line: Words<'_>) -> Result<(), ImportError> {
        let source = self.source;
        let number = line.whole(source, "the number of the vertex", VERTEX)?;
        self.check_order(&line, "vertex", number, self.vertices.len() + 1)?;
        let [x, y, z] = ["x", "y", "z"]
            .map(|axis| line.number(source, &format!("{axis} of the vertex"), VERTEX));
        self.vertices.push(DVec3::new(x?, y?, z?));
        source.check_size(self.vertices.len(), "vertices", || Place::Line(line.line))
    }

    fn check_order(
        &self,
        line: &Words<'_>,
        what: &str,
        number: usize,
        next: usize,
    ) -> Result<(), ImportError> {
        if number == next {
            return Ok(());
        }
        let problem = format!("{what} {number} is out of order: {next} comes next");
        Err(line.wrong(self.source, problem, "number them 1, 2, 3, … as they follow each other"))
    }

    fn surface<'t>(
        &mut self,
        mut line: Words<'t>,
        radiating: bool,
        more: &mut impl Iterator<Item = Words<'t>>,
    ) -> Result<(), ImportError> {
        let source = self.source;
        let remedy = match (radiating, self.placed) {
            (true, false) => WITH_VERTICES,
            (true, true) => PLACED,
            (false, false) => OBSTRUCTION,
            (false, true) => "write `O number shape`, where the shape is R, T or Q",
        };
        if radiating && !self.placed && lacks_zero(line) {
            let problem = "a triangle lacks the 0 in place of its fourth vertex".to_owned();
            let triangle = "write `S number v1 v2 v3 0 base cmb emit name`";
            return Err(line.wrong(source, problem, triangle));
        }
        let number = line.whole(source, "the number of the surface", remedy)?;
        self.check_order(&line, "surface", number, self.file.surfaces.len() + 1)?;
        if radiating && self.file.radiating < self.file.surfaces.len() {
            let problem = format!("surface {number} (`S`) stands after an obstruction (`O`)");
            return Err(line.wrong(source, problem, "put obstructions after all surfaces"));
        }
        let mut shape = ' ';
        if self.placed {
            let word = line.next().unwrap_or_default();
            shape = word.chars().next().map_or(' ', |c| c.to_ascii_uppercase());
            if !"RTQ".contains(shape) {
                let problem = format!("`{}` is no shape", shortened(word));
                return Err(line.wrong(source, problem, remedy));
            }
        } else {
            let mut named = [0; 4];
            for (k, n) in (1..).zip(&mut named) {
                *n = line.whole(source, &format!("vertex {k} of the surface"), remedy)?;
            }
            self.named.push(named);
        }
        let at = line.line;
        let face = radiating.then(|| self.face(line, number, remedy)).transpose()?;
        let corners = match self.placed {
            true => placed(&self.numbers(number, at, count_of(shape), more)?, shape),
            // Vertices may follow.
            false => Vec::new(),
        };
        self.file.radiating += usize::from(radiating);
        self.file.surfaces.push(Polygon { line: at, corners, face });
        source.check_size(2 * self.file.surfaces.len(), "triangles", || Place::Line(at))
    }

    /// What follows the vertices, or the shape, of a surface.
    fn face(
        &mut self,
        mut line: Words<'_>,
        number: usize,
        remedy: &str,
    ) -> Result<Face, ImportError> {
        let source = self.source;
        let base = line.whole(source, "the base surface", remedy)?.checked_sub(1);
        let combined = line.whole(source, "the surface to combine with", remedy)?.checked_sub(1);
        let given = line.number(source, "the emittance", remedy)?;
        let range = format!("give emittances from {LEAST} to {MOST}");
        if !(0.0..=1.0).contains(&given) {
            let problem = format!("the emittance {given} of surface {number} is not from 0 to 1");
            return Err(line.wrong(source, problem, &range));
        }
        let emittance = given.clamp(LEAST, MOST);
        if emittance != given {
            let (beyond, limit) = if given < LEAST { ("below", LEAST) } else { ("above", MOST) };
            self.builder.finding(
                Severity::Warning,
                format!("line {}", line.line),
                format!("its emittance is {beyond} {limit}, which is taken instead"),
                range,
            );
        }
        let name = match line.rest() {
            "" => number.to_string(),
            name => name.to_owned(),
        };
        Ok(Face { base, combined, emittance, name })
    }

    /// The numbers that say where a surface is, on the lines after its own. What follows them on
    /// the last line is passed over.
    fn numbers<'t>(
        &self,
        number: usize,
        at: usize,
        count: usize,
        more: &mut impl Iterator<Item = Words<'t>>,
    ) -> Result<Vec<f64>, ImportError> {
        const REMEDY: &str = "write `x y z azimuth tilt` and then, of a rectangle, its width and \
                              height, or else x and y of each corner";
        let mut numbers = Vec::with_capacity(count);
        while numbers.len() < count {
            let Some(mut line) = more.next() else {
                let problem =
                    format!("the file ends before surface {number} has its {count} numbers");
                return Err(self.source.malformed(Place::Line(at), problem, REMEDY));
            };
            while let Some(word) = line.next().filter(|_| numbers.len() < count) {
                match word.parse::<f64>() {
                    Ok(x) if x.is_finite() => numbers.push(x),
                    _ => {
                        let problem = format!(
                            "`{}` is no number: surface {number} (line {at}) needs {count}",
                            shortened(word)
                        );
                        return Err(line.wrong(self.source, problem, REMEDY));
                    }
                }
            }
        }
        Ok(numbers)
    }

    /// What can be checked only when all is known.
    fn finish(mut self) -> Result<File, ImportError> {
        if let Some((line, word, count)) = self.unknown.take() {
            self.builder.finding(
                Severity::Warning,
                format!("line {line}"),
                format!(
                    "begins with `{word}`, no letter of the format; {count} such lines are passed \
                     over"
                ),
                "begin comments with !",
            );
        }
        if self.file.radiating == 0 {
            let place = Place::Element("whole file".into());
            let problem = "has no surfaces that exchange radiation";
            return Err(self.source.malformed(
                place,
                problem,
                "give them as lines that begin with S",
            ));
        }
        let wanted = [("row", self.file.control.row), ("col", self.file.control.col)];
        for (word, n) in wanted.into_iter().filter_map(|(word, n)| Some((word, n? + 1))) {
            if n > self.file.radiating {
                let problem =
                    format!("`{word}` is {n}: the file has {} surfaces", self.file.radiating);
                let place = Place::Line(self.control_line);
                return Err(self.source.malformed(
                    place,
                    problem,
                    "name one of them, or 0 for all",
                ));
            }
        }
        self.find_corners()?;
        self.check_numbers()?;
        Ok(self.file)
    }

    fn find_corners(&mut self) -> Result<(), ImportError> {
        let count = self.vertices.len();
        for (named, polygon) in self.named.iter().zip(&mut self.file.surfaces) {
            let used = if named[3] == 0 { &named[..3] } else { &named[..] };
            if let Some(n) = used.iter().find(|&&n| n == 0 || n > count) {
                return Err(self.source.malformed(
                    Place::Line(polygon.line),
                    format!("vertex {n} does not exist: the file has {count}"),
                    "name vertices that it has; 0 stands only for the fourth of a triangle",
                ));
            }
            polygon.corners = used.iter().map(|n| self.vertices[n - 1]).collect();
        }
        Ok(())
    }

    /// Whether surfaces refer to surfaces that they may.
    fn check_numbers(&mut self) -> Result<(), ImportError> {
        let File { surfaces, radiating, .. } = &self.file;
        for (i, polygon) in surfaces.iter().enumerate() {
            let Some(face) = &polygon.face else { continue };
            let wrong = |problem: String, remedy: &str| {
                Err(self.source.malformed(Place::Line(polygon.line), problem, remedy))
            };
            let missing = |kind: &str, n: usize, there: usize| {
                let problem = format!("{kind} {} does not exist: the file has {there}", n + 1);
                wrong(problem, "name an earlier surface, or 0 for none")
            };
            match face.base {
                Some(b) if b >= surfaces.len() => {
                    return missing("base surface", b, surfaces.len());
                }
                // A surface may lie on an obstruction; those come last.
                Some(b) if b >= i && b < *radiating => {
                    let problem = format!("base surface {} is not an earlier one", b + 1);
                    return wrong(problem, "put surfaces after the one that they lie in");
                }
                _ => {}
            }
            let Some(c) = face.combined else { continue };
            if c >= *radiating {
                return missing("surface to combine with", c, *radiating);
            }
            if c >= i {
                let problem = format!("surface {} to combine with is not an earlier one", c + 1);
                return wrong(problem, "combine later surfaces with earlier ones");
            }
            let whole = surfaces[c].face.as_ref();
            if whole.is_some_and(|whole| whole.emittance != face.emittance) {
                self.builder.finding(
                    Severity::Warning,
                    format!("line {}", polygon.line),
                    "is combined with one of another emittance, which counts",
                    "combine surfaces of one emittance",
                );
            }
            if let Some(last) = whole.and_then(|f| f.combined) {
                let (c, last) = (c + 1, last + 1);
                let problem = format!("surface {c} to combine with is combined with {last} itself");
                return wrong(problem, &format!("name {last} here"));
            }
        }
        Ok(())
    }
}

/// Whether the words of a surface fit a triangle whose fourth vertex was left out: what stands in
/// place of the emittance is its name, and in place of the fourth vertex base surface 0.
fn lacks_zero(mut line: Words<'_>) -> bool {
    let words: Vec<&str> = std::iter::from_fn(|| line.next()).take(8).collect();
    let is_float = |k: usize| words.get(k).is_some_and(|w| w.parse::<f64>().is_ok());
    let is_whole = |k: usize| words.get(k).is_some_and(|w| w.parse::<u32>().is_ok());
    words.get(4) == Some(&"0") && is_float(6) && !(is_whole(6) && is_float(7))
}

/// How many numbers say where a surface of that shape is.
fn count_of(shape: char) -> usize {
    match shape {
        'R' => 7,
        'T' => 11,
        _ => 13,
    }
}

/// The corners of a surface that is given in a plane of its own: its origin, azimuth and tilt in
/// degrees, and its shape in the plane.
fn placed(numbers: &[f64], shape: char) -> Vec<DVec3> {
    let origin = DVec3::from_slice(numbers);
    let [(sa, ca), (st, ct)] = [3, 4].map(|k| numbers[k].to_radians().sin_cos());
    let (width, height) = (DVec3::new(-ca, sa, 0.0), DVec3::new(-ct * sa, -ct * ca, st));
    let at = |u: f64, v: f64| origin + width * u + height * v;
    match (shape, &numbers[5..]) {
        ('R', &[w, h]) => vec![at(0.0, h), at(0.0, 0.0), at(w, 0.0), at(w, h)],
        (_, pairs) => pairs.chunks_exact(2).map(|uv| at(uv[0], uv[1])).collect(),
    }
}
