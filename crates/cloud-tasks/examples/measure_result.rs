//! Lengths of a result: `cargo run --release -p cloud-tasks --example measure_result -- RESULT LENGTHS.ron OUT`. Prints what
//! `report.html` in OUT shows.
#![allow(clippy::print_stdout)]

use std::error::Error;

use cloud_tasks::commands::Silent;
use cloud_tasks::{MeasureRequest, measure};

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [result, lengths, out] = arguments.as_slice() else {
        return Err("RESULT LENGTHS.ron OUT".into());
    };
    let request = MeasureRequest { result: result.into(), lengths: lengths.into(), out: out.into() };
    println!("{}", measure(&request, &Silent)?);
    Ok(())
}
