//! Planned networks.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod support;

use self_calibration::{PlanOptions, TermSelection, plan};
use support::networks::{all_but_long_wave, normal, small, weak};

#[test]
fn strengths() {
    let mut all = all_but_long_wave();
    for (name, network) in [("small", small()), ("normal", normal()), ("weak", weak())] {
        for terms in [all_but_long_wave(), {
            let mut a = all.clone();
            a.extend(["d2".into(), "d3".into()]);
            a
        }] {
            let options = PlanOptions {
                terms: TermSelection::List(terms),
                candidates: self_calibration::CandidateGrid { distances_m: vec![2.0], ..Default::default() },
                ..PlanOptions::default()
            };
            let t = std::time::Instant::now();
            match plan(&network, &options) {
                Ok(outcome) => {
                    println!("{name}: {:?}", outcome.diagnosis);
                    println!(
                        "{:?} {:?}",
                        outcome.point_sigma_m,
                        outcome.parameters.iter().map(|p| (p.name.as_str(), p.sigma_prior)).collect::<Vec<_>>()
                    );
                    println!("{:?} {:?}", outcome.candidates.first().map(|c| (&c.description, c.score)), t.elapsed());
                }
                Err(error) => println!("{name}: {error}"),
            }
        }
    }
    all.clear();
}
