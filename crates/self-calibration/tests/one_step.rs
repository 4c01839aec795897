//! The one-step method.

use crate::support::networks::{all_but_long_wave, nominal, normal, small};
use self_calibration::{
    CalibrationOptions, Method, SightingOptions, SimulatedStart, TermSelection, calibrate, simulate_sightings,
};

fn options() -> CalibrationOptions {
    CalibrationOptions {
        method: Method::OneStep,
        terms: TermSelection::List(all_but_long_wave()),
        ..CalibrationOptions::default()
    }
}

#[test]
fn without_noise_the_truth_comes_back() {
    let truth = small();
    let quiet = SightingOptions { sigma_pixel: 1e-5, sigma_range_m: 1e-6, ..SightingOptions::default() };
    for start in [SimulatedStart::Disturbed { position_m: 0.02, attitude_rad: 0.01 }, SimulatedStart::Absent] {
        let mut observed = simulate_sightings(&truth, &SightingOptions { start, ..quiet.clone() }).unwrap();
        nominal(&mut observed);
        let outcome = calibrate(&observed, &options()).unwrap();
        // Noise of 1e-5 pixel and 1e-6 m, enlarged by correlations.
        let c = outcome.camera.interior.principal_distance_mm;
        assert!((c - truth.camera.interior.principal_distance_mm).abs() < 1e-4, "{c}");
        let [found, true_terms] = [&outcome.range_models[0].1, &truth.range_model].map(|m| m.terms.to_array());
        for (found, truth) in found.iter().zip(true_terms) {
            assert!((found - truth).abs() < 1e-5, "{found} {truth}");
        }
        assert_eq!(outcome.datum_defect, 6);
    }
}

#[test]
fn the_normal_network_is_solved() {
    let mut observed = simulate_sightings(&normal(), &SightingOptions::default()).unwrap();
    nominal(&mut observed);
    let outcome = calibrate(&observed, &options()).unwrap();
    // Prior deviations are those of the simulation: sigma0 is 1 within four of its deviations, 1 / √(2 · 4500).
    assert!((outcome.sigma0.unwrap() - 1.0).abs() < 0.045, "{:?}", outcome.sigma0);
    assert_eq!(outcome.redundancy, outcome.observations as i64 + 6 - outcome.unknowns as i64);
    let d0 = outcome.parameter("d0").unwrap();
    assert!(
        (d0.value - 0.024).abs() < 4.0 * d0.sigma_prior && d0.sigma_prior < 0.004,
        "{} {}",
        d0.value,
        d0.sigma_prior
    );
    let sum: f64 = outcome.groups.iter().map(|group| group.redundancy).sum();
    assert!((sum - outcome.redundancy as f64).abs() < 1e-6, "{sum}");
}

#[test]
fn classes_of_amplitude_show_where_the_stated_deviations_are_wrong() {
    let sightings =
        SightingOptions { amplitude_at_1_m: Some(2000.0), reflectance_span: [0.1, 10.0], ..SightingOptions::default() };
    let mut observed = simulate_sightings(&normal(), &sightings).unwrap();
    nominal(&mut observed);
    let mut amplitudes: Vec<f64> = observed.sightings.iter().map(|seen| seen.amplitude.unwrap()).collect();
    amplitudes.sort_by(f64::total_cmp);
    let quarter = amplitudes[amplitudes.len() / 4];
    for seen in observed.sightings.iter_mut().filter(|seen| seen.amplitude.unwrap() < quarter) {
        seen.sigma_range_m *= 0.5;
    }
    let outcome = calibrate(&observed, &CalibrationOptions { rejection_level: None, ..options() }).unwrap();
    let classes = outcome.amplitude_classes();
    let range = outcome.groups.iter().find(|group| group.name == "range").unwrap();
    assert_eq!(classes.iter().map(|class| class.observations).sum::<usize>(), range.observations);
    // Some 400 ranges a class: sigma0 scatters by 1 / √800 = 0.035 of itself.
    let [dark, others @ ..] = classes.as_slice() else { panic!("no classes") };
    assert!((dark.sigma0.unwrap() - 2.0).abs() < 0.3, "{classes:?}");
    assert!(others.len() == 3 && others.iter().all(|class| (class.sigma0.unwrap() - 1.0).abs() < 0.15), "{classes:?}");
}

#[test]
fn a_known_drift_of_each_station_is_taken_off() {
    let mut truth = small();
    for (index, station) in truth.stations.iter_mut().enumerate() {
        station.drift_m = -0.03 * (-0.2 * index as f64).exp();
    }
    let quiet = SightingOptions { sigma_pixel: 1e-5, sigma_range_m: 1e-6, ..SightingOptions::default() };
    let mut observed = simulate_sightings(&truth, &quiet).unwrap();
    nominal(&mut observed);
    for method in [Method::OneStep, Method::TwoStepDependent] {
        let outcome = calibrate(&observed, &CalibrationOptions { method, ..options() }).unwrap();
        for (found, truth) in outcome.range_models[0].1.terms.to_array().iter().zip(truth.range_model.terms.to_array())
        {
            // As without a drift: noise of 1e-5 pixel and 1e-6 m, enlarged by correlations.
            assert!((found - truth).abs() < 1e-5, "{method:?}: {found} {truth}");
        }
    }
}
