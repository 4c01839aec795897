//! A plan made in code, run on a survey's folder: `cargo run --example own_stages -- SURVEY OUT`.

#![allow(clippy::print_stdout)]

use pipeline::{Plan, RunRequest, Silent};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let (Some(survey), Some(out)) = (arguments.next(), arguments.next()) else {
        println!("usage: own_stages SURVEY OUT");
        return Ok(());
    };
    let plan = Plan::from_ron(
        "(name: \"own stages\", stages: [Demodulate(low_amplitude: 20), Average(), Unwrap(), PointCloud(), Flag()])",
        "own_stages".as_ref(),
    )?;
    let request = RunRequest {
        plan,
        plan_path: "own_stages".into(),
        survey: Some(survey.into()),
        calibration: None,
        out: out.into(),
    };
    let summary = pipeline::run(&request, &Silent)?;
    println!("{summary}");
    Ok(())
}
