//! What is counted.

use multiview_registration::{Datum, Start, StationRegistration, StationRegistrationOptions, register_stations};
use nalgebra::{Isometry3, Matrix6};
use point_cloud::Cloud;
use rigid_pose::pose_difference;

use crate::common::{disturbance, pose_error, stations};
use crate::cpu_clock::cpu_seconds;
use crate::limit::{Plane, cramer_rao};

/// A simulated survey.
pub struct Survey {
    pub stations: usize,
    pub gross: f64,
    pub seed: u64,
    /// Size of the patches, metre; `None`: the default.
    pub patch_m: Option<f64>,
}

impl Survey {
    fn clouds(&self, run: u64) -> (Vec<Cloud>, Vec<Isometry3<f64>>) {
        stations::round(self.stations, self.gross, self.seed + 1000 * run)
    }
}

type Outcome<T> = Result<T, multiview_registration::Error>;

fn register(clouds: &[Cloud], start: Start<'_>, patch_m: Option<f64>) -> Outcome<StationRegistration> {
    let options = StationRegistrationOptions { patch_m, ..StationRegistrationOptions::default() };
    register_stations(clouds, start, Datum::Station(0), &options, &|_, _| {})
}

/// Largest error of a station in millimetre and degree, the first station laid on its truth.
fn errors(found: &StationRegistration, truth: &[Isometry3<f64>]) -> (f64, f64) {
    let world = truth[0] * found.world_from_station[0].inverse();
    let each = found.world_from_station.iter().zip(truth).map(|(pose, truth)| pose_error(&(world * pose), truth));
    each.fold((0.0, 0.0), |a, b| (f64::max(a.0, b.0), f64::max(a.1, b.1)))
}

/// Errors of the positions of all stations but the first, in millimetre.
fn positions(found: &StationRegistration, truth: &[Isometry3<f64>]) -> Vec<f64> {
    let world = truth[0] * found.world_from_station[0].inverse();
    let all = found.world_from_station.iter().zip(truth).skip(1);
    all.map(|(pose, truth)| pose_error(&(world * pose), truth).0).collect()
}

/// Says how far positions are off in all runs, and how that compares with what the noise allows.
fn compare(label: &str, stations: usize, positions: &[f64]) {
    let rms = (positions.iter().map(|mm| mm * mm).sum::<f64>() / positions.len().max(1) as f64).sqrt();
    let ratio = |plane| cramer_rao(stations, plane).map_or(f64::NAN, |limit| rms / limit.rms_mm());
    println!(
        "  {label:>22}: positions {rms:.2} mm rms, {:.2} of the bound for plane cells, {:.2} of that for plane faces",
        ratio(Plane::Cells),
        ratio(Plane::Faces),
    );
}

/// The station whose position has the largest standard deviation, in millimetre.
fn least_known(found: &StationRegistration) -> (usize, f64) {
    let sigma = |c: &Matrix6<f64>| 1e3 * c.fixed_view::<3, 3>(0, 0).trace().sqrt();
    let each = found.covariance.iter().map(sigma).enumerate();
    each.fold((0, 0.0), |worst, next| if next.1 > worst.1 { next } else { worst })
}

pub fn accuracy(name: &str, survey: &Survey, runs: u64) {
    println!("{name}: largest error of a station, run by run");
    let mut off = [const { Vec::new() }; 3];
    let labels = ["poses 0.1 m, 3 deg off", "truth", "order"];
    for run in 0..runs {
        let (clouds, truth) = survey.clouds(run);
        let approximate: Vec<Isometry3<f64>> =
            truth.iter().enumerate().map(|(k, pose)| pose * disturbance(0.1, 3.0, run * 100 + k as u64)).collect();
        let starts = [Start::Poses(&approximate), Start::Poses(&truth), Start::Order];
        for ((label, start), off) in labels.into_iter().zip(starts).zip(&mut off) {
            match register(&clouds, start, survey.patch_m) {
                Ok(found) => {
                    let (mm, degrees) = errors(&found, &truth);
                    off.extend(positions(&found, &truth));
                    let (station, sigma_mm) = least_known(&found);
                    let worst = found.loops.iter().map(|l| l.translation_m * 1e3).fold(0.0, f64::max);
                    println!(
                        "  {label:>22}: {mm:6.2} mm {degrees:.4} deg; {} pairs, {} in the adjustment, \
                         {} loops (worst {worst:.1} mm), sigma0 {:.2}, {} rounds{}, undetermined {}, doubtful {:?} \
                         (contradicted at most {:.1} times as usual); station {station} known to {sigma_mm:.2} mm",
                        found.pairs.len(),
                        found.surfaces.len(),
                        found.loops.len(),
                        found.sigma0.unwrap_or(f64::NAN),
                        found.rounds,
                        if found.settled { "" } else { " (not settled)" },
                        found.undetermined.len(),
                        found.placements.doubtful().collect::<Vec<_>>(),
                        found.placements.stations.iter().filter_map(|station| station.times_usual).fold(0.0, f64::max),
                    );
                }
                Err(error) => println!("  {label:>22}: {error}"),
            }
        }
    }
    labels.into_iter().zip(&off).for_each(|(label, off)| compare(label, survey.stations, off));
}

/// Each run with one station that starts on the opposite side of the room, and stays there.
pub fn misplaced(name: &str, survey: &Survey, runs: u64) -> Outcome<()> {
    let (mut told, mut least, mut most) = (0, f64::INFINITY, 0.0_f64);
    for run in 0..runs {
        let (clouds, truth) = survey.clouds(run);
        let wrong = 1 + run as usize % (survey.stations - 1);
        let mut start = truth.clone();
        start[wrong] = stations::turned(&start[wrong]);
        let found = register(&clouds, Start::Poses(&start), survey.patch_m)?;
        told += u64::from(found.placements.doubtful().eq([wrong]));
        for (station, placed) in found.placements.stations.iter().enumerate() {
            let times = placed.times_usual.unwrap_or(f64::NAN);
            if station == wrong {
                least = least.min(times);
            } else {
                most = most.max(times);
            }
        }
    }
    println!(
        "{name}, one turned by 180 degrees: told from the others in {told} of {runs} runs; contradicted at least \
         {least:.1} times as usual, the others at most {most:.1} times"
    );
    Ok(())
}

pub fn timing(survey: &Survey) {
    let (clouds, truth) = survey.clouds(0);
    let pool = rayon_pool();
    for (label, start) in [("poses", Start::Poses(&truth)), ("order", Start::Order)] {
        let times = (0..3).map(|_| {
            pool.install(|| {
                let before = cpu_seconds();
                let result = register(&clouds, start, survey.patch_m).map(|found| found.rounds);
                (cpu_seconds() - before, result.is_ok())
            })
        });
        let best = times.fold((f64::INFINITY, true), |a, b| (a.0.min(b.0), a.1 && b.1));
        println!("{} stations from {label}: {:.0} ms CPU, one thread (ok: {})", survey.stations, 1e3 * best.0, best.1);
    }
}

fn rayon_pool() -> rayon::ThreadPool {
    #[allow(clippy::unwrap_used)] // an example that cannot have one thread has nothing to measure
    rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap()
}

/// Squared errors of the poses against their covariance, over repeated noise.
pub fn sampling(survey: &Survey, runs: u64) -> Outcome<()> {
    let (mut single, mut between, mut off, mut of_runs, mut covered, mut count) =
        (Vec::new(), Vec::new(), Vec::new(), Vec::new(), 0, 0);
    for run in 0..runs {
        let (clouds, truth) = survey.clouds(run);
        let found = register(&clouds, Start::Poses(&truth), survey.patch_m)?;
        let n = truth.len();
        off.extend(positions(&found, &truth));
        for station in 1..n {
            let pose = found.relative_pose(0, station)?;
            let nees = normalised(&pose, &(truth[0].inverse() * truth[station]));
            covered += usize::from(nees <= 12.592); // 95 % of chi-squared with 6
            count += 1;
            single.push(nees);
        }
        of_runs.push(single[single.len() + 1 - n..].iter().sum::<f64>() / (n - 1) as f64);
        for station in 0..n {
            let other = (station + 3) % n;
            let pose = found.relative_pose(station, other)?;
            between.push(normalised(&pose, &(truth[station].inverse() * truth[other])));
        }
    }
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    // The stations of a run share their datum: only the runs are independent.
    let scatter = of_runs.iter().map(|value| (value - mean(&of_runs)).powi(2)).sum::<f64>();
    let standard_error = (scatter / (runs as f64 - 1.0) / runs as f64).sqrt();
    println!(
        "{runs} runs: normalised squared error to the datum {:.2} ± {standard_error:.2}, between stations {:.2} (6 expected), inside the 95 % \
         ellipsoid {:.1} %",
        mean(&single),
        mean(&between),
        100.0 * covered as f64 / f64::from(count),
    );
    compare("the same runs", survey.stations, &off);
    Ok(())
}

fn normalised(found: &(Isometry3<f64>, Matrix6<f64>), truth: &Isometry3<f64>) -> f64 {
    let d = pose_difference(&found.0, truth);
    found.1.cholesky().map_or(f64::NAN, |factor| d.dot(&factor.solve(&d)))
}
