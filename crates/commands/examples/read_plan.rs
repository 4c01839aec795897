//! Reads a pipeline and says what it needs: `cargo run -p commands --example read_plan [FILE]`.
#![allow(clippy::print_stdout)]

use std::path::{Path, PathBuf};

use commands::plan::Plan;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let own = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/pipelines/room.ron");
    let path = std::env::args_os().nth(1).map_or(own, PathBuf::from);
    let plan = Plan::read(&path)?;
    println!("{}: {} stages", plan.name, plan.stages.len());
    for stage in &plan.stages {
        println!("  {} works on {:?} and what lies behind it", stage.name(), stage.needs());
    }
    Ok(())
}
