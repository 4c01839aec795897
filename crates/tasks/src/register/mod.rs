//! Registration as a command: a survey or clouds of any format in, poses, one cloud, figures and a report out.

pub(crate) mod chain;
pub(crate) mod describe;
pub(crate) mod document;
pub(crate) mod frames;
pub(crate) mod guess;
pub(crate) mod input;
pub(crate) mod pairs;
pub(crate) mod request;
pub(crate) mod results;
pub(crate) mod stations;
pub(crate) mod summary;

pub use request::{RegisterMethod, RegisterRequest};
pub use summary::{RegisterSummary, RegisteredLoop, RegisteredPair, RegisteredPlacement, RegisteredStation};

use std::time::Instant;

use atomic_output::Destination;
use commands::{Doubt, Inputs, Progress, produce};
use nalgebra::Isometry3;
use pipeline::Result;
use pipeline::stations::Station;
use pipeline::survey::{StationPose, plausibility};

/// Poses found, and what is known of them.
pub(crate) struct Registered {
    /// What was registered.
    pub(crate) stations: Vec<Station>,
    /// One a station.
    pub(crate) poses: Vec<StationPose>,
    /// Poses that the registration started from, where there were any.
    pub(crate) before: Option<Vec<Isometry3<f64>>>,
    /// Signed distances of each station's points from the surfaces of its partners at the end, metre; NaN where there is
    /// no partner. In the order of the points of its file.
    pub(crate) residuals_m: Vec<Vec<f64>>,
    /// Index of the axis of the common frame that points up.
    pub(crate) vertical_axis: usize,
    /// Every figure.
    pub(crate) summary: RegisterSummary,
}

/// Registers and writes stations, trajectory, cloud, summary and report into the request's output folder.
pub fn register(request: &RegisterRequest, progress: &dyn Progress) -> Result<RegisterSummary> {
    let listed = request.inputs.iter().fold(Inputs::default(), |inputs, path| {
        if input::is_survey(path) { inputs.survey(path) } else { inputs.path(path) }
    });
    let inputs = listed.maybe(request.guess.as_deref()).maybe(request.calibration.as_deref());
    produce(&request.out, &inputs, |destination| register_into(destination, request, progress))
}

fn register_into(
    destination: &Destination,
    request: &RegisterRequest,
    progress: &dyn Progress,
) -> Result<RegisterSummary> {
    let clock = Instant::now();
    let mut input = input::read(request, progress)?;
    let start = match &request.guess {
        Some(path) => {
            guess::apply(path, &mut input.stations)?;
            format!("poses of {}", path.display())
        }
        None => "approximate poses of the input".to_owned(),
    };
    let doubts = std::mem::take(&mut input.doubts);
    let mut registered = match request.method {
        RegisterMethod::Pairs => pairs::run(input, &start, progress)?,
        RegisterMethod::Multi => stations::run(input, &start, progress)?,
    };
    registered.doubt(doubts);
    let summary = &mut registered.summary;
    summary.method = request.method.name();
    summary.inputs = request.inputs.iter().map(|path| path.display().to_string()).collect();
    summary.out = request.out.display().to_string();
    summary.seconds = commands::made::seconds_since(clock);
    results::write(destination, &mut registered, progress)?;
    progress.finish();
    Ok(registered.summary)
}

impl Registered {
    /// Adds what speaks against the frames, and against the poses that were found from them.
    fn doubt(&mut self, of_frames: Vec<Doubt>) {
        let placed: Vec<_> =
            self.stations.iter().zip(&self.poses).map(|(station, pose)| station.placed(pose)).collect();
        let mut doubts = of_frames;
        doubts.extend(plausibility::uncertain(&placed));
        doubts.extend(plausibility::displaced(&placed));
        doubts.append(&mut self.summary.doubts);
        self.summary.doubts = doubts;
    }
}
