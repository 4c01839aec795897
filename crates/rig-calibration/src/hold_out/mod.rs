//! Whether a calibration of a rig predicts what its cameras observed at epochs that took no part in it.
//!
//! Every so many epochs are left out. What one camera observed there is then predicted from what the **other** cameras observed there:
//! their image points give the pose of the rig, and its mounting, lens and range terms, from all other epochs, do the rest. How large the
//! differences may be, with all correlations, follows from an adjustment that takes them in: vᵀPv grows by the squares of the
//! innovations, each in its own variance, as the redundancy grows. First the image points of a camera are taken in, then its ranges.

mod part;

use std::collections::{BTreeMap, BTreeSet};

use calibration_network::functional_model::{
    Datum, Excluded, Setup, Solved, Start, modelled_pixel, solve_rig_nearby, usual_sigmas,
};
use calibration_network::start_values::calibration_from;
use nalgebra::{Isometry3, Point3};
use self_calibration::{
    CalibrationOptions, CalibrationOutcome, Error as Cause, HoldOut, NetworkDatum, Prediction, TermSelection, outcome,
    range_difference,
};
use statistics::bonferroni;

use crate::alone::selection;
use crate::rig::Rig;
use crate::{Result, RigOutcome};
use part::{Keep, Part};

/// Probability that any camera's image points or ranges fail where the calibration is sound: that of the check of one camera.
const LEVEL: f64 = 0.004;

/// Leaves every `every`-th epoch of a rig out and compares, camera by camera, in their order, what the rest and the other cameras predict
/// with what it observed there. What `outcome`, the calibration of all epochs with these `options`, rejected takes no part; terms are
/// those that it estimated.
///
/// # Errors
/// [`Error::Calibration`](crate::Error::Calibration) for `every` below 2 and for fewer epochs than that; whatever an adjustment without
/// these epochs is refused for.
pub fn hold_out(rig: &Rig, options: &CalibrationOptions, outcome: &RigOutcome, every: usize) -> Result<Vec<HoldOut>> {
    if every < 2 || outcome.epochs.len() < every {
        let needs = format!("2 or more for a hold-out check, and as many epochs, found {every}");
        return Err(Cause::MethodNeeds { method: "rig".to_owned(), needs }.into());
    }
    let left_out = outcome.epochs.iter().skip(every - 1).step_by(every);
    let check = Check { rig, options, outcome, names: left_out.map(|epoch| epoch.name.as_str()).collect() };
    // All image points, and no ranges of the epochs left out.
    let ranged: Vec<usize> = (0..rig.cameras.len()).filter(|&index| rig.cameras[index].has_ranges()).collect();
    let with_images =
        check.adjusted(Keep { image: &|_, _| true, range: &|_, epoch| !check.is_left_out(epoch) }, &ranged)?;
    let tests = rig.cameras.iter().map(|camera| 1 + usize::from(camera.has_ranges())).sum();
    (0..rig.cameras.len()).map(|camera| check.camera(camera, &with_images, bonferroni(LEVEL, tests))).collect()
}

struct Check<'a> {
    rig: &'a Rig,
    options: &'a CalibrationOptions,
    outcome: &'a RigOutcome,
    /// The epochs left out.
    names: BTreeSet<&'a str>,
}

/// An adjustment of a part of the observations.
struct Adjusted {
    vtpv: f64,
    redundancy: i64,
    /// Of the cameras that are predicted.
    calibrations: BTreeMap<usize, CalibrationOutcome>,
}

impl Adjusted {
    /// By how much vᵀPv and redundancy are larger than before.
    fn beyond(&self, before: &Self) -> (f64, f64) {
        (self.vtpv - before.vtpv, (self.redundancy - before.redundancy) as f64)
    }
}

impl Check<'_> {
    fn is_left_out(&self, epoch: &str) -> bool {
        self.names.contains(epoch)
    }

    /// What of one camera is predicted.
    fn camera(&self, camera: usize, with_images: &Adjusted, level: f64) -> Result<HoldOut> {
        let own = &self.rig.cameras[camera];
        let before = self.adjusted(
            Keep {
                image: &|index, epoch| index != camera || !self.is_left_out(epoch),
                range: &|_, epoch| !self.is_left_out(epoch),
            },
            &[camera],
        )?;
        let [pixels, _] = self.differences(camera, &before);
        let subject = format!("image points of camera `{}` at epochs left out", own.name);
        let image = Prediction::new(&pixels, &subject, with_images.beyond(&before), level);
        let mut range = None;
        if own.has_ranges() {
            let with_ranges = self.adjusted(
                Keep { image: &|_, _| true, range: &|index, epoch| index == camera || !self.is_left_out(epoch) },
                &[],
            )?;
            let [_, ranges_m] = self.differences(camera, with_images);
            let subject = format!("ranges of camera `{}` at epochs left out", own.name);
            range = (!ranges_m.is_empty())
                .then(|| Prediction::new(&ranges_m, &subject, with_ranges.beyond(with_images), level));
        }
        let seen = own.epochs();
        let stations = self.names.iter().filter(|name| seen.contains(**name)).map(|name| (*name).to_owned());
        Ok(HoldOut { stations: stations.collect(), image, range })
    }

    /// Adjusts what is kept, from the values of the outcome; with the calibrations of the cameras that are wanted.
    fn adjusted(&self, keep: Keep<'_>, wanted: &[usize]) -> Result<Adjusted> {
        let part = Part::new(self.rig, self.outcome, &keep);
        let setups = self.setups(&part);
        let solved: Vec<Solved> = solve_rig_nearby(&setups)?;
        let own = |&camera: &usize| -> Result<(usize, CalibrationOutcome)> {
            Ok((camera, outcome(&setups[camera], &solved[camera], self.options)?))
        };
        let calibrations = wanted.iter().map(own).collect::<Result<_>>()?;
        let solution = &solved[0].solution;
        Ok(Adjusted { vtpv: solution.vtpv(), redundancy: solution.redundancy(), calibrations })
    }

    fn setups<'p>(&self, part: &'p Part) -> Vec<Setup<'p>> {
        let datum = if self.options.datum == NetworkDatum::Control { Datum::Control } else { Datum::Inner };
        let setup = |index: usize| {
            let (camera, network, found) =
                (&self.rig.cameras[index], &part.networks[index], &self.outcome.cameras[index]);
            let automatic = selection(camera, self.options) == TermSelection::Auto;
            let plain = |name: &String| name.split('@').next().unwrap_or(name).to_owned();
            Setup {
                network,
                start: Start {
                    stations: part.epochs.iter().map(|epoch| epoch * found.rig_from_camera).collect(),
                    targets: part.targets.iter().copied().map(Some).collect(),
                    relative: None,
                    mounting: (index > 0).then_some(found.rig_from_camera),
                },
                unused: None,
                calibration: calibration_from(network, found.calibration.camera, &found.calibration.range_models),
                estimated: found.calibration.estimated.iter().map(plain).collect(),
                ranged: network
                    .stations
                    .iter()
                    .map(|station| !self.options.without_ranges.contains(&station.name))
                    .collect(),
                passive: false,
                datum,
                geometry_held: false,
                camera_prior: None,
                term_sigmas: if automatic { usual_sigmas(network) } else { BTreeMap::new() },
                excluded: Excluded::default(),
            }
        };
        (0..part.networks.len()).map(setup).collect()
    }

    /// Observed less predicted, of a camera at the epochs left out: columns and rows, and ranges.
    fn differences(&self, camera: usize, adjusted: &Adjusted) -> [Vec<f64>; 2] {
        let mut all = [Vec::new(), Vec::new()];
        let Some(calibration) = adjusted.calibrations.get(&camera) else { return all };
        let network = &self.rig.cameras[camera].network;
        let poses: BTreeMap<&str, Isometry3<f64>> =
            calibration.stations.iter().map(|station| (station.name.as_str(), station.world_from_camera)).collect();
        let points: BTreeMap<&str, Point3<f64>> =
            calibration.targets.iter().map(|target| (target.name.as_str(), target.point)).collect();
        let rejected = part::rejected(&self.outcome.cameras[camera].calibration);
        for seen in &network.sightings {
            let (station, target) = (&network.stations[seen.station], network.targets[seen.target].name.as_str());
            let name = station.name.as_str();
            if !self.is_left_out(name) || rejected.contains(&(name, target)) {
                continue;
            }
            let (Some(pose), Some(point), Some(pixel)) = (poses.get(name), points.get(target), seen.pixel) else {
                continue;
            };
            if let Some(modelled) = modelled_pixel(&calibration.camera, pose, point) {
                all[0].extend([pixel[0] - modelled[0], pixel[1] - modelled[1]]);
            }
            let ranged = !self.options.without_ranges.contains(&station.name);
            all[1].extend(ranged.then(|| range_difference(calibration, station, seen, point, pose)).flatten());
        }
        all
    }
}
