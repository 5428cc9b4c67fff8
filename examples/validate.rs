//! Published view factors and ours: `cargo run --release --example validate`.
//!
//! Writes docs/validation.md, or the file that is named: a table of each kind of case. Ends with an
//! error if a factor is off by more than its bound. The cases are those of tests/validation.rs.

#![allow(clippy::print_stdout, reason = "an example")]

use std::error::Error;
use std::fmt::Write;
use std::fs;

use glam::DMat3;

#[allow(dead_code, reason = "the tests use all of it")]
#[path = "../tests/common/contour.rs"]
mod contour;
#[allow(dead_code, reason = "the tests use all of it")]
#[path = "../tests/common/published/mod.rs"]
mod published;

use published::{Case, Figure, Found, groups};

const INTRODUCTION: &str = "\
# Validation

View factors with exact or published values beside those of `hemicube`. This page is written by

```sh
cargo run --release --example validate
```

which fails if one is off by more than its bound: 10⁻⁵ where nothing stands in between, .3 % where
something does. `cargo test --release --test validation` holds the same bounds for the same cases
when they are also split into patches, turned at random, and rounded to single precision, as files
have them.

- **exact** is the value of what stands in the scene: a closed form, or an integral in double
  precision that shares no code with the engine.
- **hemicube** is the factor from one surface to another by the exact engine with its default
  options, by `Scene::from_arrays` and `Scene::form_factors`. Each surface is the few triangles that
  it takes to draw it: nothing is split.
- **difference** is between the two; in per cent where something stands in between, in bold where it
  is out of bounds.
- **stated** is the error that the engine states of the whole matrix: the root mean square of all
  errors over that of all factors. It is an estimate from the rays and points by which it finds what
  is hidden. It says nothing where nothing is.
- **s** is how many seconds the matrix took, wall-clock.
";

const CURVED: &str = "
A curved body is a polyhedron here, of some 50 to 150 facets, whose factor is exact too: by ratios
of areas, or by integrals along the outlines of the facets. That is what the engine must reach. The
factor of the curved body stands beside it: what lies between the two is due to the facets, and
falls with the square of their size. Discs, spheres and the cylinder in the sphere have facets of
their own area.
";

const SOURCES: &str = "
## Sources

- *CIE 171:2006*. \"Test cases to assess the accuracy of lighting computer programs\". Points have
  no extent there; here they are squares of 1 mm.
- *Crawford* (1972). \"Configuration factor between two unequal, parallel coaxial squares\". ASME
  paper 72-WA/HT-16.
- *Ehlert, Smith* (1993). \"View factors for perpendicular and parallel rectangular plates\".
  *Journal of Thermophysics and Heat Transfer* 7(1), 173–175.
- *Feingold* (1966). \"Radiant-interchange configuration factors between various selected plane
  surfaces\". *Proceedings of the Royal Society of London A* 292, 51–60.
- *Feingold, Gupta* (1970). \"New analytical approach to the evaluation of configuration factors in
  radiation from spheres and infinitely long cylinders\". *Journal of Heat Transfer* 92(1), 69–76.
- *Hamilton, Morgan* (1952). \"Radiant-interchange configuration factors\". NACA TN 2836.
- *Howell*. \"A catalog of radiation heat transfer configuration factors\",
  <https://www.thermalradiation.net>.
- *Pinney, Bean* (1988). \"A set of analytical tests for internal longwave radiation and view factor
  calculations\". Building Research Establishment.
- *Rea* (1975). \"Rapid method for determining concentric cylinder radiation view factors\". *AIAA
  Journal* 13(8), 1122–1123.
";

fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args().nth(1).unwrap_or_else(|| "docs/validation.md".to_owned());
    let mut page = INTRODUCTION.to_owned();
    let mut wrong = Vec::new();
    for (name, cases) in groups() {
        let curved = cases.iter().flat_map(|c| &c.figures).any(|f| f.curved.is_some());
        write!(
            page,
            "\n## {name}\n{}\n",
            if curved && !page.contains(CURVED) { CURVED } else { "" }
        )?;
        page.push_str(if curved {
            "| case | source | curved body | exact | hemicube | difference | stated | s |\n\
             |---|---|---:|---:|---:|---:|---:|---:|\n"
        } else {
            "| case | source | exact | hemicube | difference | stated | s |\n\
             |---|---|---:|---:|---:|---:|---:|\n"
        });
        for case in &cases {
            let found = case.run(DMat3::IDENTITY, false, None)?;
            for (figure, &factor) in case.figures.iter().zip(&found.factors) {
                let line = line(case, figure, factor, &found, curved);
                print!("{line}");
                page.push_str(&line);
                let off = is_off(case, figure, factor);
                wrong.extend(off.then(|| format!("{} {}", case.name, figure.name)));
            }
        }
    }
    page.push_str(SOURCES);
    fs::write(&path, page)?;
    println!("wrote {path}");
    if wrong.is_empty() {
        Ok(())
    } else {
        Err(format!("out of bounds: {}", wrong.join("; ")).into())
    }
}

fn is_off(case: &Case, figure: &Figure, factor: f64) -> bool {
    (factor - figure.exact).abs() > case.bound(figure)
}

/// A line of a table.
fn line(case: &Case, figure: &Figure, factor: f64, found: &Found, curved: bool) -> String {
    let separator = if figure.name.is_empty() { "" } else { ": " };
    let of_curved = match (curved, figure.curved) {
        (false, _) => String::new(),
        (true, None) => " |".to_owned(),
        (true, Some(value)) => format!(" {value:.6} |"),
    };
    let off = factor - figure.exact;
    let share = off / figure.exact;
    let difference = match case.obstructed && share.abs() > 1e-5 {
        true => format!("{:+.3} %", 100.0 * share),
        false => format!("{off:+.0e}"),
    };
    let difference =
        if is_off(case, figure, factor) { format!("**{difference}**") } else { difference };
    format!(
        "| {}{separator}{} | {} |{of_curved} {:.9} | {factor:.9} | {difference} | {:.2} % | {:.2} \
         |\n",
        case.name,
        figure.name,
        case.source,
        figure.exact,
        100.0 * found.stated,
        found.seconds
    )
}
