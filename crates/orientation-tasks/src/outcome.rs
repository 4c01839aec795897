//! Stations as they were found, on the way to the files.

use camera_model::euler_from_pose;
use commands::{Doubt, DoubtKind, words_about};
use pipeline::survey::StationPose;
use range_io::tables::Station;

use crate::summary::{NotOriented, OrientSummary, OrientedStation};

/// Standard deviation of a position, metre, and of an attitude, degree, beyond which a station is hardly placed: a twentieth of
/// the two metres that range cameras mostly see, as for registered stations.
const UNCERTAIN: [f64; 2] = [0.1, 3.0];
/// Doubts about stations with a line of their own; more are counted in one.
const MOST_NAMED: usize = 5;

/// A station that was oriented.
pub(crate) struct Placed {
    pub(crate) name: String,
    pub(crate) timestamp_s: Option<f64>,
    pub(crate) pose: StationPose,
    pub(crate) targets: Option<usize>,
    pub(crate) sigma0: Option<f64>,
}

/// What an orientation found: its figures, and the stations in their order.
pub(crate) struct Outcome {
    pub(crate) summary: OrientSummary,
    pub(crate) stations: Vec<Placed>,
}

impl Placed {
    pub(crate) fn new(name: &str, timestamp_s: Option<f64>, pose: StationPose) -> Self {
        Self { name: name.to_owned(), timestamp_s, pose, targets: None, sigma0: None }
    }

    /// Standard deviations in space of position, metre, and attitude, degree.
    pub(crate) fn sigmas(&self) -> Option<[f64; 2]> {
        let covariance = self.pose.covariance.filter(|covariance| covariance.trace() > 0.0)?;
        let of = |at: usize| covariance.fixed_view::<3, 3>(at, at).trace().max(0.0).sqrt();
        Some([of(0), of(3).to_degrees()])
    }

    fn row(&self) -> OrientedStation {
        let pose = &self.pose.world_from_camera;
        let sigmas = self.sigmas();
        OrientedStation {
            name: self.name.clone(),
            position_m: pose.translation.vector.into(),
            attitude_deg: euler_from_pose(pose).map(f64::to_degrees),
            position_sigma_m: sigmas.map(|sigmas| sigmas[0]),
            attitude_sigma_deg: sigmas.map(|sigmas| sigmas[1]),
            targets: self.targets,
            sigma0: self.sigma0,
        }
    }
}

impl Outcome {
    /// Fills the summary with what stations say of themselves.
    pub(crate) fn finish(&mut self) {
        self.summary.stations = self.stations.iter().map(Placed::row).collect();
        let [most_m, most_deg] = UNCERTAIN;
        let open = |station: &&Placed| station.sigmas().is_some_and(|[m, deg]| !(m <= most_m && deg <= most_deg));
        let open: Vec<&Placed> = self.stations.iter().filter(open).collect();
        let words = |station: &Placed| {
            let [m, deg] = station.sigmas().unwrap_or([f64::NAN; 2]);
            format!("its position is known to {m:.3} m and its attitude to {deg:.2} degrees only")
        };
        if open.len() > MOST_NAMED {
            let last =
                open.last().map_or_else(String::new, |last| format!(" (the last, {}: {})", last.name, words(last)));
            let words = format!("{} stations are hardly placed{last}", open.len());
            self.summary.doubts.push(Doubt::new(DoubtKind::UncertainPose, words));
        } else {
            let doubts =
                open.iter().map(|station| Doubt::about(DoubtKind::UncertainPose, &station.name, words(station)));
            self.summary.doubts.extend(doubts);
        }
        self.summary.doubts.extend(not_oriented(&self.summary.not_oriented));
    }

    /// Rows of `stations.csv`.
    pub(crate) fn rows(&self) -> Vec<Station> {
        let row = |station: &Placed| {
            let sigmas = station.pose.sigmas();
            let positive = |sigmas: [f64; 3]| sigmas.iter().all(|sigma| *sigma > 0.0).then_some(sigmas);
            Station {
                station: station.name.clone(),
                world_from_camera: station.pose.world_from_camera,
                sigma_position_m: sigmas.and_then(|sigmas| positive(sigmas.0)),
                sigma_attitude_rad: sigmas.and_then(|sigmas| positive(sigmas.1)),
                doubt: words_about(&self.summary.doubts, &station.name),
            }
        };
        self.stations.iter().map(row).collect()
    }
}

fn not_oriented(missing: &[NotOriented]) -> Vec<Doubt> {
    let about = |one: &NotOriented| {
        Doubt::about(DoubtKind::UncertainPose, &one.station, format!("it was not oriented: {}", one.reason))
    };
    match missing {
        [first, .., last] if missing.len() > MOST_NAMED => {
            let words = format!(
                "{} stations were not oriented: {}: {}; .. {}: {}",
                missing.len(),
                first.station,
                first.reason,
                last.station,
                last.reason
            );
            vec![Doubt::new(DoubtKind::UncertainPose, words)]
        }
        few => few.iter().map(about).collect(),
    }
}
