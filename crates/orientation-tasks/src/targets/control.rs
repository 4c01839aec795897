//! Every station by itself, from targets whose coordinates are known.

use std::collections::BTreeMap;

use camera_model::Camera;
use commands::{Doubt, DoubtKind};
use nalgebra::{Matrix3, Point3, Vector3};
use orientation::{Error, Resection, ResectionOptions, TargetObservation, resect, robust_resection};
use pipeline::survey::StationPose;
use range_io::tables::Target;
use statistics::{Distribution, bonferroni, chi_squared_limit, upper_median};

use crate::camera::SurveyCamera;
use crate::outcome::{Outcome, Placed};
use crate::summary::{NotOriented, OrientSummary, RejectedValue};
use crate::targets::sightings::{Sighting, Sightings};

/// Level at which one target of a station, or the station as a whole, is said to contradict: once in a thousand sound stations.
const LEVEL: f64 = 0.001;
/// Targets that a station keeps: fewer let any pose pass.
const FEWEST: usize = 4;
/// Largest part of a station's targets that may contradict.
const MOST_REJECTED: f64 = 0.34;
/// Image points that lie this many times farther from a robust pose than the median are no part of the first solution.
const FAR: f64 = 6.0;

pub(crate) fn orient(camera: &SurveyCamera, sightings: &Sightings, targets: &[Target]) -> Outcome {
    let known: BTreeMap<&str, &Target> = targets.iter().map(|target| (target.target.as_str(), target)).collect();
    let mut summary = OrientSummary { datum: "the coordinates of targets.csv".to_owned(), ..OrientSummary::default() };
    if targets.iter().any(|target| target.sigma_m.is_none()) {
        summary.findings.push("coordinates of targets.csv without standard deviations were taken as exact".to_owned());
    }
    let mut stations = Vec::new();
    for (name, own) in &sightings.stations {
        let seen: Vec<(&Sighting, TargetObservation)> =
            own.iter().filter_map(|seen| Some((seen, observation(seen, known.get(seen.target.as_str())?)))).collect();
        let observed: Vec<TargetObservation> = seen.iter().map(|one| one.1).collect();
        match station(&camera.camera, &observed) {
            Ok(found) => {
                let rejected = seen.iter().zip(&found.used).filter(|(_, used)| !**used).map(|((seen, _), _)| seen);
                summary.rejected.extend(rejected.map(|seen| RejectedValue {
                    station: name.clone(),
                    target: seen.target.clone(),
                    part: "target",
                    line: seen.line,
                }));
                summary.doubts.extend(doubt(name, &found));
                let resection = found.resection;
                let pose = StationPose {
                    world_from_camera: resection.world_from_camera,
                    covariance: Some(resection.covariance),
                };
                stations.push(Placed {
                    targets: Some(resection.residuals.len()),
                    sigma0: resection.sigma0,
                    ..Placed::new(name, camera.times(name)[0], pose)
                });
            }
            Err(error) => summary.not_oriented.push(NotOriented { station: name.clone(), reason: words(&error) }),
        }
    }
    Outcome { summary, stations }
}

fn observation(seen: &Sighting, target: &Target) -> TargetObservation {
    let covariance =
        target.sigma_m.map(|sigma| Matrix3::from_diagonal(&Vector3::from(sigma.map(|sigma| sigma * sigma))));
    TargetObservation {
        point: Point3::from(target.position_m),
        point_covariance: covariance,
        pixel: seen.pixel,
        sigma_pixel: seen.sigma_pixel,
        range: seen.range,
    }
}

/// A station with the targets that took part.
struct Found {
    resection: Resection,
    used: Vec<bool>,
}

/// Resection that leaves out targets which contradict the others, the worst first, and is then made once more without a start, so
/// that other poses which explain them as well are found.
fn station(camera: &Camera, targets: &[TargetObservation]) -> Result<Found, Error> {
    let all = resect(camera, targets, &ResectionOptions::default());
    let everything = vec![true; targets.len()];
    match all {
        Ok(resection) if worst(&resection).is_none() => return Ok(Found { resection, used: everything }),
        Err(error) if targets.len() <= FEWEST => return Err(error),
        _ => {}
    }
    let Ok(start) = robust_resection(camera, targets) else {
        return all.map(|resection| Found { resection, used: everything });
    };
    let misses: Vec<f64> = targets.iter().map(|target| miss(camera, &start, target)).collect();
    let limit = FAR * upper_median(&mut misses.clone()).max(1.0);
    let mut used: Vec<bool> = misses.iter().map(|miss| *miss <= limit).collect();
    let most = (MOST_REJECTED * targets.len() as f64) as usize;
    loop {
        let kept: Vec<usize> = (0..targets.len()).filter(|&index| used[index]).collect();
        if kept.len() < FEWEST || targets.len() - kept.len() > most {
            // What most targets agree on is not there.
            return all.map(|resection| Found { resection, used: everything });
        }
        let chosen: Vec<TargetObservation> = kept.iter().map(|&index| targets[index]).collect();
        let near = ResectionOptions { approximate: Some(start), ..ResectionOptions::default() };
        let Some(bad) = worst(&resect(camera, &chosen, &near)?) else {
            let resection = resect(camera, &chosen, &ResectionOptions::default())?;
            return Ok(Found { resection, used });
        };
        used[kept[bad]] = false;
    }
}

/// The target that contradicts the others most, if one does.
fn worst(resection: &Resection) -> Option<usize> {
    let values = 2 * resection.residuals.len();
    let limit = Distribution::Normal.critical(bonferroni(LEVEL, values));
    let sizes = resection.residuals.iter().map(|residual| residual.standardised).enumerate();
    let worst = sizes.filter(|(_, size)| !size.is_nan()).max_by(|a, b| a.1.total_cmp(&b.1))?;
    (worst.1 > limit).then_some(worst.0)
}

/// Distance of an image point from where a pose puts it, in its standard deviations.
fn miss(camera: &Camera, pose: &nalgebra::Isometry3<f64>, target: &TargetObservation) -> f64 {
    let Ok(seen) = camera.observe(pose, &target.point) else { return f64::INFINITY };
    let [col, row] = camera.format.pixel_from_image(seen.image_mm);
    ((target.pixel[0] - col) / target.sigma_pixel[0]).hypot((target.pixel[1] - row) / target.sigma_pixel[1])
}

/// Residuals that are larger than stated.
fn doubt(name: &str, found: &Found) -> Option<Doubt> {
    let (sigma0, redundancy) = (found.resection.sigma0?, found.resection.redundancy as f64);
    let limit = (chi_squared_limit(redundancy, LEVEL) / redundancy).sqrt();
    (sigma0 > limit).then(|| {
        let words = format!(
            "its targets scatter {sigma0:.1} times as much as stated (by chance up to {limit:.1}): standard deviations, coordinates, \
             ranges that are not corrected, or a camera that is not calibrated"
        );
        Doubt::about(DoubtKind::Contradiction, name, words)
    })
}

/// Why a station was not oriented.
fn words(error: &Error) -> String {
    match error {
        Error::Ambiguous { poses, difference } => {
            let place = |pose: &nalgebra::Isometry3<f64>| {
                let at = pose.translation.vector;
                format!("({:.3}, {:.3}, {:.3})", at.x, at.y, at.z)
            };
            let places: Vec<String> = poses.iter().map(place).collect();
            format!(
                "{} poses explain its targets equally well, at {} m (v'Pv differs by {difference:.2}), as happens with few targets in \
                 one plane: a target off the plane, a range, or a nearer station decides",
                poses.len(),
                places.join(" and ")
            )
        }
        Error::TooFewTargets { found, needed } => {
            format!("{found} of its targets have coordinates in targets.csv, and {needed} are needed")
        }
        other => other.to_string(),
    }
}
