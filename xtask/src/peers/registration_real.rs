//! Registration of real captures: `small_gicp`, Open3D and KISS-ICP beside `icp-registration`, on the same frames.
//!
//! The peers' settings are sought on the first half of the Kinect's frames. The second half judges.

mod judge;
mod search;
mod streams;

use super::environment::{Environment, Example, capture};
use super::table::Folder;
use crate::shell::Outcome;
use judge::{Runs, print};

/// Pairs of a Kinect: frames between the two, and from one pair to the next.
const GAPS: [usize; 3] = [10, 20, 30];
const STEP: usize = 6;
/// Frames of a half; settings are sought on the first.
const HALF: usize = 250;
/// The Kinect's reference jumps behind this frame, by 36 mm and 1.7 degrees.
const JUMP: usize = 121;

/// Target and source.
type Pair = [usize; 2];

/// The peers' environment, our example, where the frames are, and how often.
struct Stage {
    environment: Environment,
    ours: Example,
    folder: String,
    runs: usize,
}

pub(crate) fn run(runs: usize) -> Outcome {
    let Some(environment) = Environment::if_possible("registration") else { return Ok(()) };
    // Settings are sought on the Kinect's frames: without these there is nothing to hold against.
    if capture("sevenscenes_redkitchen_dense").is_none() {
        return Ok(());
    }
    let ours = Example::build("tracking", "registration_peers")?;
    let folder = Folder::new("registration_real")?;
    let stage = Stage { environment, ours, folder: folder.text(), runs };
    stage.write("dense_kitchen")?;
    let (first_half, across): (Vec<Pair>, Vec<Pair>) =
        kinect_pairs(0).into_iter().partition(|&[target, source]| JUMP < target || source <= JUMP);
    let methods = search::settings(&stage, &first_half)?;
    stage.compare("Kinect, frames 250 to 499", "dense_kitchen", &kinect_pairs(HALF), &methods)?;
    stage.compare("Kinect, frames 0 to 249 (settings)", "dense_kitchen", &first_half, &methods)?;
    stage.compare("Kinect, across the reference's jump", "dense_kitchen", &across, &methods)?;
    if capture("redwood_rgbd5").is_some() {
        stage.write("living_room")?;
        let pairs = [[0, 1], [1, 2], [2, 3], [3, 4], [0, 2], [1, 3], [2, 4]];
        stage.compare("Xtion, living room", "living_room", &pairs, &methods)?;
    }
    if capture("sr4000_steps").is_some() {
        stage.write("sr4000")?;
        let pairs: Vec<Pair> = (0..16).map(|k| [k / 4, 4 + k % 4]).collect();
        // It has a lens: no odometry of pinhole images.
        let methods: Vec<_> = methods.iter().filter(|(who, _)| who != search::PROJECTIVE).cloned().collect();
        stage.compare("SR4000, one frame a station", "sr4000", &pairs, &methods)?;
    }
    streams::compare(&stage)?;
    folder.remove()
}

/// Pairs within the half that begins there.
fn kinect_pairs(first: usize) -> Vec<Pair> {
    let of_gap = |gap: usize| (first..first + HALF - gap).step_by(STEP).map(move |k| [k, k + gap]);
    GAPS.into_iter().flat_map(of_gap).collect()
}

impl Stage {
    fn frames(&self, capture: &str) -> String {
        format!("{}/{capture}", self.folder)
    }

    fn write(&self, capture: &str) -> Outcome {
        println!("── frames: {capture}");
        self.ours.call(&["capture", capture, &self.frames(capture)]).map(|_| ())
    }

    /// What the peers with their settings, and we if asked, make of pairs.
    fn align(&self, capture: &str, pairs: &[Pair], methods: &[&str], with_ours: bool) -> Result<Runs, String> {
        let (frames, list) = (self.frames(capture), format!("{}/pairs.txt", self.folder));
        let lines: Vec<String> = pairs.iter().map(|[target, source]| format!("{target} {source}")).collect();
        std::fs::write(&list, lines.join("\n")).map_err(|error| format!("{list}: {error}"))?;
        let mut runs = Runs::default();
        if with_ours {
            runs.add_own(&self.ours.call(&["pairs", &frames, &list])?);
        }
        if !methods.is_empty() {
            let arguments = [&["pairs", &frames, &list], methods].concat();
            runs.add_peers(&self.environment.call("registration_peers.py", &arguments)?);
        }
        Ok(runs)
    }

    /// Everyone in turn, and the table.
    fn compare(&self, title: &str, capture: &str, pairs: &[Pair], methods: &[(String, String)]) -> Outcome {
        println!("── {title}");
        let peers: Vec<&str> = methods.iter().map(|(who, _)| who.as_str()).collect();
        let mut runs = Runs::default();
        for _ in 0..self.runs {
            runs.merge(self.align(capture, pairs, &peers, true)?);
        }
        print(title, pairs.len(), methods, &runs);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pairs_stay_within_their_half() {
        for first in [0, HALF] {
            let pairs = kinect_pairs(first);
            assert!(pairs.iter().all(|&[a, b]| first <= a && b < first + HALF && GAPS.contains(&(b - a))));
            assert_eq!(pairs.len(), 116);
        }
    }
}
