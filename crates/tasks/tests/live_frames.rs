//! However many frames a survey has, few of them are in memory.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

use pipeline::{Plan, Progress, RunRequest};
use range_io::survey::Survey;
use tasks::{
    ChangeOptions, DriftOptions, FixedPatternRequest, NoiseFitOptions, NoiseRequest, PatternOptions, ReferenceUse,
    TrackRequest, WarmUpRequest, estimate_noise, estimate_pattern, estimate_warm_up, track,
};

use crate::common::simulated;

/// Frames of the survey: more than any bound.
const FRAMES: usize = 200;

/// Keeps the largest number of frames in memory, and counts how often it was told one.
#[derive(Default)]
struct Most {
    frames: AtomicUsize,
    told: AtomicUsize,
}

impl Progress for Most {
    fn begin(&self, _: &str, _: usize) {}
    fn advance(&self, _: usize) {}
    fn say(&self, _: &str) {}
    fn finish(&self) {}
    fn frames_in_memory(&self, frames: usize) {
        self.frames.fetch_max(frames, Ordering::Relaxed);
        self.told.fetch_add(1, Ordering::Relaxed);
    }
}

/// A survey that names the frames of one station again and again, in groups of this length as stations.
fn long(folder: &Path, group: usize) -> PathBuf {
    let folder = simulated("repeats", 1, folder);
    let mut survey = Survey::read(&folder).unwrap();
    let frame = |number: usize| {
        let mut frame = survey.frames[number % 6].clone();
        frame.station = format!("S{}", number / group);
        frame.timestamp_s = Some(0.1 * number as f64);
        frame
    };
    survey.frames = (0..FRAMES).map(frame).collect();
    survey.truth = None;
    survey.write(folder.join(Survey::FILE_NAME)).unwrap();
    folder
}

/// Most frames in memory while something is done with them; some of it may be refused by what so many equal frames show.
fn most<T>(act: impl FnOnce(&Most) -> pipeline::Result<T>) -> usize {
    let most = Most::default();
    match act(&most).map(drop) {
        Ok(()) | Err(pipeline::Error::Refused { .. }) => {}
        Err(error) => panic!("{error}"),
    }
    assert!(most.told.into_inner() >= FRAMES / 64, "nobody counts");
    most.frames.into_inner()
}

fn ran(stages: &str, survey: &Path, out: PathBuf) -> usize {
    let plan = Plan::from_ron(&format!("(name: \"long\", stages: [{stages}])"), "long.ron".as_ref()).unwrap();
    let plan_path = survey.join("survey.ron");
    let request = RunRequest { plan, plan_path, survey: Some(survey.to_owned()), calibration: None, out };
    most(|most| pipeline::run(&request, most))
}

#[test]
fn a_run_holds_what_it_averages_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let out = |name: &str| folder.path().join(name);
    let survey = long(folder.path(), FRAMES);
    // One for each thread is read, and 200 are averaged in four parts of 50.
    let threads = rayon::current_num_threads();
    let averaged = ran("Demodulate(), Average(), Unwrap(), PointCloud()", &survey, out("averaged"));
    assert!((50..=threads + 50 + 4).contains(&averaged), "{averaged}");
    assert_eq!(ran("Demodulate(), Unwrap(), PointCloud()", &survey, out("single")), threads);
}

#[test]
fn noise_and_fixed_pattern_hold_what_is_read_at_once() {
    for group in [FRAMES, 10] {
        let folder = tempfile::tempdir().unwrap();
        let survey = long(folder.path(), group);
        let (calibration, out) = (None, folder.path().join("noise"));
        let request = NoiseRequest { survey: survey.clone(), calibration, options: NoiseFitOptions::default(), out };
        let noise = most(|most| estimate_noise(&request, most));
        let (calibration, out) = (None, folder.path().join("fpn"));
        let request = FixedPatternRequest { survey, calibration, options: PatternOptions::default(), out };
        let pattern = most(|most| estimate_pattern(&request, most));
        assert!((8..=9).contains(&noise), "{noise}");
        assert_eq!(pattern, rayon::current_num_threads());
    }
}

#[test]
fn a_warm_up_holds_one_block_and_a_track_a_frame_for_each_thread() {
    let folder = tempfile::tempdir().unwrap();
    let survey = long(folder.path(), FRAMES);
    let request = WarmUpRequest {
        survey: survey.clone(),
        calibration: None,
        power_on_s: None,
        reference: ReferenceUse::Ignore,
        options: DriftOptions::default(),
        pixels: ChangeOptions::default(),
        out: folder.path().join("warm-up"),
    };
    let warm_up = most(|most| estimate_warm_up(&request, most));
    assert_eq!(warm_up, 32);
    // Tracking takes its time.
    let mut few = Survey::read(&survey).unwrap();
    few.frames.truncate(12);
    few.write(survey.join(Survey::FILE_NAME)).unwrap();
    let request = TrackRequest { survey, guess: None, calibration: None, out: folder.path().join("track") };
    assert_eq!(most(|most| track(&request, most)), rayon::current_num_threads());
}
