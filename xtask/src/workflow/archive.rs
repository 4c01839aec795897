//! Forty small recordings of two cameras on four days, two of them broken, and one camera that moves on the third day.

use std::fs;
use std::path::Path;

use crate::shell::{Outcome, root};
use crate::workflow::call;

/// Cameras, days and recordings of a day.
pub(crate) const CAMERAS: [&str; 2] = ["north", "south"];
pub(crate) const DAYS: [&str; 4] = ["day1", "day2", "day3", "day4"];
pub(crate) const RECORDINGS: [&str; 5] = ["r1", "r2", "r3", "r4", "r5"];

/// Every recording is a view of one room with a camera of 66 x 54 pixels.
const SMALLER: [[&str; 2]; 2] =
    [["width: 132, height: 108", "width: 66, height: 54"], ["0.05333333333333334", "0.10666666666666667"]];

const PIPELINE: &str = "(name: \"recordings\", stages: [Demodulate(low_amplitude: 20), Average(), Deconvolve(), \
                        Unwrap(maximum_range_m: 12), CorrectRange(), CorrectImagePoint(), PointCloud(), Flag()])";

/// Writes the archive; seeds are those of places in it.
pub(crate) fn write(program: &Path, archive: &Path) -> Outcome {
    let access = |error: std::io::Error| format!("{}: {error}", archive.display());
    let scenes = archive.with_file_name("scenes");
    for folder in [archive, &scenes] {
        fs::create_dir_all(folder).map_err(access)?;
    }
    fs::write(archive.join("pipeline.ron"), PIPELINE).map_err(access)?;
    let room = changed("scenes/room_small.ron", &[["frames_per_station: 4", "frames_per_station: 2"]])?;
    // Twenty-five millimetres more at every range.
    let moved = room.replace("d0: 0.010", "d0: 0.035");
    let network = changed("networks/room_small.ron", &[])?;
    for (name, text) in [("room.ron", &room), ("moved.ron", &moved), ("network.ron", &network)] {
        fs::write(scenes.join(name), text).map_err(access)?;
    }
    let scene = |name: &str| scenes.join(name).display().to_string();
    let simulate = |command: &str, scene: &str, seed: usize, out: &str| {
        let out = archive.join(out).display().to_string();
        call(program, archive, &["--quiet", command, scene, "--seed", &seed.to_string(), "--out", &out])
    };
    for (c, camera) in CAMERAS.iter().enumerate() {
        simulate("simulate-network", &scene("network.ron"), 3 + c, &format!("{camera}/calibration"))?;
        for (d, day) in DAYS.iter().enumerate() {
            let seed = 1000 * (c + 1) + 100 * d;
            let has_moved = *camera == "south" && d >= 2;
            let room = scene(if has_moved { "moved.ron" } else { "room.ron" });
            simulate("simulate", &room, seed, &format!("{camera}/{day}/check"))?;
            for (r, recording) in RECORDINGS.iter().enumerate() {
                simulate("simulate", &room, seed + 1 + r, &format!("{camera}/{day}/{recording}"))?;
            }
        }
    }
    // A file that was cut off, and a recording that lists a frame which is not there.
    let cut = archive.join("north/day2/r3/frames/002_1.npz");
    let bytes = fs::read(&cut).map_err(access)?;
    fs::write(&cut, &bytes[..bytes.len() / 2]).map_err(access)?;
    fs::remove_file(archive.join("south/day1/r5/frames/006_0.npz")).map_err(access)
}

/// A fixture for the smaller camera.
fn changed(fixture: &str, further: &[[&str; 2]]) -> Result<String, String> {
    let path = root().join("fixtures").join(fixture);
    let mut text = fs::read_to_string(&path).map_err(|error| format!("{}: {error}", path.display()))?;
    for [from, to] in SMALLER.iter().chain(further) {
        if !text.contains(from) {
            return Err(format!("{}: has no `{from}`", path.display()));
        }
        text = text.replace(from, to);
    }
    Ok(text)
}
