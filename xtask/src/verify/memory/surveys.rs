//! Surveys that name the frames of simulated ones again and again.

use std::fs::{read_to_string, write};
use std::path::Path;
use std::process::Command;

use super::FRAMES;
use crate::shell::{Outcome, root};

/// Stages up to the cloud.
const STAGES: &str = "Demodulate(), Average(), Unwrap(), CorrectRange(), CorrectImagePoint(), PointCloud(), Flag()";

/// The surveys, and what they are made of.
pub(super) struct Surveys<'a> {
    pub(super) folder: &'a Path,
    pub(super) program: &'a Path,
}

/// Cameras of the fixtures' scenes.
const SMALL: &str = "width: 66, height: 54, pixel_pitch_mm: (0.1, 0.1)";
const ROOM: &str = "width: 176, height: 144, pixel_pitch_mm: (0.04, 0.04)";

impl Surveys<'_> {
    /// Those of 640 x 480 pixels.
    pub(super) fn write(&self) -> Outcome {
        self.simulate("repeats", [SMALL, "width: 640, height: 480, pixel_pitch_mm: (0.0105, 0.0105)"], "walls")?;
        self.simulate("repeats", [SMALL, ROOM], "small")?;
        self.simulate("room", [ROOM, "width: 640, height: 480, pixel_pitch_mm: (0.011, 0.011)"], "room")?;
        // Six walls with six frames each; eight stations in the room with eight.
        self.long("one station of 2,000", "walls", FRAMES, |frame| (0, frame % 6, 0))?;
        self.long("200 stations of 10", "walls", FRAMES, |frame| (frame / 10 % 6, frame % 6, frame / 10))?;
        self.long("2,000 stations of one, 176x144", "small", FRAMES, |frame| (frame % 6, frame / 6 % 6, frame))?;
        self.long("40 stations of one, a room", "room", 40, |frame| (frame % 8, frame / 8 % 8, frame))?;
        self.long("one station of 2,000, a room", "room", FRAMES, |frame| (0, frame % 8, 0))?;
        Ok(())
    }

    /// Those of small frames, of each length: frames named again and again, and of a camera that drifts all that it takes.
    pub(super) fn write_small(&self, counts: &[usize]) -> Outcome {
        self.simulate("repeats", [SMALL, SMALL], "small walls")?;
        self.simulate("room", [ROOM, "width: 66, height: 54, pixel_pitch_mm: (0.107, 0.107)"], "small room")?;
        for &frames in counts {
            let name = |begin: &str| Self::small_name(begin, frames);
            self.long(&name("one station"), "small walls", frames, |frame| (0, frame % 6, 0))?;
            // Frames of a station that are told apart: six, then those of the next.
            self.long(&name("stations of 10"), "small walls", frames, |frame| (frame / 10 % 6, frame % 6, frame / 10))?;
            self.long(&name("stations of one"), "small walls", frames, |frame| (frame % 6, frame / 6 % 6, frame))?;
            self.long(&name("a room"), "small room", frames, |frame| (0, frame % 8, 0))?;
            self.simulate(
                "warm_up",
                ["frames_per_station: 300", &format!("frames_per_station: {frames}")],
                &name("a warming camera"),
            )?;
        }
        Ok(())
    }

    /// Name of a survey of small frames.
    pub(super) fn small_name(begin: &str, frames: usize) -> String {
        format!("{begin} ({frames})")
    }

    /// The pipelines.
    pub(super) fn write_plans(&self) -> Outcome {
        for (name, more) in [("cloud.ron", ""), ("joined.ron", ", Register(), Adjust()")] {
            let text = format!("(name: \"long\", stages: [{STAGES}{more}])");
            write(self.folder.join(name), text).map_err(|error| error.to_string())?;
        }
        Ok(())
    }

    /// A scene of the fixtures with another camera.
    fn simulate(&self, scene: &str, [from, to]: [&str; 2], name: &str) -> Outcome {
        let failed = |error: std::io::Error| format!("{scene}: {error}");
        let text = read_to_string(root().join(format!("fixtures/scenes/{scene}.ron"))).map_err(failed)?;
        let file = self.folder.join(format!("{name}.ron"));
        write(&file, text.replace(from, to)).map_err(failed)?;
        let mut command = Command::new(self.program);
        let status = command.args(["simulate", "--quiet", "--out", name]).arg(&file).current_dir(self.folder).status();
        let status = status.map_err(failed)?;
        if status.success() { Ok(()) } else { Err(format!("simulate {scene}: {status}")) }
    }

    /// A survey that names frames of another one: of which station and which of its frames, and as what station.
    fn long(&self, name: &str, of: &str, frames: usize, named: impl Fn(usize) -> (usize, usize, usize)) -> Outcome {
        let failed = |error: std::io::Error| format!("{name}: {error}");
        let (from, to) = (self.folder.join(of), self.folder.join(name));
        std::fs::create_dir(&to).map_err(failed)?;
        std::fs::copy(from.join("calibration.ron"), to.join("calibration.ron")).map_err(failed)?;
        let text = read_to_string(from.join("survey.ron")).map_err(failed)?;
        let head = text.split("    frames: [").next().unwrap_or_default();
        let poses = read_to_string(from.join("stations.csv")).map_err(failed)?;
        let poses: Vec<&str> = poses.lines().collect();
        let mut rows: Vec<String> = poses.first().map(|header| (*header).to_owned()).into_iter().collect();
        let (mut entries, mut known) = (Vec::with_capacity(frames), 0);
        for frame in 0..frames {
            let (station, number, own) = named(frame);
            let time = 0.1 * frame as f64;
            entries.push(format!(
                "(file: \"../{of}/frames/{station:03}_{number}.npz\", station: \"L{own}\", timestamp_s: {time:.1}),"
            ));
            if own == known {
                let pose = poses.get(station + 1).and_then(|row| row.split_once(',')).map_or("", |(_, pose)| pose);
                rows.push(format!("L{own},{pose}"));
                known += 1;
            }
        }
        write(to.join("survey.ron"), format!("{head}    frames: [\n{}\n    ],\n)\n", entries.join("\n")))
            .map_err(failed)?;
        write(to.join("stations.csv"), rows.join("\n") + "\n").map_err(failed)
    }
}
