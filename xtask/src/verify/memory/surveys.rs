//! Surveys that name the frames of simulated ones again and again.

use std::fs::{read_to_string, write};
use std::path::Path;
use std::process::Command;

use crate::shell::{Outcome, root};

/// Stages up to the cloud.
const STAGES: &str = "Demodulate(), Average(), Unwrap(), CorrectRange(), CorrectImagePoint(), PointCloud(), Flag()";

/// The surveys, and what they are made of.
pub(super) struct Surveys<'a> {
    pub(super) folder: &'a Path,
    pub(super) program: &'a Path,
}

/// Cameras of the fixtures' scenes, and frames of a station.
const SMALL: &str = "width: 66, height: 54, pixel_pitch_mm: (0.1, 0.1)";
const ROOM: &str = "width: 176, height: 144, pixel_pitch_mm: (0.04, 0.04)";
const FEW: &str = "width: 16, height: 12, pixel_pitch_mm: (0.1, 0.1)";
const SIX: &str = "frames_per_station: 6";
const TEN: &str = "frames_per_station: 10";
/// Frames of a warming camera, over an hour; each is named again where more are asked for.
const WARMING: usize = 1000;
/// Frames of a round through the room.
const ROUND: usize = 72;

/// Which station and which of its frames a frame is, and as what station.
type Named = Box<dyn Fn(usize) -> (usize, usize, usize)>;

impl Surveys<'_> {
    /// A survey of so many frames of 640x480, or of the size that its kind states. Its name.
    pub(super) fn large(&self, kind: &str, frames: usize) -> Result<String, String> {
        let name = format!("{kind} ({frames} frames)");
        if self.folder.join(&name).exists() {
            return Ok(name);
        }
        let distinct = frames.min(WARMING);
        let (of, named): (&str, Named) = match kind {
            "one station" => ("walls", Box::new(one_station)),
            "stations of 10" => ("walls", Box::new(stations_of_ten)),
            "stations of one, 176x144" => ("walls of 176x144", Box::new(stations_of_one)),
            "stations in a room" => ("room", Box::new(|frame| (frame % 8, frame / 8 % 8, frame))),
            // Five in turn: the noise is told by the differences of successive frames.
            "a warming camera" => {
                ("warming", Box::new(move |frame| (0, frame * distinct / frames / 5 * 5 + frame % 5, 0)))
            }
            _ => ("round", Box::new(path)),
        };
        if !self.folder.join(of).exists() {
            self.simulate_large(of, distinct)?;
        }
        self.long(&name, of, frames, named)?;
        Ok(name)
    }

    /// What frames of 640x480 are named from; so many of a warming camera.
    fn simulate_large(&self, name: &str, warming: usize) -> Outcome {
        let walls = "width: 640, height: 480, pixel_pitch_mm: (0.0105, 0.0105)";
        let room = (ROOM, "width: 640, height: 480, pixel_pitch_mm: (0.011, 0.011)");
        match name {
            "walls" => self.simulate("repeats", &[(SMALL, walls), (SIX, TEN)], name),
            "walls of 176x144" => self.simulate("repeats", &[(SMALL, ROOM), (SIX, TEN)], name),
            "room" => self.simulate("room", &[room], name),
            "round" => self.simulate_round(room, name),
            _ => {
                let wall = "width: 640, height: 480, pixel_pitch_mm: (0.0025, 0.0025)";
                let number = format!("frames_per_station: {warming}");
                let often = format!("frame_interval_s: {}", 3600.0 / warming as f64);
                let noise = "dark_sigma: 25.0),";
                let digitised = format!("{noise} digitisation: (sample_type: U16, raw_scale: 2.5),");
                let often = ("frame_interval_s: 12.0", often.as_str());
                let number = ("frames_per_station: 300", number.as_str());
                self.simulate("warm_up", &[(FEW, wall), number, often, (noise, &digitised)], name)
            }
        }
    }

    /// What those of small frames are made of.
    pub(super) fn write_small(&self) -> Outcome {
        self.simulate("repeats", &[(SIX, TEN)], "small walls")?;
        self.simulate_round((ROOM, "width: 66, height: 54, pixel_pitch_mm: (0.107, 0.107)"), "small round")
    }

    /// A survey of so many small frames: named again and again, and of a camera that drifts all that it takes. Its name.
    pub(super) fn small(&self, kind: &str, frames: usize) -> Result<String, String> {
        let name = format!("{kind} ({frames})");
        if self.folder.join(&name).exists() {
            return Ok(name);
        }
        match kind {
            "one station" => self.long(&name, "small walls", frames, one_station),
            "stations of 3" => self.long(&name, "small walls", frames, stations_of_three),
            "stations of 10" => self.long(&name, "small walls", frames, stations_of_ten),
            "stations of one" => self.long(&name, "small walls", frames, stations_of_one),
            "a path" => self.long(&name, "small round", frames, path),
            _ => {
                let number = format!("frames_per_station: {frames}");
                self.simulate("warm_up", &[("frames_per_station: 300", &number)], &name)
            }
        }?;
        Ok(name)
    }

    /// The pipelines.
    pub(super) fn write_plans(&self) -> Outcome {
        for (name, more) in [("cloud.ron", ""), ("joined.ron", ", Register(), Adjust()")] {
            let text = format!("(name: \"long\", stages: [{STAGES}{more}])");
            write(self.folder.join(name), text).map_err(|error| error.to_string())?;
        }
        Ok(())
    }

    /// A scene of the fixtures with some of its words replaced.
    fn simulate(&self, scene: &str, others: &[(&str, &str)], name: &str) -> Outcome {
        self.simulated(&others.iter().fold(text_of(scene)?, |text, (from, to)| text.replace(from, to)), name)
    }

    /// The room from a camera that looks outwards and goes round its middle.
    fn simulate_round(&self, (camera, other): (&str, &str), name: &str) -> Outcome {
        let station = |number: usize| {
            let (sin, cos) = (std::f64::consts::TAU * number as f64 / ROUND as f64).sin_cos();
            let at = |radius: f64| [3.75 + radius * cos, 3.0 + radius * sin];
            let ([x, y], [to_x, to_y]) = (at(0.9), at(3.0));
            format!(
                "        (name: \"R{number}\", position_m: ({x:.4}, {y:.4}, 1.6), attitude: LookAt(target_m: ({to_x:.4}, {to_y:.4}, 1.3), \
                 roll_deg: 0.0)),\n"
            )
        };
        let text = text_of("room")?.replace(camera, other).replace("frames_per_station: 8", "frames_per_station: 1");
        let parted = text.split_once("    stations: [").zip(text.split_once("    errors: ("));
        let ((before, _), (_, behind)) = parted.ok_or("room: has no stations before its errors")?;
        let stations: String = (0..ROUND).map(station).collect();
        self.simulated(&format!("{before}    stations: [\n{stations}    ],\n    errors: ({behind}"), name)
    }

    fn simulated(&self, scene: &str, name: &str) -> Outcome {
        let failed = |error: std::io::Error| format!("{name}: {error}");
        let file = self.folder.join(format!("{name}.ron"));
        write(&file, scene).map_err(failed)?;
        let mut command = Command::new(self.program);
        let status = command.args(["simulate", "--quiet", "--out", name]).arg(&file).current_dir(self.folder).status();
        let status = status.map_err(failed)?;
        if status.success() { Ok(()) } else { Err(format!("simulate {name}: {status}")) }
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

/// The scene of a file among the fixtures.
fn text_of(scene: &str) -> Result<String, String> {
    let file = root().join(format!("fixtures/scenes/{scene}.ron"));
    read_to_string(&file).map_err(|error| format!("{}: {error}", file.display()))
}

/// Which station and which of its frames a frame is, and of what station it is said to be: ten frames of one, over and over.
fn one_station(frame: usize) -> (usize, usize, usize) {
    (0, frame % 10, 0)
}

/// The ten frames of one of six stations after the other.
fn stations_of_ten(frame: usize) -> (usize, usize, usize) {
    (frame / 10 % 6, frame % 10, frame / 10)
}

/// Three of these.
fn stations_of_three(frame: usize) -> (usize, usize, usize) {
    (frame / 3 % 6, frame % 3 + frame / 18 % 3 * 3, frame / 3)
}

/// A frame of one of six stations after the other.
fn stations_of_one(frame: usize) -> (usize, usize, usize) {
    (frame % 6, frame / 6 % 10, frame)
}

/// Round after round.
fn path(frame: usize) -> (usize, usize, usize) {
    (frame % ROUND, 0, frame)
}
