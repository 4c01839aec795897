//! Experiment.
#![allow(clippy::print_stdout, clippy::unwrap_used, missing_docs)]
use std::path::{Path, PathBuf};
use calibration_tasks::pipeline::{Silent, SimulateSource, simulate};
use calibration_tasks::{CheckRequest, check};
use std::collections::BTreeMap;

fn main() {
    let mut words = std::env::args().skip(1);
    let first: u64 = words.next().unwrap().parse().unwrap();
    let last: u64 = words.next().unwrap().parse().unwrap();
    let scene = PathBuf::from(words.next().unwrap());
    let folder = tempfile::tempdir().unwrap();
    let mut names: Vec<String> = Vec::new();
    let mut all: BTreeMap<String, Vec<[f64; 2]>> = BTreeMap::new();
    let mut chi = Vec::new();
    for seed in first..=last {
        let survey = folder.path().join("survey");
        let source = SimulateSource { scene: scene.display().to_string(), seed, approximate_position_sigma_m: 0.05, approximate_attitude_sigma_deg: 2.0, gross_error_share: 0.0 };
        simulate(&source, Path::new(""), &survey, &Silent).unwrap();
        let truth = survey.join("truth/calibration.ron");
        let found = check(&CheckRequest { survey: survey.clone(), calibration: Some(truth), level: 0.05, tolerance_m: 1e-3 }, &Silent);
        let found = match found { Ok(f) => f, Err(e) => { println!("{seed} {e}"); continue } };
        let joint = found.difference.joint.as_ref().unwrap();
        chi.push(joint.chi_squared / joint.degrees as f64);
        if seed == first { println!("{:?} {:?}", found.not_checked, found.difference.not_tested); }
        for line in found.difference.parameters.iter().filter(|l| l.sigma > 0.0) {
            if !names.contains(&line.name) { names.push(line.name.clone()); }
            all.entry(line.name.clone()).or_default().push([line.difference, line.sigma]);
        }
        let at: Vec<String> = found.difference.corrections.iter().map(|c| format!("rms {:.3} largest {:.2} at {:.2} m {:?}", 1e3*c.rms_m, 1e3*c.largest.difference_m, c.largest.range_m, c.largest.amplitude)).collect();
        println!("{seed} {:.2} dof {} rms {:?} {:?}", chi.last().unwrap(), joint.degrees, found.change_rms_m, at);
        std::fs::remove_dir_all(&survey).unwrap();
    }
    println!("{:>6} {:>11} {:>11} {:>11} {:>7} {:>7}", "term", "mean err", "scatter", "stated", "z mean", "z2");
    for name in &names {
        let v = &all[name];
        let n = v.len() as f64;
        let mean = v.iter().map(|x| x[0]).sum::<f64>() / n;
        let sd = (v.iter().map(|x| (x[0] - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt();
        let stated = (v.iter().map(|x| x[1] * x[1]).sum::<f64>() / n).sqrt();
        let z: f64 = v.iter().map(|x| x[0] / x[1]).sum::<f64>() / n;
        let z2: f64 = v.iter().map(|x| (x[0] / x[1]).powi(2)).sum::<f64>() / n;
        println!("{name:>6} {mean:>11.3e} {sd:>11.3e} {stated:>11.3e} {z:>7.2} {z2:>7.2}  ({} of)", v.len());
    }
    println!("chi2/dof mean {:.3} +- {:.3}", chi.iter().sum::<f64>() / chi.len() as f64, { let m = chi.iter().sum::<f64>() / chi.len() as f64; (chi.iter().map(|c| (c - m).powi(2)).sum::<f64>() / (chi.len() as f64 - 1.0) / chi.len() as f64).sqrt() });
}
