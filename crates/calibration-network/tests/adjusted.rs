//! One adjustment of a network: what it finds, how well, and what it says where it cannot.

use calibration_network::functional_model::{Datum, Setup};
use calibration_network::precision::noncentrality;
use calibration_network::weakness::exact_sightings;
use calibration_network::{Error, Network, SightingOptions, SimulatedStart, Verdict, simulate_sightings};

use crate::support::{nominal, strong, terms, weak};

const TERMS: &str = "xp yp c k1 k2 d0 d4 d5 d6 d7 e1 e2";

fn setup<'a>(network: &'a Network, names: &str) -> Setup<'a> {
    let ranged = vec![true; network.stations.len()];
    Setup::from_network(network, terms(names), ranged, false, Datum::Inner).unwrap()
}

#[test]
fn exact_observations_give_the_truth() {
    let truth = strong();
    let mut observed = exact_sightings(&truth, &SightingOptions::default()).unwrap();
    nominal(&mut observed);
    let setup = setup(&observed, TERMS);
    let found = setup.calibration_found(&setup.solve().unwrap()).unwrap();
    let off = |a: f64, b: f64| (a - b).abs();
    assert!(off(found.camera.interior.principal_distance_mm, truth.camera.interior.principal_distance_mm) < 1e-7);
    assert!(off(found.camera.lens.k1, truth.camera.lens.k1) < 1e-9);
    assert!(off(found.sets[0].model.terms.d0, truth.range_model.terms.d0) < 1e-8);
    assert!(off(found.sets[0].model.terms.e1, truth.range_model.terms.e1) < 1e-8);
}

#[test]
fn start_values_are_found_and_lead_to_the_same_solution() {
    let sightings = |start| SightingOptions { start, ..SightingOptions::default() };
    let vtpv = [SimulatedStart::Truth, SimulatedStart::Absent].map(|start| {
        let mut observed = simulate_sightings(&strong(), &sightings(start)).unwrap();
        nominal(&mut observed);
        setup(&observed, TERMS).solve().unwrap().solution.vtpv()
    });
    assert!((vtpv[0] / vtpv[1] - 1.0).abs() < 1e-8, "{vtpv:?}");
}

/// `eᵀ C⁻¹ e` of twelve terms in 40 networks is χ² of 480 degrees of freedom: its mean per term scatters by 0.065.
#[test]
fn estimates_scatter_as_their_covariance_says() {
    let truth = strong();
    let mut sum: f64 = 0.0;
    for seed in 1..=40 {
        let mut observed = simulate_sightings(&truth, &SightingOptions { seed, ..SightingOptions::default() }).unwrap();
        nominal(&mut observed);
        let setup = setup(&observed, TERMS);
        let solved = setup.solve().unwrap();
        let estimate = setup.estimate_of_terms(&solved).unwrap();
        let found = setup.calibration_found(&solved).unwrap();
        let value = |camera: &calibration_network::camera_model::Camera,
                     model: &calibration_network::error_models::RangeErrorModel,
                     name: &str| {
            let [xp, yp] = camera.interior.principal_point_mm;
            let t = &model.terms;
            match name {
                "xp" => xp,
                "yp" => yp,
                "c" => camera.interior.principal_distance_mm,
                "k1" => camera.lens.k1,
                "k2" => camera.lens.k2,
                "d0" => t.d0,
                "e1" => t.e1,
                "e2" => t.e2,
                wave => t.periodic[wave[1..].parse::<usize>().unwrap() - 2],
            }
        };
        let error = estimate.names.iter().map(|name| {
            value(&found.camera, &found.sets[0].model, name) - value(&truth.camera, &truth.range_model, name)
        });
        let error = calibration_network::nalgebra::DVector::from_iterator(estimate.names.len(), error);
        let inverse = estimate.covariance.clone().cholesky().unwrap().inverse();
        sum += error.dot(&(inverse * &error)) / error.len() as f64;
    }
    let mean: f64 = sum / 40.0;
    assert!((mean - 1.0).abs() < 0.25, "{mean}");
}

#[test]
fn every_observed_value_has_its_figures() {
    let mut observed = simulate_sightings(&strong(), &SightingOptions::default()).unwrap();
    nominal(&mut observed);
    let mut setup = setup(&observed, TERMS);
    setup.excluded.ranges.insert(3);
    let solved = setup.solve().unwrap();
    let qualities = setup.qualities(&solved, noncentrality(None)).unwrap();
    assert_eq!(qualities.len(), 3 * observed.sightings.len());
    let unused: Vec<_> = qualities.iter().filter(|quality| quality.verdict != Verdict::Used).collect();
    assert_eq!(unused.len(), 1);
    assert!(unused[0].verdict == Verdict::Rejected && unused[0].residual.abs() < 6.0 * unused[0].sigma);
    let redundancy: f64 = qualities.iter().map(|quality| quality.redundancy_number).filter(|r| r.is_finite()).sum();
    assert!((redundancy - solved.solution.redundancy() as f64).abs() < 1e-6);
}

#[test]
fn a_weak_network_says_so_with_what_to_add() {
    let strengths = [strong(), weak()].map(|truth| {
        let observed = exact_sightings(&truth, &SightingOptions::default()).unwrap();
        let setup = setup(&observed, "xp yp c d0");
        let solved = setup.solve().unwrap();
        setup.strength(&solved).unwrap().unwrap()
    });
    assert!(strengths[0].inflation < 50.0, "{}", strengths[0].sentence());
    assert!(strengths[1].inflation > 10.0 * strengths[0].inflation, "{}", strengths[1].sentence());
    assert!(matches!(strengths[1].clone().error(), Error::WeakNetwork { advice, .. } if !advice.is_empty()));
}

#[test]
fn image_points_alone_lead_to_the_same_solution_as_the_truth_as_start() {
    let sightings = |start| SightingOptions { start, ..SightingOptions::default() };
    let vtpv = [SimulatedStart::Truth, SimulatedStart::Absent].map(|start| {
        let mut observed = simulate_sightings(&strong(), &sightings(start)).unwrap();
        nominal(&mut observed);
        for seen in &mut observed.sightings {
            seen.range_m = None;
        }
        let ranged = vec![false; observed.stations.len()];
        let names = terms("xp yp c k1 k2");
        let setup = Setup::from_network(&observed, names, ranged, false, Datum::Inner).unwrap();
        setup.solve().unwrap().solution.vtpv()
    });
    assert!((vtpv[0] / vtpv[1] - 1.0).abs() < 1e-6, "{vtpv:?}");
}

#[test]
fn image_points_of_one_place_are_refused_with_the_reason() {
    // Stations that only turn have no base.
    let mut truth = strong();
    let first = truth.stations[0].world_from_camera.unwrap();
    for (number, station) in truth.stations.iter_mut().enumerate() {
        let turn = calibration_network::nalgebra::UnitQuaternion::from_scaled_axis(
            [0.0, 0.02 * number as f64, 0.5 * number as f64].into(),
        );
        station.world_from_camera = Some(first * turn);
    }
    let options = SightingOptions { start: SimulatedStart::Absent, ..SightingOptions::default() };
    let mut observed = simulate_sightings(&truth, &options).unwrap();
    for seen in &mut observed.sightings {
        seen.range_m = None;
    }
    // A target that one station sees is refused before.
    let mut counts = vec![0; observed.targets.len()];
    observed.sightings.iter().for_each(|seen| counts[seen.target] += 1);
    observed.sightings.retain(|seen| counts[seen.target] > 1);
    let ranged = vec![false; observed.stations.len()];
    let error = Setup::from_network(&observed, terms("c"), ranged, false, Datum::Inner).unwrap_err();
    assert!(matches!(&error, Error::NotReachable { reason, .. } if reason.contains("image points alone")), "{error}");
}
