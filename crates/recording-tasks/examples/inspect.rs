//! What a recording holds, as `rangecam inspect` tells it: `cargo run -p recording-tasks --example inspect -- FILE`.
#![allow(clippy::print_stdout)]

use commands::Silent;
use recording_tasks::inspect_recording;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = std::env::args().nth(1).ok_or("expected the name of a recording")?;
    println!("{}", inspect_recording(path.as_ref(), &Silent)?);
    Ok(())
}
