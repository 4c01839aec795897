//! Gross errors are found, and little else is taken for one.

use crate::support::networks::{all_but_long_wave, nominal, normal, small};
use self_calibration::{
    CalibrationOptions, Component, Method, Network, SightingOptions, SimulatedStart, TermSelection, Verdict, calibrate,
    simulate_sightings,
};

/// Observed networks with and without gross errors, the noise being the same.
fn observed(truth: &Network, seed: u64, share: f64) -> [Network; 2] {
    [share, 0.0].map(|gross_error_share| {
        let mut observed =
            simulate_sightings(truth, &SightingOptions { seed, gross_error_share, ..SightingOptions::default() })
                .unwrap();
        nominal(&mut observed);
        observed
    })
}

/// How many were planted, found, and wrongly suspected, and of how many values.
fn found(truth: &Network, method: Method, level: f64, seed: u64) -> [usize; 4] {
    let [with, without] = observed(truth, seed, 0.01);
    let options = CalibrationOptions {
        method,
        terms: TermSelection::List(all_but_long_wave()),
        rejection_level: Some(level),
        ..CalibrationOptions::default()
    };
    let outcome = calibrate(&with, &options).unwrap();
    let mut counts = [0; 4];
    for (index, (seen, clean)) in with.sightings.iter().zip(&without.sightings).enumerate() {
        let names = (&with.stations[seen.station].name, &with.targets[seen.target].name);
        let rejected = |component| {
            let own = outcome.residuals.iter().find(|q| (&q.station, &q.target) == names && q.component == component);
            own.unwrap().verdict == Verdict::Rejected
        };
        let [pixel, other] = [seen.pixel.unwrap(), clean.pixel.unwrap()];
        let shift = (pixel[0] - other[0]).hypot(pixel[1] - other[1]);
        let range_shift = (seen.range_m.unwrap() - clean.range_m.unwrap()).abs();
        for (planted, rejected) in
            [(shift > 1e-9, rejected(Component::Col)), (range_shift > 1e-9, rejected(Component::Range))]
        {
            counts[0] += usize::from(planted);
            counts[1] += usize::from(planted && rejected);
            counts[2] += usize::from(!planted && rejected);
            counts[3] += 1;
            assert!(!planted || rejected, "sighting {index} of {names:?} is gross and was not found");
        }
    }
    counts
}

#[test]
fn one_in_a_hundred_is_found() {
    let mut sum = [0; 4];
    for seed in 0..3 {
        let counts = found(&normal(), Method::OneStep, 1e-4, seed);
        sum.iter_mut().zip(counts).for_each(|(sum, count)| *sum += count);
    }
    let [planted, found, wrong, all] = sum;
    println!("{found} of {planted} gross errors found, {wrong} of {} good values rejected", all - planted);
    assert!(planted > 60 && found == planted, "{found} of {planted}");
    // At a level of 1e-4 and some 5,000 values a network, one in two networks has a false one.
    assert!(wrong as f64 <= 0.05 * found as f64, "{wrong} false beside {found}");
}

#[test]
fn at_the_usual_level_few_good_values_are_lost() {
    for method in [Method::OneStep, Method::TwoStepDependent] {
        let [.., wrong, all] = found(&small(), method, 1e-3, 12);
        // One in a thousand values, two of three to an image point; 784 image points and ranges.
        assert!(wrong as f64 <= 0.01 * all as f64, "{method:?}: {wrong} of {all}");
    }
}

#[test]
fn start_values_are_found_in_spite_of_gross_errors() {
    let truth = small();
    let start = SimulatedStart::Absent;
    let options = SightingOptions { gross_error_share: 0.03, start, sigma_range_m: 0.02, ..SightingOptions::default() };
    let mut observed = simulate_sightings(&truth, &options).unwrap();
    nominal(&mut observed);
    let terms = TermSelection::List(all_but_long_wave());
    let outcome = calibrate(&observed, &CalibrationOptions { terms, ..CalibrationOptions::default() }).unwrap();
    let d0 = outcome.parameter("d0").unwrap();
    assert!((d0.value - truth.range_model.terms.d0).abs() < 4.0 * d0.sigma_prior, "{} {}", d0.value, d0.sigma_prior);
    assert!(outcome.rejected() > 0);
}
