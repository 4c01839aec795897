//! The noise of a survey with several frames of each station: `cargo run --example noise -- SURVEY OUT`.

#![allow(clippy::print_stdout)]

use tasks::pipeline::Silent;
use tasks::{NoiseFitOptions, NoiseRequest, estimate_noise};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let (Some(survey), Some(out)) = (arguments.next(), arguments.next()) else {
        println!("usage: noise SURVEY OUT");
        return Ok(());
    };
    let options = NoiseFitOptions::default();
    let request = NoiseRequest { survey: survey.into(), calibration: None, options, out: out.into() };
    println!("{}", estimate_noise(&request, &Silent)?);
    Ok(())
}
