//! The frames of a result as one cloud: `cargo run --release -p cloud-tasks --example fuse_result -- RESULT OUT`. Prints what `report.html` in OUT
//! shows.
#![allow(clippy::print_stdout)]

use std::error::Error;

use cloud_tasks::commands::Silent;
use cloud_tasks::range_io::clouds::CloudFormat;
use cloud_tasks::{FuseRequest, fuse};

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [result, out] = arguments.as_slice() else {
        return Err("RESULT OUT".into());
    };
    let request = FuseRequest {
        result: result.into(),
        voxel_m: None,
        as_stated: false,
        format: CloudFormat::Ply,
        out: out.into(),
    };
    println!("{}", fuse(&request, &Silent)?);
    Ok(())
}
