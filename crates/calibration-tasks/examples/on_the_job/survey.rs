//! One simulated survey: calibrated by its own surfaces, and checked.

use std::fmt;
use std::path::{Path, PathBuf};
use std::time::Instant;

use calibration_tasks::pipeline::{Error, Silent, SimulateSource, Stage, simulate};
use calibration_tasks::{
    CalibrateMethod, CalibrateRequest, CalibrationCheck, CalibrationOptions, CertificateRequest, CheckRequest,
    OffsetModel, TableDefaults, TermSelection, calibrate, check,
};
use commands::plan::DriftTreatment;
use pipeline::{Plan, RunRequest, run};
use range_io::calibration::Calibration;
use serde::{Deserialize, Serialize};

use crate::points::{CLASSES, Squares, squared_errors};

/// Level of the checks.
pub const LEVEL: f64 = 0.05;
const TOLERANCE_M: f64 = 0.001;
/// By what d0 is moved.
pub const MOVED_M: f64 = 0.005;

/// What one survey gave.
#[derive(Serialize, Deserialize)]
pub struct SurveyFigures {
    pub seed: u64,
    /// Median error of its ranges with its own terms and with the true ones, metre.
    pub medians_m: [f64; 2],
    /// Error and stated standard deviation of each term, from the truth as the start.
    pub terms: Vec<(String, f64, f64)>,
    /// Squared error over variance of all terms, and their number.
    pub of_truth: (f64, usize),
    /// Squared errors of the points of its cloud, registered and corrected with its own terms, by class.
    pub points: [Squares; CLASSES.len()],
    /// Check of the calibration of the survey before: probability, whether it moved, and by what matters.
    pub of_earlier: Option<(f64, bool, bool)>,
    /// The same with d0 moved.
    pub of_moved: Option<(f64, bool, bool)>,
    /// Time of the calibration, second.
    pub seconds: f64,
}

/// Where surveys are simulated and figures kept.
pub struct Bench {
    scene: PathBuf,
    plan: Plan,
    /// The same with the stations registered.
    whole: Plan,
    folder: PathBuf,
}

impl Bench {
    pub fn new(fixtures: &Path, scene: PathBuf, folder: PathBuf) -> Self {
        let mut whole = Plan::read(&fixtures.join("pipelines/room_small.ron")).unwrap();
        whole.source = None;
        // The room's pipeline up to flagged, corrected points.
        let mut plan = whole.clone();
        plan.stages.retain(|stage| !matches!(stage, Stage::Register(_) | Stage::Adjust(_)));
        Self { scene, plan, whole, folder }
    }

    /// A survey's own calibration.
    pub fn own(&self, seed: u64) -> PathBuf {
        self.folder.join(format!("own{seed}.ron"))
    }

    /// The figures of a survey, checked against the calibration of an earlier one: those that are kept, or new ones.
    /// `None` where one of its calibrations was refused.
    pub fn figures(&self, seed: u64, earlier: Option<u64>) -> Option<SurveyFigures> {
        let kept = self.folder.join(format!("survey{seed}.json"));
        if let Ok(text) = std::fs::read_to_string(&kept) {
            return serde_json::from_str(&text).unwrap();
        }
        let work = tempfile::tempdir().unwrap();
        let earlier = earlier.filter(|earlier| self.own(*earlier).exists());
        let figures = self.taken(seed, earlier, work.path());
        let figures = figures.map_err(|error| println!("{seed:>6} {error}")).ok();
        std::fs::write(kept, serde_json::to_string(&figures).unwrap()).unwrap();
        figures
    }

    fn taken(&self, seed: u64, earlier: Option<u64>, work: &Path) -> Result<SurveyFigures, Error> {
        let survey = work.join("survey");
        let source = SimulateSource {
            scene: self.scene.display().to_string(),
            seed,
            approximate_position_sigma_m: 0.05,
            approximate_attitude_sigma_deg: 2.0,
            gross_error_share: 0.0,
        };
        simulate(&source, Path::new(""), &survey, &Silent).unwrap();
        let truth = survey.join("truth/calibration.ron");
        let mut lens = Calibration::read(&truth).unwrap();
        lens.range_models.clear();
        lens.write(work.join("lens.ron")).unwrap();
        let clock = Instant::now();
        calibrate(&request(&survey, &work.join("lens.ron"), &work.join("own")), &Silent)?;
        let seconds = clock.elapsed().as_secs_f64();
        std::fs::copy(work.join("own/calibration.ron"), self.own(seed)).unwrap();
        let median = |calibration: &Path, plan: &Plan, out: &str| {
            let request = RunRequest {
                plan: plan.clone(),
                plan_path: work.join("plan.ron"),
                survey: Some(survey.clone()),
                calibration: Some(calibration.to_owned()),
                out: work.join(out),
            };
            run(&request, &Silent).unwrap().truth.unwrap().ranges.range_error_median_m
        };
        let medians_m = [median(&self.own(seed), &self.whole, "whole"), median(&truth, &self.plan, "true")];
        let points = squared_errors(&work.join("whole"), &survey);
        let found = checked(&survey, &truth)?.difference;
        let terms = found.parameters.iter().filter(|term| term.sigma > 0.0);
        let terms = terms.map(|term| (term.name.clone(), term.difference, term.sigma)).collect();
        let of_truth = found.joint.map_or((f64::NAN, 0), |joint| (joint.chi_squared, joint.degrees));
        let of_earlier = earlier.map(|earlier| Ok::<_, Error>(judged(&checked(&survey, &self.own(earlier))?)));
        let of_moved = earlier.map(|earlier| {
            let mut moved = Calibration::read(self.own(earlier)).unwrap();
            let d0 = moved.range_models[0].parameters.iter_mut().find(|parameter| parameter.name == "d0").unwrap();
            d0.value += MOVED_M;
            moved.write(work.join("moved.ron")).unwrap();
            Ok::<_, Error>(judged(&checked(&survey, &work.join("moved.ron"))?))
        });
        let (of_earlier, of_moved) = (of_earlier.transpose()?, of_moved.transpose()?);
        Ok(SurveyFigures { seed, medians_m, terms, of_truth, points, of_earlier, of_moved, seconds })
    }
}

fn judged(check: &CalibrationCheck) -> (f64, bool, bool) {
    (check.difference.joint.as_ref().map_or(f64::NAN, |joint| joint.p_value), check.moved, check.matters)
}

fn request(survey: &Path, lens: &Path, out: &Path) -> CalibrateRequest {
    CalibrateRequest {
        survey: survey.to_owned(),
        lens_survey: None,
        calibration: Some(lens.to_owned()),
        method: CalibrateMethod::Surfaces,
        options: CalibrationOptions { terms: TermSelection::Auto, ..CalibrationOptions::default() },
        offset: OffsetModel::Constant,
        warm_up: DriftTreatment::Apply,
        defaults: TableDefaults::default(),
        certificate: CertificateRequest::default(),
        out: out.to_owned(),
    }
}

fn checked(survey: &Path, calibration: &Path) -> Result<CalibrationCheck, Error> {
    let (survey, calibration) = (survey.to_owned(), Some(calibration.to_owned()));
    check(&CheckRequest { survey, calibration, level: LEVEL, tolerance_m: TOLERANCE_M }, &Silent)
}

impl SurveyFigures {
    pub const HEAD: &str = "survey   own, mm  true, mm  chi2/dof true  p, earlier    p, moved  calibration, s";
}

impl fmt::Display for SurveyFigures {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [own, truth] = self.medians_m.map(|metres| 1e3 * metres);
        let ratio = self.of_truth.0 / self.of_truth.1 as f64;
        let p = |found: &Option<(f64, bool, bool)>| found.map_or(f64::NAN, |found| found.0);
        let (earlier, moved) = (p(&self.of_earlier), p(&self.of_moved));
        let (seed, seconds) = (self.seed, self.seconds);
        write!(f, "{seed:>6} {own:>9.3} {truth:>9.3} {ratio:>14.2} {earlier:>11.4} {moved:>11.1e} {seconds:>15.1}")
    }
}
