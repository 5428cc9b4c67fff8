//! `hemicube paper`: the experiments of Kulyasov & Nikulin (2012), "Acceleration of form-factor
//! computation in radiosity illumination of a scene", beside their own figures.

mod conditions;
mod device;
mod fit;
mod measure;
mod picture;
mod plot;
mod published;
mod quality;
mod stretch;
mod table;
mod table1;
mod table2;
mod table3;

use std::fs;
use std::path::Path;

use hemicube::export::write_whole;

use crate::args::{Paper, PaperPart};
use crate::failure::Failure;
use crate::terminal::{hear_interrupts, print};

use conditions::Conditions;

/// The document around the tables; names in braces stand for what a run measures.
const FRAME: &str = include_str!("paper/frame.md");

/// Stands in the document for a part that was not asked for.
const NOT_ASKED: &str = "*(Not part of this run.)*\n";

/// Runs the command.
pub fn run(args: &Paper) -> Result<(), Failure> {
    hear_interrupts();
    rayon::ThreadPoolBuilder::new()
        .num_threads(args.threads)
        .build_global()
        .map_err(Failure::failed)?;
    let folder = Folder::create(&args.output)?;
    let conditions = Conditions::new(args);
    let wanted = |part| args.part == part || args.part == PaperPart::All;

    let mut document = FRAME.replace("{conditions}", &conditions.to_string());
    let mut section = |name: &str, text: String| {
        document = document.replace(name, if text.is_empty() { NOT_ASKED } else { &text });
    };
    let table1 = wanted(PaperPart::Table1).then(|| table1::run(&conditions, &folder));
    section("{table1}", table1.transpose()?.unwrap_or_default());
    let table2 = wanted(PaperPart::Table2).then(|| table2::run(&conditions, &folder));
    section("{table2}", table2.transpose()?.unwrap_or_default());
    let table3 = wanted(PaperPart::Table3).then(|| table3::run(&conditions, &folder));
    section("{table3}", table3.transpose()?.unwrap_or_default());
    let quality = (args.part == PaperPart::All).then(|| quality::run(&conditions, &folder));
    section("{quality}", quality.transpose()?.unwrap_or_default());
    folder.write("paper.md", document.as_bytes())
}

/// Where everything goes: tables and the document in it, plots and pictures in `images/`.
struct Folder<'a> {
    path: &'a Path,
}

impl<'a> Folder<'a> {
    /// The folder, made if it is not there.
    fn create(path: &'a Path) -> Result<Self, Failure> {
        fs::create_dir_all(path.join("images"))
            .map_err(|e| Failure::Input(format!("{}: {e}", path.display())))?;
        Ok(Self { path })
    }

    /// Writes a file whole, and prints its path.
    fn write(&self, name: &str, bytes: &[u8]) -> Result<(), Failure> {
        let path = self.path.join(name);
        write_whole(&path, bytes).map_err(Failure::failed)?;
        print(&path.display().to_string());
        Ok(())
    }
}
