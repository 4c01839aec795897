//! Forty small recordings of two cameras on four days, two of them broken, and one camera that moves on the third day.

use std::fs;
use std::path::Path;

use crate::shell::{Outcome, root};
use crate::workflow::call;

/// Cameras, days and recordings of a day.
pub(crate) const CAMERAS: [&str; 2] = ["north", "south"];
pub(crate) const DAYS: [&str; 4] = ["day1", "day2", "day3", "day4"];
pub(crate) const RECORDINGS: [&str; 5] = ["r1", "r2", "r3", "r4", "r5"];

/// What the fixture's camera scatters, which targets do not show.
const SCATTERING: [&str; 2] = ["scattering: Gaussians([", "]),"];

/// Stations that only the surveys of checks have: they have to overlap.
const FURTHER: [&str; 5] = ["S3", "S4", "S5", "S6", "S7"];

const PIPELINE: &str = "(name: \"recordings\", stages: [Demodulate(low_amplitude: 20), Average(), \
                        Unwrap(maximum_range_m: 12), CorrectRange(), CorrectImagePoint(), PointCloud(), Flag()])";

/// Writes the archive; seeds are those of places in it.
pub(crate) fn write(program: &Path, archive: &Path) -> Outcome {
    let access = |error: std::io::Error| format!("{}: {error}", archive.display());
    let scenes = archive.with_file_name("scenes");
    for folder in [archive, &scenes] {
        fs::create_dir_all(folder).map_err(access)?;
    }
    fs::write(archive.join("pipeline.ron"), PIPELINE).map_err(access)?;
    let check = without_scattering(&fixture("scenes/room_small.ron")?)?;
    let few = |line: &&str| !FURTHER.iter().any(|name| line.contains(&format!("(name: \"{name}\", position_m")));
    let short = check.replace("frames_per_station: 4", "frames_per_station: 2");
    let room: String = short.split_inclusive('\n').filter(few).collect();
    // Twenty-five millimetres more at every range.
    let moved = |text: &str| text.replace("d0: 0.010", "d0: 0.035");
    let texts = [("room", moved(&room), room), ("check", moved(&check), check)];
    for (name, moved, still) in &texts {
        fs::write(scenes.join(format!("{name}_moved.ron")), moved).map_err(access)?;
        fs::write(scenes.join(format!("{name}.ron")), still).map_err(access)?;
    }
    fs::write(scenes.join("network.ron"), fixture("networks/room_small.ron")?).map_err(access)?;
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
            let [room, check] =
                ["room", "check"].map(|name| scene(&(name.to_owned() + if has_moved { "_moved.ron" } else { ".ron" })));
            simulate("simulate", &check, seed, &format!("{camera}/{day}/check"))?;
            for (r, recording) in RECORDINGS.iter().enumerate() {
                simulate("simulate", &room, seed + 1 + r, &format!("{camera}/{day}/{recording}"))?;
            }
        }
    }
    // A file that was cut off, and a recording that lists a frame which is not there.
    let cut = archive.join("north/day2/r3/frames/002_1.npz");
    let bytes = fs::read(&cut).map_err(access)?;
    fs::write(&cut, &bytes[..bytes.len() / 2]).map_err(access)?;
    fs::remove_file(archive.join("south/day1/r5/frames/001_0.npz")).map_err(access)
}

fn fixture(name: &str) -> Result<String, String> {
    let path = root().join("fixtures").join(name);
    fs::read_to_string(&path).map_err(|error| format!("{}: {error}", path.display()))
}

fn without_scattering(scene: &str) -> Result<String, String> {
    let [begin, end] = SCATTERING;
    let parts = scene.split_once(begin).and_then(|(before, rest)| Some((before, rest.split_once(end)?.1)));
    parts
        .map(|(before, after)| format!("{before}{after}"))
        .ok_or_else(|| "room_small.ron: scatters no light".to_owned())
}
