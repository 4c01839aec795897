//! Registration as a command: a survey or clouds of any format in, poses, one cloud, figures and a report out.

mod guess;
mod input;
mod pairs;
mod request;
mod results;
mod stations;
mod summary;
mod track;

use std::time::Instant;

pub use request::{RegisterMethod, RegisterRequest};
pub use summary::{
    EstimatedParameter, RegisterSummary, RegisteredLoop, RegisteredPair, RegisteredStation, StreamSummary,
};

use nalgebra::Isometry3;

use crate::Result;
use crate::outcome::StationPose;
use crate::progress::Progress;
use input::Station;

/// Poses found, and what is known of them.
pub(crate) struct Registered {
    /// What was registered.
    pub(crate) stations: Vec<Station>,
    /// One a station; `None` where none was found (lost frames of a stream).
    pub(crate) poses: Vec<Option<StationPose>>,
    /// Poses that the registration started from, where there were any.
    pub(crate) before: Vec<Option<Isometry3<f64>>>,
    /// Distances of each station's points from the surfaces of its partners at the end, metre; NaN where there is no
    /// partner. In the order of the points of its file.
    pub(crate) residuals_m: Vec<Vec<f32>>,
    /// Every figure.
    pub(crate) summary: RegisterSummary,
}

/// Registers and writes stations, trajectory, cloud, summary and report into the request's output folder.
pub fn register(request: &RegisterRequest, progress: &dyn Progress) -> Result<RegisterSummary> {
    let clock = Instant::now();
    let stations = input::read(request, progress)?;
    let mut registered = match request.method {
        RegisterMethod::Pairs => pairs::run(stations, request, progress)?,
        RegisterMethod::Multi => stations::run(stations, request, progress)?,
        RegisterMethod::Track => track::run(stations, request, progress)?,
    };
    registered.summary.seconds = clock.elapsed().as_secs_f64();
    results::write(&request.out, &registered, progress)?;
    progress.finish();
    Ok(registered.summary)
}
