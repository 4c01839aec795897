//! `cargo xtask fixtures`: the simulated surveys of the repository, from their networks.

use std::ffi::OsString;

use crate::shell::{Outcome, rangecam, root};

/// Networks whose surveys are committed. A test compares them with a new simulation, so that neither goes stale.
const NETWORKS: [&str; 1] = ["target_field"];

pub(crate) fn run() -> Outcome {
    let fixtures = root().join("fixtures");
    for name in NETWORKS {
        let scene = fixtures.join("networks").join(name).with_extension("ron");
        let out = fixtures.join("surveys").join(name);
        let line: [OsString; 4] = ["simulate-network".into(), scene.into(), "--out".into(), out.into()];
        if rangecam(&line)? != 0 {
            return Err(format!("the network {name} could not be simulated"));
        }
    }
    Ok(())
}
