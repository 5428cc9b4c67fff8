//! The program `hemicube`.

fn main() {}
