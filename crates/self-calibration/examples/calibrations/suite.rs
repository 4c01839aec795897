//! Whether the calibration of a broken network names what is wrong with it.

use self_calibration::{CalibrationOptions, CalibrationOutcome, Error, Network, TermSelection, Verdict, calibrate};

use super::faults::{Expected, Fault};
use super::networks::Sound;

/// How a calibration answered.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Answer {
    /// As it should: named, and no number where there is none to trust.
    Right,
    /// Refused or doubted, but for another reason.
    NotNamed,
    /// A wrong number without a word.
    Silent,
}

/// Deviations from the truth, squared and in variances, summed over as many parameters as there are: beyond this the
/// result is wrong. Chi-squared of 14 degrees of freedom exceeds it once in a million.
const WRONG: f64 = 57.0;

pub fn options(sound: &Sound) -> CalibrationOptions {
    let terms = "xp yp c k1 k2 p1 p2 d0 d4 d5 d6 d7 e1 e2".split(' ').map(str::to_owned).collect();
    CalibrationOptions { terms: TermSelection::List(terms), datum: sound.datum, ..CalibrationOptions::default() }
}

/// What a calibration makes of a fault, with its words where they are not right.
pub fn judge(sound: &Sound, fault: &Fault, seed: u64) -> (Answer, String) {
    let mut network = sound.observed(seed);
    let expected = (fault.spoil)(&mut network, seed as usize);
    judged(&network, sound, &expected)
}

fn judged(network: &Network, sound: &Sound, expected: &Expected) -> (Answer, String) {
    match calibrate(network, &options(sound)) {
        Ok(outcome) => {
            let wrong = misfit(&outcome, &sound.truth) > WRONG;
            let told = !outcome.doubts.is_empty();
            let named = match expected {
                Expected::Rejected(station, targets) => {
                    targets.iter().all(|target| is_rejected(&outcome, station, target))
                }
                Expected::Unharmed => true,
                _ => false,
            };
            let said = format!(
                "accepted, {} rejected, {:.0}: {:?}",
                outcome.rejected(),
                misfit(&outcome, &sound.truth),
                outcome.doubts
            );
            match (wrong, named && !told) {
                (true, _) if !told => (Answer::Silent, said),
                (false, true) => (Answer::Right, said),
                _ => (Answer::NotNamed, said),
            }
        }
        Err(Error::OutsideImage(_)) if *expected == Expected::OutsideImage => (Answer::Right, String::new()),
        Err(Error::Contradiction(found)) => {
            let named = match expected {
                Expected::Refused(kinds, station) => {
                    found.causes.len() == 1
                        && found.causes.iter().all(|cause| kinds.contains(&cause.kind) && cause.station == *station)
                }
                Expected::Unexplained => found.causes.is_empty() && found.worst.is_some(),
                _ => false,
            };
            (if named { Answer::Right } else { Answer::NotNamed }, found.to_string())
        }
        Err(error) => (Answer::NotNamed, error.to_string()),
    }
}

fn is_rejected(outcome: &CalibrationOutcome, station: &str, target: &str) -> bool {
    let own = outcome.residuals.iter().filter(|quality| quality.station == station && quality.target == target);
    own.into_iter().any(|quality| quality.verdict == Verdict::Rejected)
}

/// Squared deviation of the estimated parameters from the truth, in their covariance.
fn misfit(outcome: &CalibrationOutcome, truth: &Network) -> f64 {
    let interior = truth.camera.interior;
    let terms = truth.range_model.terms;
    let lens = truth.camera.lens;
    let value = |name: &String| match name.as_str() {
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
        wave => terms.periodic[wave[1..].parse::<usize>().unwrap() - 2],
    };
    let error = |name: &String| outcome.parameter(name).unwrap().value - value(name);
    let errors = nalgebra::DVector::from_iterator(outcome.estimated.len(), outcome.estimated.iter().map(error));
    outcome.covariance.clone().cholesky().map_or(f64::INFINITY, |factor| errors.dot(&factor.solve(&errors)))
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
    let off = misfit(outcome, &sound.truth);
    if off > WRONG { Err(format!("off by {off}")) } else { Ok(()) }
}
