//! Registration: `small_gicp`, Open3D, KISS-ICP and KISS-Matcher beside `icp-registration`, on the same frames.

mod frames;
mod others;
mod verdicts;

use super::environment::{Environment, Example, Figures, capture, text};
use super::table::{Bars, Folder, Least};
use crate::shell::Outcome;

/// Folders of frames, by the names that the example knows.
const SIMULATED: [&str; 6] = ["large", "medium", "coarse", "degenerate", "tracking", "stations"];
/// What one method reaches over pairs: medians, and how many are good.
const PAIRS: [&str; 4] = ["ms", "deg", "mm", "good"];

/// The peers' environment, our example, where the frames are, and how often.
struct Stage {
    environment: Environment,
    ours: Example,
    folder: String,
    runs: usize,
    /// Whether there are frames of a Kinect.
    kinect: bool,
    /// Whether there are scans of a tilting laser.
    laser: bool,
}

pub(crate) fn run(runs: usize) -> Outcome {
    let Some(environment) = Environment::if_possible("registration") else { return Ok(()) };
    let ours = Example::build("tracking", "registration_peers")?;
    let folder = Folder::new("registration")?;
    let mut stage = Stage { environment, ours, folder: folder.text(), runs, kinect: false, laser: false };
    stage.make_frames()?;
    let (mut least, mut bars) = (Least::default(), Bars::default());
    frames::run(&stage, &mut least, &mut bars)?;
    verdicts::run(&stage, &mut least, &mut bars)?;
    others::coarse(&stage, &mut least, &mut bars)?;
    others::tracking(&stage, &mut least, &mut bars)?;
    others::stations(&stage, &mut least, &mut bars)?;
    bars.print();
    folder.remove()
}

impl Stage {
    fn make_frames(&mut self) -> Outcome {
        println!("── frames");
        for name in SIMULATED {
            self.ours(&["simulate", name], name, &[])?;
        }
        if let Some(kinect) = capture("sevenscenes_redkitchen") {
            self.peers("real", "kinect", &[&text(&kinect)])?;
            self.kinect = true;
        }
        if let Some(laser) = capture("libpointmatcher_icp") {
            let file = |name: &str| text(&laser.join(name));
            let [target, source] = ["cloud.00000.vtk", "cloud.00001.vtk"].map(file);
            let reference = file("icp_data/defaultIdentityDataPointsFilter.ref_trans");
            self.peers("scans", "laser", &[&target, &source, &reference])?;
            self.laser = true;
        }
        Ok(())
    }

    /// A command of the peers' script for a folder of frames.
    fn peers(&self, command: &str, frames: &str, rest: &[&str]) -> Result<serde_json::Value, String> {
        let folder = format!("{}/{frames}", self.folder);
        let mut arguments = vec![command, &folder];
        arguments.extend(rest);
        self.environment.call("registration_peers.py", &arguments)
    }

    /// A command of our example for a folder of frames.
    fn ours(&self, command: &[&str], frames: &str, rest: &[&str]) -> Result<Figures, String> {
        let folder = format!("{}/{frames}", self.folder);
        let arguments: Vec<&str> = [command, &[folder.as_str()], rest].concat();
        self.ours.call(&arguments)
    }
}
