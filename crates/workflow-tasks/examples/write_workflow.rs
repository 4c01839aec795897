//! Writes the workflow of an archive: `cargo run -p workflow-tasks --example write_workflow -- ARCHIVE FOLDER`.
#![allow(clippy::print_stdout)]

use workflow_tasks::{WorkflowRequest, write_workflow};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut words = std::env::args().skip(1);
    let (Some(archive), Some(out)) = (words.next(), words.next()) else {
        return Err("expected the archive's folder and that of the workflow".into());
    };
    let request = WorkflowRequest { archive: archive.into(), pipeline: None, shards: 4, threads: 1, out: out.into() };
    println!("{}", write_workflow(&request)?);
    Ok(())
}
