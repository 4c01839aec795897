//! Do the calibrations of the repository's networks converge, and are their deviations honest, whatever the random numbers?
//!
//! ```text
//! cargo xtask verify networks
//! cargo run --release -p pipeline --example network_seeds [seeds of each network] [name of a network, or `all`] [auto]
//! ```
//! The terms that the networks have, or with `auto` those that the automatic choice takes.
//! Fails where one of 200 seeds is refused, where squared errors over variances are not 0.9 to 1.1 per unknown on average,
//! or where one of them is larger than chi-squared lets one in a thousand runs have.
#![allow(clippy::print_stdout)]

use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};

use calibration_tasks::{
    CalibrateMethod, CalibrateRequest, CalibrationOptions, CalibrationSummary, CertificateRequest, Method,
    NetworkScene, OffsetModel, TableDefaults, TermSelection, calibrate, simulate_network,
};
use nalgebra::{DMatrix, DVector};
use pipeline::{DriftTreatment, Judged, Silent};
use statistics::Distribution;

type Failure = Box<dyn std::error::Error + Send + Sync>;

/// Seeds of each network.
const SEEDS: u64 = 200;
/// Bounds of the mean squared error over variance; 200 seeds of 15 unknowns scatter by 0.03.
const HONEST: [f64; 2] = [0.9, 1.1];
/// Probability that the largest of all is beyond its bound.
const LEVEL: f64 = 1e-3;

const NETWORKS: [(&str, Method); 4] = [
    ("room", Method::OneStep),
    ("room_small", Method::OneStep),
    ("target_field", Method::OneStep),
    ("joint", Method::JointIntegrated),
];

fn main() -> Result<(), Failure> {
    let mut words = std::env::args().skip(1);
    let seeds = words.next().and_then(|seeds| seeds.parse().ok()).unwrap_or(SEEDS);
    let asked = words.next().filter(|name| name != "all");
    let auto = words.next().is_some_and(|word| word == "auto");
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/networks");
    let mut broken = Vec::new();
    println!("| network | calibrated | refused | doubted | error²/variance per unknown: mean | median | largest |");
    println!("|---|---|---|---|---|---|---|");
    for (name, method) in NETWORKS.into_iter().filter(|(name, _)| asked.as_ref().is_none_or(|asked| asked == name)) {
        let figures = of_network(&folder.join(name).with_extension("ron"), method, auto, seeds)?;
        broken.extend(figures.broken(name));
    }
    for words in &broken {
        println!("{words}");
    }
    if broken.is_empty() { Ok(()) } else { Err(format!("{} bars are broken", broken.len()).into()) }
}

/// What the seeds of a network gave.
#[derive(Default)]
struct Figures {
    /// Seed, squared error in variances and its number of unknowns.
    sound: Vec<(u64, f64, usize)>,
    refused: Vec<String>,
    doubted: usize,
}

impl Figures {
    /// Prints the figures and gives what is beyond the bounds.
    fn broken(mut self, name: &str) -> Vec<String> {
        self.sound.sort_by(|a, b| a.1.total_cmp(&b.1));
        let unknowns: usize = self.sound.iter().map(|(.., unknowns)| unknowns).sum();
        let mean = self.sound.iter().map(|(_, square, _)| square).sum::<f64>() / unknowns as f64;
        let per_unknown = |(_, square, unknowns): &(u64, f64, usize)| square / *unknowns as f64;
        let largest = self.sound.last().map_or(f64::NAN, per_unknown);
        let median = self.sound.get(self.sound.len() / 2).map_or(f64::NAN, per_unknown);
        println!(
            "| `{name}` | {} | {} | {} | {mean:.3} | {median:.2} | {largest:.2} |",
            self.sound.len(),
            self.refused.len(),
            self.doubted
        );
        let mut broken: Vec<String> = self.refused.iter().map(|words| format!("{name}: {words}")).collect();
        let beyond = self.sound.iter().filter(|(_, square, unknowns)| {
            let level = LEVEL / self.sound.len() as f64;
            *square > Distribution::ChiSquared { dof: *unknowns as f64 }.critical(level)
        });
        broken.extend(beyond.map(|found| format!("{name}, seed {}: {:.2}", found.0, per_unknown(found))));
        if !(HONEST[0]..=HONEST[1]).contains(&mean) {
            broken.push(format!("{name}: mean {mean:.3}"));
        }
        broken
    }
}

fn of_network(scene: &Path, method: Method, auto: bool, seeds: u64) -> Result<Figures, Failure> {
    let next = AtomicU64::new(0);
    let work = || -> Result<Figures, Failure> {
        let folder = tempfile::tempdir()?;
        let mut own = Figures::default();
        loop {
            let seed = next.fetch_add(1, Ordering::Relaxed);
            if seed >= seeds {
                return Ok(own);
            }
            match of_seed(scene, method, auto, seed, &folder.path().join(seed.to_string())) {
                Ok((square, unknowns, doubted)) => {
                    own.sound.push((seed, square, unknowns));
                    own.doubted += usize::from(doubted);
                }
                Err(error) => own.refused.push(format!("seed {seed}: {error}")),
            }
        }
    };
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let parts = std::thread::scope(|scope| {
        let running: Vec<_> = (0..threads).map(|_| scope.spawn(work)).collect();
        running.into_iter().map(|thread| thread.join().map_err(|_| "a thread panicked")).collect::<Vec<_>>()
    });
    let mut all = Figures::default();
    for part in parts {
        let part = part??;
        all.sound.extend(part.sound);
        all.refused.extend(part.refused);
        all.doubted += part.doubted;
    }
    Ok(all)
}

/// Squared error of the estimated parameters in their variances, their number, and whether there are doubts.
fn of_seed(scene: &Path, method: Method, auto: bool, seed: u64, folder: &Path) -> Result<(f64, usize, bool), Failure> {
    let truth = NetworkScene::read(scene)?;
    let survey = folder.join("survey");
    simulate_network(scene, Some(seed), &survey)?;
    let mut terms: Vec<String> = truth.truth.keys().cloned().collect();
    if !truth.truth.contains_key("c") {
        terms.push("c".to_owned());
    }
    let terms = if auto { TermSelection::Auto } else { TermSelection::List(terms) };
    let request = CalibrateRequest {
        survey,
        lens_survey: None,
        calibration: None,
        method: CalibrateMethod::Network(method),
        options: CalibrationOptions { terms, ..CalibrationOptions::default() },
        offset: OffsetModel::Constant,
        warm_up: DriftTreatment::Leave,
        defaults: TableDefaults::default(),
        certificate: CertificateRequest::default(),
        out: folder.join("out"),
    };
    let summary = calibrate(&request, &Silent)?;
    std::fs::remove_dir_all(folder)?;
    let (square, unknowns) = squared_error(&summary, &truth)?;
    Ok((square, unknowns, !summary.doubts().is_empty()))
}

fn squared_error(summary: &CalibrationSummary, truth: &NetworkScene) -> Result<(f64, usize), Failure> {
    let names = &summary.correlation.names;
    let nominal = |name: &str| if name == "c" { truth.camera.principal_distance_mm } else { 0.0 };
    let known = |name: &str| truth.truth.get(name).copied().unwrap_or_else(|| nominal(name));
    let mut errors = DVector::zeros(names.len());
    for (error, name) in errors.iter_mut().zip(names) {
        let found = summary.parameters.get(name).ok_or_else(|| format!("no parameter `{name}`"))?;
        *error = (found.value - known(name)) / found.sigma_prior;
    }
    let correlation = DMatrix::from_fn(names.len(), names.len(), |i, j| summary.correlation.matrix[i][j]);
    let factor = correlation.cholesky().ok_or("a correlation matrix that is not definite")?;
    Ok((errors.dot(&factor.solve(&errors)), names.len()))
}
