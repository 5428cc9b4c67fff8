//! docs/thermal.md: its commands work as they stand there, and its tables are what they print.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test")]

mod common;

use std::collections::HashMap;

use common::Bench;

const PAGE: &str = include_str!("../../docs/thermal.md");

/// Models that the page names.
const MODELS: [(&str, &str); 4] = [
    ("oven.obj", include_str!("../../docs/models/oven.obj")),
    ("satellite.obj", include_str!("../../docs/models/satellite.obj")),
    ("canyon.obj", include_str!("../../docs/models/canyon.obj")),
    ("heat.mtl", include_str!("../../docs/models/heat.mtl")),
];

/// Which column of the command's table a column of the page shows.
fn column(title: &str) -> &'static str {
    match title {
        "mean, K" => "temperature_K",
        "lowest, K" => "lowest_K",
        "highest, K" => "highest_K",
        "net, W" => "net_W",
        "sunlight, W" => "sunlight_W",
        _ => panic!("no column is called {title}"),
    }
}

/// The words of a command; what is between apostrophes is one.
fn words(command: &str) -> Vec<String> {
    let mut words = Vec::new();
    for (k, part) in command.replace("\\\n", " ").split('\'').enumerate() {
        match k % 2 {
            0 => words.extend(part.split_whitespace().map(str::to_owned)),
            _ => words.push(part.to_owned()),
        }
    }
    words
}

/// The cells of a line of a table.
fn cells(line: &str) -> Vec<&str> {
    line.trim_matches('|').split('|').map(str::trim).collect()
}

/// The numbers that a command prints, by surface and column.
fn printed(csv: &str) -> HashMap<(String, String), f64> {
    let lines = csv.lines().skip_while(|line| !line.starts_with("surface,"));
    let mut rows = lines.map(|line| line.split(',').collect::<Vec<_>>());
    let header = rows.next().unwrap();
    rows.flat_map(|row| {
        let fields = header.iter().zip(row.clone()).skip(1);
        let name = row[0].to_owned();
        fields
            .map(|(column, text)| ((name.clone(), (*column).to_owned()), text.parse().unwrap()))
            .collect::<Vec<_>>()
    })
    .collect()
}

#[test]
fn commands_of_the_page_print_its_tables() {
    let mut bench = Bench::new();
    for (name, text) in MODELS {
        bench = bench.with(name, text);
    }
    let mut compared = 0;
    let mut blocks: Vec<&str> = PAGE.split("```sh\n").skip(1).collect();
    // The first command stands at the top; its table follows further down.
    assert_eq!(blocks.len(), 5, "commands");
    let oven = blocks.remove(0);
    for block in [oven].into_iter().chain(blocks) {
        let (command, text) = block.split_once("```").unwrap();
        let words = words(command);
        let args: Vec<&str> = words.iter().map(String::as_str).collect();
        assert_eq!(args[..2], ["hemicube", "heat"], "{command}");
        let found = bench.run(&args[1..]).ok();
        for flag in ["-o", "--picture", "--conductors", "--gebhart"] {
            if let Some(at) = args.iter().position(|a| *a == flag) {
                assert!(bench.path(args[at + 1]).metadata().unwrap().len() > 100, "{command}");
            }
        }
        let found = printed(&found.stdout);
        let table = text.lines().skip_while(|line| !line.starts_with("| surface |"));
        let table: Vec<&str> = table.take_while(|line| line.starts_with('|')).collect();
        let titles = cells(table[0]);
        for line in &table[2..] {
            let row = cells(line);
            for (title, text) in titles.iter().zip(&row).skip(1) {
                let said: f64 = text.parse().unwrap();
                let found = found[&(row[0].to_owned(), column(title).to_owned())];
                let digits = text.split_once('.').map_or(0, |t| t.1.len() as i32);
                let close = 0.51 * 10_f64.powi(-digits) + 1e-4 * found.abs();
                let shown = format!("{:.*}", digits as usize, found);
                assert!((found - said).abs() <= close, "{command}{line}: {title} is {shown}");
                compared += 1;
            }
        }
    }
    assert!(compared > 60, "{compared} numbers");
}
