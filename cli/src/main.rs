//! The program `hemicube`: radiosity pictures of 3-D scenes.

mod args;
mod factors;
mod failure;
mod info;
mod input;
mod machine;
mod paper;
mod points;
mod probe;
mod remedy;
mod render;
mod scenes;
mod terminal;

use std::process::ExitCode;

use clap::Parser;

use args::{Arguments, Command};

fn main() -> ExitCode {
    let arguments = Arguments::parse_from(args::with_group(std::env::args_os()));
    let result = match arguments.command {
        Command::Render(r) => render::run(&r),
        Command::Probe(p) => probe::run(&p),
        Command::Factors(f) => factors::run(&f),
        Command::Info(i) => info::run(&i),
        Command::Scenes => scenes::run(),
        Command::Paper(p) => paper::run(&p),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            terminal::say(&format!("error: {failure}"));
            failure.code()
        }
    }
}
