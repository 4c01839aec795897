//! Whether the calibration of a broken network names what is wrong with it.

use nalgebra::{DVector, Isometry3, Point3, Vector6};
use rigid_pose::absolute_orientation;
use self_calibration::{
    CalibrationOptions, CalibrationOutcome, Cause, Component, Error, Network, NetworkDatum, NetworkError,
    TermSelection, Verdict, calibrate,
};
use statistics::Distribution;

use super::faults::{Expected, Fault};
use super::networks::Sound;

/// How a calibration answered.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Answer {
    /// As it should: named, and no number where there is none to trust.
    Right,
    /// Refused or doubted, but for another reason.
    NotNamed,
    /// Given without a word, though not named; its numbers are right.
    Harmless,
    /// A wrong number without a word.
    Silent,
}

/// Terms and poses farther from the truth than their covariance lets one of so many sound ones be are wrong.
const WRONG: f64 = 1e-7;

const TERMS: &str = "xp yp c k1 k2 p1 p2 d0 d4 d5 d6 d7 e1 e2";

pub fn options(sound: &Sound) -> CalibrationOptions {
    options_without(sound, &[])
}

fn options_without(sound: &Sound, without: &[&str]) -> CalibrationOptions {
    let terms = TERMS.split(' ').filter(|name| !without.contains(name)).map(str::to_owned).collect();
    let terms = if sound.auto { TermSelection::Auto } else { TermSelection::List(terms) };
    CalibrationOptions { terms, datum: sound.datum, method: sound.method, ..CalibrationOptions::default() }
}

/// What a calibration makes of a fault, with its words.
pub fn judge(sound: &Sound, fault: &Fault, seed: u64) -> (Answer, String) {
    let mut network = sound.observed(seed);
    let expected = (fault.spoil)(&mut network, seed as usize);
    let (answer, words) = match calibrate(&network, &options_without(sound, fault.without)) {
        Ok(outcome) => of_outcome(&outcome, sound, &expected),
        Err(error) => {
            let right = is_right_refusal(&error, &expected);
            (if right { Answer::Right } else { Answer::NotNamed }, error.to_string())
        }
    };
    (answer, format!("{words}\n        expected {expected:?}"))
}

fn of_outcome(outcome: &CalibrationOutcome, sound: &Sound, expected: &Expected) -> (Answer, String) {
    let off = misfit(outcome, sound);
    let told = !outcome.doubts.is_empty();
    let named = match expected {
        Expected::Rejected(station, targets) => {
            !told && targets.iter().all(|target| is_rejected(outcome, station, target))
        }
        Expected::Unharmed => !told,
        Expected::Told(kinds, names) => told && is_told(&outcome.causes, kinds, names),
        Expected::Control(names) => rejected_control(outcome) == sorted(names) || has_control(&outcome.causes, names),
        _ => false,
    };
    let best = outcome.unestimated.iter().min_by(|a, b| a.p.total_cmp(&b.p));
    let words = format!(
        "accepted, {} rejected (of control {:?}), {off:.2} of what is wrong, least p {best:?}: {:?}",
        outcome.rejected(),
        rejected_control(outcome),
        outcome.doubts
    );
    let answer = match (off > 1.0, named) {
        (true, _) if !told => Answer::Silent,
        (_, true) => Answer::Right,
        _ if told => Answer::NotNamed,
        _ => Answer::Harmless,
    };
    (answer, words)
}

fn is_right_refusal(error: &Error, expected: &Expected) -> bool {
    match (error, expected) {
        (Error::Network(NetworkError::OutsideImage(_)), Expected::OutsideImage) => true,
        (Error::Contradiction(found), Expected::Refused(kinds, station)) => {
            found.causes.len() == 1
                && found.causes.iter().all(|cause| kinds.contains(&cause.kind) && cause.station == *station)
        }
        (Error::Contradiction(found), Expected::Told(kinds, names)) => is_told(&found.causes, kinds, names),
        (Error::Contradiction(found), Expected::Control(names)) => has_control(&found.causes, names),
        (Error::Contradiction(found), Expected::Unexplained) => found.causes.is_empty() && found.worst.is_some(),
        _ => false,
    }
}

fn is_told(causes: &[Cause], kinds: &[self_calibration::CauseKind], names: &[String]) -> bool {
    causes.iter().any(|cause| kinds.contains(&cause.kind) && names.iter().all(|name| cause.names.contains(name)))
}

/// Whether the causes have these names, and no others.
fn has_control(causes: &[Cause], names: &[String]) -> bool {
    let told: Vec<String> = causes.iter().flat_map(|cause| cause.names.iter().cloned()).collect();
    sorted(&told) == sorted(names)
}

fn sorted(names: &[String]) -> Vec<String> {
    let mut names = names.to_vec();
    names.sort();
    names.dedup();
    names
}

/// Targets and stations whose given coordinates were rejected.
fn rejected_control(outcome: &CalibrationOutcome) -> Vec<String> {
    let own = outcome.residuals.iter().filter(|quality| quality.component == Component::Control);
    let rejected = own.filter(|quality| quality.verdict == Verdict::Rejected);
    let names = rejected.map(|own| if own.target.is_empty() { &own.station } else { &own.target }.clone());
    sorted(&names.collect::<Vec<_>>())
}

fn is_rejected(outcome: &CalibrationOutcome, station: &str, target: &str) -> bool {
    let own = outcome.residuals.iter().filter(|quality| quality.station == station && quality.target == target);
    own.into_iter().any(|quality| quality.verdict == Verdict::Rejected)
}

/// How far terms and poses are from the truth: squared deviation in their covariance, over what it may be.
fn misfit(outcome: &CalibrationOutcome, sound: &Sound) -> f64 {
    let limit = |unknowns: usize| Distribution::ChiSquared { dof: unknowns as f64 }.upper_quantile(WRONG);
    let stations = of_poses(outcome, sound).into_iter().fold(0.0, f64::max) / limit(6);
    stations.max(of_terms(outcome, &sound.truth) / limit(outcome.estimated.len()))
}

fn of_terms(outcome: &CalibrationOutcome, truth: &Network) -> f64 {
    let interior = truth.camera.interior;
    let terms = truth.range_model.terms;
    let lens = truth.camera.lens;
    let value = |name: &str| match name {
        "xp" => interior.principal_point_mm[0],
        "yp" => interior.principal_point_mm[1],
        "c" => interior.principal_distance_mm,
        "k1" => lens.k1,
        "k2" => lens.k2,
        "p1" => lens.p1,
        "p2" => lens.p2,
        "d0" => terms.d0,
        "e1" => terms.e1,
        "e2" => terms.e2,
        // What the camera does not have.
        "k3" | "b1" | "b2" | "scale" => 0.0,
        wave => terms.periodic[wave[1..].parse::<usize>().unwrap() - 2],
    };
    let error = |name: &String| outcome.parameter(name).map_or(0.0, |found| found.value - value(name));
    let errors = DVector::from_iterator(outcome.estimated.len(), outcome.estimated.iter().map(error));
    outcome.covariance.clone().cholesky().map_or(f64::INFINITY, |factor| errors.dot(&factor.solve(&errors)))
}

/// The same of each pose; that of a free network after it has been laid on the truth.
fn of_poses(outcome: &CalibrationOutcome, sound: &Sound) -> Vec<f64> {
    let truth = &sound.truth;
    let place = |name: &str| truth.targets.iter().find(|target| target.name == name).and_then(|target| target.point);
    let pairs = outcome.targets.iter().filter_map(|found| Some((found.point, place(&found.name)?)));
    let (found, known): (Vec<Point3<f64>>, Vec<Point3<f64>>) = pairs.unzip();
    let free = sound.datum == NetworkDatum::Free;
    let laid = absolute_orientation(&found, &known, None).map(|orientation| orientation.target_from_source);
    let truth_from_found = if free { laid.unwrap_or_default() } else { Isometry3::identity() };
    let off = |found: &self_calibration::AdjustedStation| {
        let known = truth.stations.iter().find(|station| station.name == found.name)?.world_from_camera?;
        let pose = truth_from_found * found.world_from_camera;
        let shift = pose.translation.vector - known.translation.vector;
        let turn = (known.rotation.inverse() * pose.rotation).scaled_axis();
        let step = Vector6::new(shift.x, shift.y, shift.z, turn.x, turn.y, turn.z);
        found.covariance.cholesky().map(|factor| step.dot(&factor.solve(&step)))
    };
    outcome.stations.iter().filter_map(off).collect()
}

/// Whether a sound network keeps its verdict: a result, true within its deviations, without a doubt.
pub fn is_kept(sound: &Sound, seed: u64) -> Result<(), String> {
    match calibrate(&sound.observed(seed), &options(sound)) {
        Ok(outcome) if !outcome.doubts.is_empty() => Err(format!("{:?}", outcome.doubts)),
        Ok(outcome) => is_true(&outcome, sound),
        Err(error) => Err(error.to_string()),
    }
}

/// Whether a result is true within its deviations.
pub fn is_true(outcome: &CalibrationOutcome, sound: &Sound) -> Result<(), String> {
    let off = misfit(outcome, sound);
    if off > 1.0 { Err(format!("off by {off:.2} of what is wrong")) } else { Ok(()) }
}
