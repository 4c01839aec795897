//! Known targets and stations that the observations place elsewhere.

use calibration_network::functional_model::CAUCHY;
use camera_model::{euler_from_pose, pose_from_euler};
use nalgebra::{Isometry3, Matrix3, Matrix6, Vector3, Vector6};

use super::fit::Fit;
use crate::findings::contradiction::{Cause, CauseKind};

/// Deviations beyond which a known place contradicts: of a million sound ones less than one is so far off.
const CONTRADICTS: f64 = 6.0;
/// Share of the distance between two places that what was found may be off by, to be the other one.
const NEAR: f64 = 0.1;
/// Share of the known places beyond which what is wrong is not one of them.
const FEW: f64 = 1.0 / 3.0;
/// Attitudes nearer than this are one, radian.
const SAME_ATTITUDE: f64 = 0.1;

/// A place as given and as found.
struct Known<'n> {
    name: &'n str,
    what: &'static str,
    given: Vector3<f64>,
    found: Vector3<f64>,
    /// Turn from the given to the found attitude, radian.
    turn: f64,
    /// Distance in standard deviations.
    off: f64,
}

impl Fit<'_> {
    /// Known places that do not agree with what the observations say, where these agree with each other.
    pub(super) fn misplaced(&self) -> Vec<Cause> {
        let known = self.known();
        let (wrong, right): (Vec<&Known<'_>>, Vec<&Known<'_>>) =
            known.iter().partition(|known| known.off > CONTRADICTS);
        if wrong.is_empty() || !self.is_consistent() {
            return Vec::new();
        }
        if let Some(cause) = self.in_radians(&wrong, &right) {
            return vec![cause];
        }
        if wrong.len() as f64 > FEW * known.len() as f64 {
            return Vec::new();
        }
        let mut out = Vec::new();
        let mut told = vec![false; wrong.len()];
        for (index, one) in wrong.iter().enumerate() {
            if told[index] {
                continue;
            }
            let partner = (index + 1..wrong.len()).find(|&other| !told[other] && one.is_exchanged_with(wrong[other]));
            if let Some(other) = partner {
                told[other] = true;
                out.push(one.exchanged(wrong[other]));
            } else {
                out.push(one.moved());
            }
        }
        out
    }

    /// Negative logarithm of the likelihood of the known places, as that of sightings.
    pub(super) fn implausibility_of_places(&self) -> f64 {
        self.known().iter().map(Known::log_odds).sum()
    }

    fn known(&self) -> Vec<Known<'_>> {
        let start = &self.setup.start;
        let targets = self.setup.network.targets.iter().zip(&start.targets).filter_map(|(target, found)| {
            let (given, found) = (target.point?.coords, (*found)?.coords);
            let off = in_deviations(&target.covariance?, &(found - given))?;
            Some(Known { name: &target.name, what: "target", given, found, turn: 0.0, off })
        });
        let stations = self.setup.network.stations.iter().zip(&start.stations).filter_map(|(station, found)| {
            let pose = station.world_from_camera?;
            let (given, place) = (pose.translation.vector, found.translation.vector);
            let (shift, turn) = (place - given, (pose.rotation.inverse() * found.rotation).scaled_axis());
            let step = Vector6::new(shift.x, shift.y, shift.z, turn.x, turn.y, turn.z);
            let off = of_step(&station.covariance?, &step)?;
            Some(Known { name: &station.name, what: "station", given, found: place, turn: turn.norm(), off })
        });
        targets.chain(stations).collect()
    }

    /// Attitudes of known stations that fit as radians.
    fn in_radians(&self, wrong: &[&Known<'_>], right: &[&Known<'_>]) -> Option<Cause> {
        let is_station = |known: &&&Known<'_>| known.what == "station";
        if wrong.iter().filter(is_station).count() <= right.iter().filter(is_station).count() {
            return None;
        }
        let stations = self.setup.network.stations.iter().zip(&self.setup.start.stations);
        let mut agree = stations.filter_map(|(station, found)| {
            let given: Isometry3<f64> = station.covariance.and(station.world_from_camera)?;
            let attitude = euler_from_pose(&given).map(f64::to_degrees);
            let read = pose_from_euler(given.translation.vector, attitude);
            Some(read.rotation.angle_to(&found.rotation) < SAME_ATTITUDE)
        });
        let agree = agree.by_ref().filter(|agrees| *agrees).count();
        (2 * agree > wrong.iter().filter(is_station).count()).then(|| Cause {
            kind: CauseKind::AngleUnit,
            station: None,
            names: Vec::new(),
            words: "the known stations fit if their attitudes are radians instead of degrees".to_owned(),
            remedy: "mend omega_deg, phi_deg and kappa_deg of stations.csv",
            log_odds: wrong.iter().map(|known| known.log_odds()).sum(),
        })
    }
}

impl Known<'_> {
    /// Errors have long tails.
    fn log_odds(&self) -> f64 {
        0.5 * CAUCHY * CAUCHY * (self.off / CAUCHY).powi(2).ln_1p()
    }

    fn is_exchanged_with(&self, other: &Self) -> bool {
        let limit = NEAR * (self.given - other.given).norm();
        let near = |a: &Vector3<f64>, b: &Vector3<f64>| (a - b).norm() < limit;
        self.what == other.what && near(&self.found, &other.given) && near(&other.found, &self.given)
    }

    fn exchanged(&self, other: &Self) -> Cause {
        Cause {
            kind: CauseKind::PlacesExchanged,
            station: None,
            names: vec![self.name.to_owned(), other.name.to_owned()],
            words: format!(
                "the known {0}s `{1}` and `{2}` fit if each is where the other is said to be: their names are exchanged",
                self.what, self.name, other.name
            ),
            remedy: self.remedy(),
            log_odds: self.log_odds() + other.log_odds(),
        }
    }

    fn moved(&self) -> Cause {
        let [x, y, z]: [f64; 3] = (1e3 * (self.found - self.given)).into();
        let turn =
            if self.turn > 0.0 { format!(", turned by {:.2} degrees", self.turn.to_degrees()) } else { String::new() };
        Cause {
            kind: CauseKind::Misplaced,
            station: None,
            names: vec![self.name.to_owned()],
            words: format!(
                "all observations of the known {} `{}` fit if it is {x:.1}, {y:.1}, {z:.1} mm in x, y, z from where it is \
                 said to be{turn}: {:.0} times its deviations",
                self.what, self.name, self.off
            ),
            remedy: self.remedy(),
            log_odds: self.log_odds(),
        }
    }

    fn remedy(&self) -> &'static str {
        if self.what == "target" {
            "mend its row of targets.csv, or take its deviations away"
        } else {
            "mend its row of stations.csv, or take its deviations away"
        }
    }
}

fn in_deviations(covariance: &Matrix3<f64>, off: &Vector3<f64>) -> Option<f64> {
    covariance.cholesky().map(|factor| off.dot(&factor.solve(off)).sqrt())
}

fn of_step(covariance: &Matrix6<f64>, step: &Vector6<f64>) -> Option<f64> {
    covariance.cholesky().map(|factor| step.dot(&factor.solve(step)).sqrt())
}
