//! What is counted.

use icp_registration::{
    Cloud, Datum, Start, StationRegistration, StationRegistrationOptions, pose_difference, register_stations,
};
use nalgebra::{Isometry3, Matrix6};

use crate::common::{disturbance, pose_error, stations};
use crate::cpu;

/// A simulated survey.
pub struct Survey {
    pub stations: usize,
    pub gross: f64,
    pub seed: u64,
}

impl Survey {
    fn clouds(&self, run: u64) -> (Vec<Cloud>, Vec<Isometry3<f64>>) {
        stations::round(self.stations, self.gross, self.seed + 1000 * run)
    }
}

type Outcome<T> = Result<T, icp_registration::Error>;

fn register(clouds: &[Cloud], start: Start<'_>) -> Outcome<StationRegistration> {
    let options = StationRegistrationOptions::default();
    register_stations(clouds, start, Datum::Station(0), &options, &|_, _| {})
}

/// Largest error of a station in millimetre and degree, the first station laid on its truth.
fn errors(found: &StationRegistration, truth: &[Isometry3<f64>]) -> (f64, f64) {
    let world = truth[0] * found.world_from_station[0].inverse();
    let each = found.world_from_station.iter().zip(truth).map(|(pose, truth)| pose_error(&(world * pose), truth));
    each.fold((0.0, 0.0), |a, b| (f64::max(a.0, b.0), f64::max(a.1, b.1)))
}

pub fn accuracy(name: &str, survey: &Survey, runs: u64) -> Outcome<()> {
    println!("{name}: largest error of a station, run by run");
    for run in 0..runs {
        let (clouds, truth) = survey.clouds(run);
        let approximate: Vec<Isometry3<f64>> =
            truth.iter().enumerate().map(|(k, pose)| pose * disturbance(0.1, 3.0, run * 100 + k as u64)).collect();
        for (label, start) in [
            ("poses 0.1 m, 3 deg off", Start::Poses(&approximate)),
            ("truth", Start::Poses(&truth)),
            ("order", Start::Order),
        ] {
            match register(&clouds, start) {
                Ok(found) => {
                    let (mm, degrees) = errors(&found, &truth);
                    let worst = found.loops.iter().map(|l| l.translation_m * 1e3).fold(0.0, f64::max);
                    println!(
                        "  {label:>22}: {mm:6.2} mm {degrees:.4} deg; {} pairs, {} refused, {} in the adjustment, \
                         {} loops (worst {worst:.1} mm), sigma0 {:.2}, {} rounds{}, undetermined {}",
                        found.pairs.len(),
                        found.refused.len(),
                        found.surfaces.len(),
                        found.loops.len(),
                        found.sigma0.unwrap_or(f64::NAN),
                        found.rounds,
                        if found.settled { "" } else { " (not settled)" },
                        found.undetermined.len(),
                    );
                    if std::env::var("DETAIL").is_ok() {
                        for (k, pose) in found.world_from_station.iter().enumerate() {
                            let world = truth[0] * found.world_from_station[0].inverse();
                            let d = 1e3 * pose_difference(&truth[k], &(world * pose));
                            let c = found.covariance[k];
                            let s = |i: usize| 1e3 * c[(i, i)].sqrt();
                            println!(
                                "      {k}: {:.2} {:.2} {:.2} mm ({:.2} {:.2} {:.2}) {:.3} {:.3} {:.3} mrad ({:.3} {:.3} {:.3})",
                                d[0],
                                d[1],
                                d[2],
                                s(0),
                                s(1),
                                s(2),
                                d[3],
                                d[4],
                                d[5],
                                s(3),
                                s(4),
                                s(5)
                            );
                        }
                        for p in &found.pairs {
                            let t = truth[p.target].inverse() * truth[p.source];
                            let (mm, deg) = pose_error(&p.result.target_from_source, &t);
                            println!(
                                "      pair {}-{}: {mm:.1} mm {deg:.2} deg off, overlap {:.2} rms {:.2} mm, {:?}",
                                p.target,
                                p.source,
                                p.result.overlap,
                                1e3 * p.result.rms_m,
                                p.result.degenerate.len()
                            );
                        }
                        for p in &found.refused {
                            println!("      refused {}-{}: {}", p.target, p.source, p.reason);
                        }
                        for p in &found.surfaces {
                            println!(
                                "      {}-{}: overlap {:.2}, {} contacts, mean {:.2} rms {:.2} mm, {:.2} sigma, out {:.2}",
                                p.target,
                                p.source,
                                p.overlap,
                                p.contacts,
                                1e3 * p.mean_m,
                                1e3 * p.rms_m,
                                p.rms_sigma,
                                p.outliers
                            );
                        }
                    }
                }
                Err(error) => println!("  {label:>22}: {error}"),
            }
        }
    }
    Ok(())
}

pub fn timing(survey: &Survey) -> Outcome<()> {
    let (clouds, truth) = survey.clouds(0);
    let pool = rayon_pool();
    for (label, start) in [("poses", Start::Poses(&truth)), ("order", Start::Order)] {
        let times = (0..3).map(|_| {
            pool.install(|| {
                let before = cpu::seconds();
                let result = register(&clouds, start).map(|found| found.rounds);
                (cpu::seconds() - before, result.is_ok())
            })
        });
        let best = times.fold((f64::INFINITY, true), |a, b| (a.0.min(b.0), a.1 && b.1));
        println!("{} stations from {label}: {:.0} ms CPU, one thread (ok: {})", survey.stations, 1e3 * best.0, best.1);
    }
    Ok(())
}

fn rayon_pool() -> rayon::ThreadPool {
    #[allow(clippy::unwrap_used)] // an example that cannot have one thread has nothing to measure
    rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap()
}

/// Squared errors of the poses against their covariance, over repeated noise.
pub fn sampling(survey: &Survey, runs: u64) -> Outcome<()> {
    let (mut single, mut between, mut covered, mut count) = (Vec::new(), Vec::new(), 0, 0);
    for run in 0..runs {
        let (clouds, truth) = survey.clouds(run);
        let found = register(&clouds, Start::Poses(&truth))?;
        let n = truth.len();
        for station in 1..n {
            let pose = found.relative_pose(0, station)?;
            let nees = normalised(&pose, &(truth[0].inverse() * truth[station]));
            covered += usize::from(nees <= 12.592); // 95 % of chi-squared with 6
            count += 1;
            single.push(nees);
        }
        for station in 0..n {
            let other = (station + 3) % n;
            let pose = found.relative_pose(station, other)?;
            between.push(normalised(&pose, &(truth[station].inverse() * truth[other])));
        }
    }
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    println!(
        "{runs} runs: normalised squared error to the datum {:.2}, between stations {:.2} (6 expected), inside the 95 % \
         ellipsoid {:.1} %",
        mean(&single),
        mean(&between),
        100.0 * covered as f64 / count as f64,
    );
    Ok(())
}

fn normalised(found: &(Isometry3<f64>, Matrix6<f64>), truth: &Isometry3<f64>) -> f64 {
    let d = pose_difference(&found.0, truth);
    found.1.cholesky().map_or(f64::NAN, |factor| d.dot(&factor.solve(&d)))
}
