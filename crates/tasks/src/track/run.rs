//! From the request to the written results.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Instant;

use atomic_output::Destination;
use commands::{Doubt, Inputs, Progress, produce, root_of};
use nalgebra::Isometry3;
use pipeline::survey::plausibility;
use pipeline::{Error, Result};
use point_cloud::Cloud;
use projective_registration::Projection;
use statistics::quantile;
use tracking::{TrackedPose, Tracker, TrackerOptions, TrackingState};

use crate::register::input::is_survey;
use crate::track::frames::{FrameSource, PointFrame};
use crate::track::imu::Inertial;
use crate::track::outcome::{FramePose, Tracked, TrackedFrame, reason, state, station_pose};
use crate::track::start::Start;
use crate::track::summary::{TrackSummary, summarise};
use crate::track::{TrackRequest, results};

/// Tracks the frames of a survey and writes path, map, summary and report into the request's output folder.
///
/// Where the camera was lost and not found again until the end, or where most frames have no pose, what was tracked is
/// written, and the summary is [`Verdict::Partial`](pipeline::Verdict::Partial).
///
/// # Errors
/// [`Error::Refused`] where no frame can be tracked: then the reason is written, beside an older result where there is
/// one. Every other error leaves what was there.
pub fn track(request: &TrackRequest, progress: &dyn Progress) -> Result<TrackSummary> {
    let inputs = Inputs::default().survey(&request.survey);
    let inputs = inputs.maybe(request.guess.as_deref()).maybe(request.calibration.as_deref());
    produce(&request.out, &inputs, |destination| track_into(destination, request, progress))
}

fn track_into(destination: &Destination, request: &TrackRequest, progress: &dyn Progress) -> Result<TrackSummary> {
    let clock = Instant::now();
    if !is_survey(&request.survey) {
        let message =
            format!("{} is no folder of a survey: --track follows the frames of one", request.survey.display());
        return Err(Error::Request { command: "register", message });
    }
    let start = Start::read(request.guess.as_deref())?;
    let source = FrameSource::new(&request.survey, request.calibration.as_deref())?;
    let root = root_of(&request.survey);
    let inertial = Inertial::read(source.survey(), &root)?;
    let prior = match (&inertial, root.join("imu.csv").is_file()) {
        (Some(_), _) => "inertial unit",
        (None, true) => {
            "constant velocity; imu.csv is there, but survey.ron does not name it (extras: {\"imu\": \"imu.csv\"})"
        }
        (None, false) => "constant velocity",
    };
    let mut run = Run::new(source, start, inertial)?;
    run.all(progress)?;
    let mut tracked = run.finish(prior)?;
    let summary = &mut tracked.summary;
    summary.survey = request.survey.display().to_string();
    summary.out = request.out.display().to_string();
    summary.seconds = commands::made::seconds_since(clock);
    results::write(destination, &tracked, progress)?;
    progress.finish();
    Ok(tracked.summary)
}

/// A sequence on its way.
struct Run {
    source: FrameSource,
    /// How points fall on the camera's pixels.
    projection: Arc<Projection>,
    start: Start,
    inertial: Option<Inertial>,
    /// The tracker, once a frame has shown surfaces.
    tracker: Option<Tracker>,
    datum: String,
    has_pose: bool,
    poses: Vec<FramePose>,
    frames: Vec<TrackedFrame>,
    names: Vec<String>,
}

impl Run {
    fn new(source: FrameSource, start: Start, inertial: Option<Inertial>) -> Result<Self> {
        let projection = source.projection()?;
        let names = names(&source);
        let (poses, frames, datum) = (Vec::new(), Vec::new(), String::new());
        Ok(Self { source, projection, start, inertial, tracker: None, datum, has_pose: false, poses, frames, names })
    }

    fn all(&mut self, progress: &dyn Progress) -> Result<()> {
        let order = self.source.order.clone();
        progress.begin("track frames", order.len());
        let mut done = 0;
        for indices in order.chunks(self.source.at_once) {
            let clock = Instant::now();
            let frames = self.source.read(indices, progress)?;
            let each_ms = ms(clock) / frames.len() as f64;
            for (&index, frame) in indices.iter().zip(&frames) {
                self.frame(index, frame, each_ms)?;
                done += 1;
                progress.advance(done);
            }
        }
        Ok(())
    }

    /// Tracks by a frame that took so long to be brought to points, millisecond.
    fn frame(&mut self, index: usize, read: &PointFrame, points_ms: f64) -> Result<()> {
        let entry = &self.source.survey().frames[index];
        let (station, timestamp_s) = (entry.station.clone(), entry.timestamp_s.unwrap_or_default());
        let tracking = Instant::now();
        let fail = |error: tracking::Error| Error::registration(&format!("frame {station} at {timestamp_s} s"), &error);
        let before = self.tracker.as_ref().map_or(0, Tracker::keyframes);
        let pose = if let Some(tracker) = &mut self.tracker {
            let prior = self.inertial.as_mut().map(|inertial| inertial.motion(timestamp_s)).transpose()?.flatten();
            tracker.track(timestamp_s, &read.points, read.sigma.as_deref(), prior.as_ref()).map_err(fail)?
        } else {
            let world_from_first = self.start.pose(&self.source, &station, timestamp_s);
            let known = world_from_first.unwrap_or_default();
            let options = TrackerOptions { world_from_first: known, ..TrackerOptions::default() };
            let mut tracker = Tracker::new(&self.projection, options).map_err(fail)?;
            let pose = tracker.track(timestamp_s, &read.points, read.sigma.as_deref(), None).map_err(fail)?;
            // A blank frame starts nothing: the next one may.
            if pose.state == TrackingState::Started {
                self.datum = self.start.datum(world_from_first, &station, timestamp_s)?;
                self.has_pose = world_from_first.is_some();
                self.inertial.as_mut().map(|inertial| inertial.motion(timestamp_s)).transpose()?;
                self.tracker = Some(tracker);
            }
            pose
        };
        if let Some(inertial) = &mut self.inertial {
            inertial.learn(&pose)?;
        }
        let after = self.tracker.as_ref().map_or(0, Tracker::keyframes);
        let became_keyframe = after > before;
        let track_ms = ms(tracking);
        let times = [track_ms, points_ms + track_ms];
        let name = std::mem::take(&mut self.names[index]);
        self.frames.push(row(name, index, &pose, became_keyframe, times));
        self.poses.push(FramePose::new(&pose, self.tracker.is_some()));
        self.tracker.iter_mut().for_each(Tracker::forget_poses);
        Ok(())
    }

    fn finish(mut self, prior: &str) -> Result<Tracked> {
        let Some(tracker) = self.tracker else {
            let frames = self.frames.len();
            return Err(Error::Register(format!(
                "none of the {frames} frames shows enough of a surface to start from (too few points with a range)"
            )));
        };
        let mut keyframes: BTreeMap<usize, Option<Isometry3<f64>>> = BTreeMap::new();
        for pose in &mut self.poses {
            let Some((keyframe, keyframe_from_camera)) = pose.from_keyframe else { continue };
            let world = *keyframes.entry(keyframe).or_insert_with(|| tracker.world_from_keyframe(keyframe));
            pose.adjusted = world.map_or(pose.tracked, |world| world * keyframe_from_camera);
        }
        let truths: Vec<_> = self
            .frames
            .iter()
            .map(|frame| self.source.true_pose(&self.source.survey().frames[frame.index].station))
            .collect();
        let mut doubts = self.source.doubts()?;
        let mut summary = summarise(self.frames, &self.poses, &truths, &tracker);
        self.source.calibration().clone_into(&mut summary.calibration);
        summary.datum = self.datum;
        prior.clone_into(&mut summary.prior);
        doubts.extend(uncertain(&summary, &tracker));
        doubts.append(&mut summary.doubts);
        summary.doubts = doubts;
        // As everywhere: z where poses came with the survey, y in a camera's own frame.
        let vertical_axis = if self.has_pose { 2 } else { 1 };
        Ok(Tracked { poses: self.poses, map: tracker.map(), vertical_axis, summary })
    }
}

fn ms(from: Instant) -> f64 {
    1e3 * commands::made::seconds_since(from)
}

/// Frames that the surfaces do not hold, against how far the scene extends.
fn uncertain(summary: &TrackSummary, tracker: &Tracker) -> Option<Doubt> {
    let frames = summary.per_frame.iter();
    let known =
        frames.filter_map(|frame| Some((frame.name.as_str(), frame.position_sigma_m?, frame.attitude_sigma_deg?)));
    plausibility::uncertain_frames(&known.collect::<Vec<_>>(), half_extent_m(&tracker.map()))
}

/// Half of the longest side of a map without its outermost points, metre.
fn half_extent_m(map: &Cloud) -> f64 {
    let extent = |axis: usize| {
        let mut values: Vec<f64> = map.points.iter().map(|point| point[axis]).collect();
        quantile(&mut values, 0.95) - quantile(&mut values, 0.05)
    };
    0.5 * (0..3).map(extent).fold(0.0, f64::max)
}

/// Names of the frames: their stations', with the frame's number where a station has several.
fn names(source: &FrameSource) -> Vec<String> {
    let frames = &source.survey().frames;
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    for frame in frames {
        *counts.entry(&frame.station).or_default() += 1;
    }
    let name = |(index, frame): (usize, &range_io::survey::FrameEntry)| {
        let station = &frame.station;
        if counts.get(station.as_str()) == Some(&1) { station.clone() } else { format!("{station}-{index}") }
    };
    frames.iter().enumerate().map(name).collect()
}

fn row(name: String, index: usize, pose: &TrackedPose, became_keyframe: bool, times: [f64; 2]) -> TrackedFrame {
    let known = station_pose(pose);
    let attitude = |c: &nalgebra::Matrix6<f64>| (c[(3, 3)] + c[(4, 4)] + c[(5, 5)]).sqrt().to_degrees();
    TrackedFrame {
        name,
        index,
        timestamp_s: pose.timestamp_s,
        state: state(pose.state),
        reason: reason(pose.state),
        keyframe: known.as_ref().map(|_| pose.keyframe),
        became_keyframe,
        overlap: pose.overlap,
        rms_m: known.as_ref().map(|_| pose.rms_m),
        position_sigma_m: known.as_ref().and_then(pipeline::survey::StationPose::position_sigma_m),
        attitude_sigma_deg: known.map(|_| attitude(&pose.covariance)),
        track_ms: times[0],
        total_ms: times[1],
    }
}
