//! The program `hemicube`: radiosity pictures of 3-D scenes.

mod args;
mod bake;
mod dark;
mod doubts;
mod factors;
mod failure;
mod heat;
mod info;
mod input;
mod machine;
mod outputs;
mod page;
mod paper;
mod pictures;
mod plan;
mod points;
mod probe;
mod remedy;
mod render;
mod scenes;
mod solutions;
mod solve;
mod staging;
mod terminal;
mod view;
mod view3d;

use std::process::ExitCode;

use args::{Arguments, Command};
use failure::Failure;

fn main() -> ExitCode {
    let arguments = args::with_group(std::env::args_os());
    let result = args::read(&arguments).map_err(Failure::Input).and_then(|read| run(&read));
    let printed = terminal::finish_printing();
    let printed = printed.map_err(|e| Failure::Failed(format!("cannot write stdout: {e}")));
    match result.and(printed) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            terminal::say(&format!("error: {failure}"));
            failure.code()
        }
    }
}

fn run(arguments: &Arguments) -> Result<(), Failure> {
    terminal::catch_file_limit();
    match &arguments.command {
        Command::Render(r) => render::run(r),
        Command::Bake(b) => bake::run(b),
        Command::Solve(s) => solve::run(s),
        Command::View(v) => view::run(v),
        Command::Probe(p) => probe::run(p),
        Command::Factors(f) => factors::run(f),
        Command::Merge(m) => factors::run(&m.as_factors()),
        Command::Heat(h) => heat::run(h),
        Command::View3d(v) => view3d::run(v),
        Command::Info(i) => info::run(i),
        Command::Scenes => scenes::run(),
        Command::Paper(p) => paper::run(p),
    }
}
