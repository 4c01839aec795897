//! Every method names what contradicts: typical faults, each put into a network that suits the method.

use self_calibration::{
    CalibrationOptions, CalibrationOutcome, Cause, Error, Method, Network, SightingOptions, TermSelection, Verdict,
    calibrate, calibrate_two_networks, simulate_sightings,
};

use crate::contradictions::faults::{self, Expected};
use crate::support::cases::{Case, cases};
use crate::support::networks::{all_but_long_wave, nominal};

/// A gross range, a station in another unit, a mistaken name.
const FAULTS: [&str; 3] = ["range one interval too long", "ranges of a station in millimetres", "two names exchanged"];

/// Largest change of an estimated parameter by a rejected value, in standard deviations: one of 500 has no more weight.
const MOVED: f64 = 1.0;

fn observed(truth: &Network, seed: u64) -> Network {
    let mut network = simulate_sightings(truth, &SightingOptions { seed, ..SightingOptions::default() }).unwrap();
    nominal(&mut network);
    network
}

/// What is wrong with the answer to a fault.
fn complaint(case: &Case, terms: &TermSelection, fault: &str, seed: u64) -> Option<String> {
    let sound = observed(&case.truth, seed);
    let mut network = sound.clone();
    let fault = faults::all().into_iter().find(|known| known.name == fault).unwrap();
    let expected = (fault.spoil)(&mut network, seed as usize);
    let options =
        CalibrationOptions { method: case.method, datum: case.datum, terms: terms.clone(), ..Default::default() };
    let lens = case.lens.as_ref().map(|lens| observed(lens, seed + 1000));
    let calibrated = |network: &Network| match &lens {
        None => calibrate(network, &options),
        Some(lens) => calibrate_two_networks(lens, network, &options),
    };
    let said = match (calibrated(&network), expected) {
        (Ok(outcome), Expected::Rejected(station, targets)) => {
            // The same without these sightings.
            let mut without = sound.clone();
            without.sightings.retain(|seen| {
                sound.stations[seen.station].name != station || !targets.contains(&sound.targets[seen.target].name)
            });
            let moved = moved(&outcome, &calibrated(&without).unwrap());
            let rejected = |target: &String| {
                let own = outcome.residuals.iter().filter(|own| own.station == station && own.target == *target);
                own.into_iter().any(|own| own.verdict == Verdict::Rejected)
            };
            if moved < MOVED && targets.iter().all(rejected) && outcome.doubts.is_empty() {
                return None;
            }
            format!("{} rejected, moved by {moved:.2}, doubts {:?}", outcome.rejected(), outcome.doubts)
        }
        (Err(Error::Contradiction(found)), Expected::Refused(kinds, station)) => {
            let named = |cause: &Cause| kinds.contains(&cause.kind) && cause.station == station;
            if found.causes.len() == 1 && found.causes.iter().all(named) {
                return None;
            }
            found.to_string()
        }
        // Of two networks, the station is told and its cause is not.
        (Ok(outcome), Expected::Refused(_, Some(station)))
            if case.lens.is_some() && outcome.doubts.iter().any(|doubt| doubt.contains(&station)) =>
        {
            return None;
        }
        (Ok(outcome), _) => format!("accepted with doubts {:?}", outcome.doubts),
        (Err(error), _) => error.to_string(),
    };
    Some(format!("{}, {}: {said}", case.name, fault.name))
}

/// Largest difference of an estimated parameter, in standard deviations; infinite where other terms were chosen.
fn moved(outcome: &CalibrationOutcome, sound: &CalibrationOutcome) -> f64 {
    if outcome.estimated != sound.estimated {
        return f64::INFINITY;
    }
    let off = |name: &String| {
        let [found, known] = [outcome, sound].map(|outcome| outcome.parameter(name).unwrap());
        (found.value - known.value).abs() / known.sigma_prior
    };
    sound.estimated.iter().map(off).fold(0.0, f64::max)
}

#[test]
fn every_method_names_typical_faults() {
    let methods = || cases().into_iter().filter(|case| case.method != Method::Laboratory);
    let listed = TermSelection::List(all_but_long_wave());
    let answers = methods().flat_map(|case| FAULTS.map(|fault| complaint(&case, &listed, fault, 11)));
    let complaints: Vec<String> = answers.flatten().collect();
    assert!(complaints.is_empty(), "{}", complaints.join("\n"));
}

/// Each network with one of the faults.
#[test]
fn chosen_terms_do_not_hide_faults() {
    require_no_hidden_fault(|number| vec![FAULTS[number % FAULTS.len()]]);
}

#[test]
#[ignore = "long: cargo xtask verify tests"]
fn chosen_terms_hide_none_of_all_faults() {
    require_no_hidden_fault(|_| FAULTS.to_vec());
}

/// `faults` says which are put into the network of a number.
fn require_no_hidden_fault(faults: impl Fn(usize) -> Vec<&'static str>) {
    let cases = cases().into_iter().filter(|case| case.method == Method::OneStep);
    let mut complaints = Vec::new();
    for (number, case) in cases.enumerate() {
        let found = faults(number).into_iter().map(|fault| complaint(&case, &TermSelection::Auto, fault, 12));
        complaints.extend(found.flatten());
    }
    assert!(complaints.is_empty(), "{}", complaints.join("\n"));
}
