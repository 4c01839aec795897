//! The second half of the Kinect's frames as a stream.

use super::super::table::{head, row};
use super::judge::times;
use super::{HALF, Stage};
use crate::shell::Outcome;

/// KISS-ICP's maps, m.
const VOXELS: [&str; 2] = ["0.05", "0.1"];

pub(super) fn compare(stage: &Stage) -> Outcome {
    println!("── stream");
    let frames = stage.frames("dense_kitchen");
    let half = HALF.to_string();
    let part = [frames.as_str(), &half, &half];
    let told = stage.environment.call("registration_peers.py", &[&["streams"], &part[..], &VOXELS].concat())?;
    let printed = stage.ours.call(&[&["tracking"], &part[..]].concat())?;
    head(&["Kinect, frames 250 to 499 as a stream", "off, mm", "CPU ms a frame: mean", "median", "95 %"]);
    let own = printed.lines("times").first().cloned().unwrap_or_default();
    line("`icp-registration`, with loops", printed.get("ours", 1), own);
    for voxel in VOXELS {
        let spent = told[voxel]["ms"].as_array().into_iter().flatten().filter_map(serde_json::Value::as_f64).collect();
        line(&format!("KISS-ICP, map of {voxel} m"), told[voxel]["mm"].as_f64().unwrap_or(f64::NAN), spent);
    }
    Ok(())
}

fn line(name: &str, millimetres: f64, spent: Vec<f64>) {
    row(name, &[&[millimetres], &times(spent)[..]].concat());
}
