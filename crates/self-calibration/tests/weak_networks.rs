//! Networks that do not determine their parameters are refused with what to add.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod support;

use self_calibration::{
    CalibrationOptions, Error, Method, Network, SightingOptions, TermSelection, calibrate, simulate_sightings,
};
use support::networks::{all_but_long_wave, looking, nominal, normal, small, weak};

fn calibrated(truth: &Network, terms: &[&str], method: Method) -> Result<String, Error> {
    let mut observed = simulate_sightings(truth, &SightingOptions::default()).unwrap();
    nominal(&mut observed);
    let terms = if terms.is_empty() {
        TermSelection::List(all_but_long_wave())
    } else {
        TermSelection::List(terms.iter().map(ToString::to_string).collect())
    };
    calibrate(&observed, &CalibrationOptions { terms, method, ..CalibrationOptions::default() })
        .map(|o| format!("{:?}", o.diagnosis))
}

#[test]
fn experiments() {
    let started = std::time::Instant::now();
    for method in [Method::OneStep, Method::TwoStepDependent] {
        println!("{:?} {:?}", calibrated(&weak(), &[], method).map_err(|e| e.to_string()), started.elapsed());
        println!("{:?} {:?}", calibrated(&weak(), &["d0"], method).map_err(|e| e.to_string()), started.elapsed());
        println!("{:?} {:?}", calibrated(&weak(), &["d0", "c"], method).map_err(|e| e.to_string()), started.elapsed());
    }
    // Not rolled.
    let mut upright = small();
    for (i, s) in upright.stations.iter_mut().enumerate() {
        s.world_from_camera = Some(looking(1.5 + 0.2 * i as f64, 0.0, 0.0, 0.0));
    }
    println!("{:?} {:?}", calibrated(&upright, &[], Method::OneStep).map_err(|e| e.to_string()), started.elapsed());
    let all: Vec<&str> = "xp yp c k1 k2 k3 p1 p2 d0 d2 d3 d4 d5 d6 d7 e1 e2".split(' ').collect();
    println!("{:?} {:?}", calibrated(&normal(), &all, Method::OneStep).map_err(|e| e.to_string()), started.elapsed());
    println!("{:?} {:?}", calibrated(&small(), &all, Method::OneStep).map_err(|e| e.to_string()), started.elapsed());
}
#[test]
fn auto() {
    let started = std::time::Instant::now();
    for (name, truth) in [("small", small()), ("normal", normal()), ("weak", weak())] {
        let mut observed = simulate_sightings(&truth, &SightingOptions::default()).unwrap();
        nominal(&mut observed);
        match calibrate(&observed, &CalibrationOptions::default()) {
            Ok(o) => {
                println!("{name} {:?} {:?}", o.estimated, started.elapsed());
                for d in o.decisions {
                    println!("   {:?} {} {}", d.terms, d.taken, d.reason);
                }
            }
            Err(error) => println!("{name} {error}"),
        }
    }
}
