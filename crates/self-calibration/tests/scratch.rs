#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]
mod support;
use self_calibration::*;
use support::networks::*;
#[test]
fn all_terms() {
    let mut observed = simulate_sightings(&small(), &SightingOptions::default()).unwrap();
    nominal(&mut observed);
    let all = "xp yp c k1 k2 k3 p1 p2 d0 d2 d3 d4 d5 d6 d7 e1 e2".split(' ').map(str::to_owned).collect();
    for rejection_level in [None, Some(0.001)] {
    let o = calibrate(&observed, &CalibrationOptions { rejection_level, terms: TermSelection::List(Clone::clone(&all)), ..CalibrationOptions::default() });
    match o { Ok(o) => {
    for p in &o.parameters { println!("{} {} +- {}", p.name, p.value, p.sigma_prior); }
    println!("{} {:?} it {} rejected {} {:?}", o.vtpv, o.sigma0, o.trace.len(), o.rejected(), o.diagnosis); }
    Err(e) => println!("{e}"), }
    }
}
